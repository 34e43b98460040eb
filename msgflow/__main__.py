"""The program: `msgflow` and `python -m msgflow`."""

import os
import signal


def main() -> None:
    """Run the program."""
    # Until the handler is in place, Ctrl-C ends the process without a traceback.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    # numpy's linear algebra, which nothing uses, starts a thread per core.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from msgflow.cli.signals import HANDLER

    def run() -> None:
        # Its imports take long enough for a signal to come.
        from msgflow.cli.app import app

        app()

    HANDLER.run(run)


if __name__ == "__main__":
    main()
