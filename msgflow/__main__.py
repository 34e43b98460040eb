"""`msgflow` and `python -m msgflow`."""

import gc
import os
import signal


def main() -> None:
    """Run the program; its exit codes are those of `msgflow.errors.ExitCode`."""
    # Of Ctrl-C in the imports Python would print a traceback.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    # numpy's algebra, of which nothing is used, starts a thread per core and keeps it awake.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # Imports make objects that stay, and no garbage.
    gc.disable()
    from msgflow.cli.stop import STOP

    STOP.install()
    from msgflow.cli.app import app

    gc.freeze()
    gc.enable()
    app()


if __name__ == "__main__":
    main()
