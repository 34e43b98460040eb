"""`msgflow` and `python -m msgflow`."""

import gc
import os
import signal
import sys


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

    gc.enable()
    app()


def program() -> None:
    """Run the program, and end the process.

    Python would free all that it has, piece by piece, which takes longer than to print a help. The
    system takes it all at once.
    """
    try:
        main()
    except SystemExit as end:
        # A profiler has not written yet what it found.
        if isinstance(end.code, int) and sys.getprofile() is sys.gettrace() is None:
            _end(end.code)
        raise


def _end(code: int) -> None:
    import atexit
    import threading

    for thread in threading.enumerate():
        if thread is not threading.main_thread() and not thread.daemon:
            thread.join()
    atexit._run_exitfuncs()
    try:
        for stream in (sys.stdout, sys.stderr):
            if stream is not None:
                stream.flush()
    except (OSError, ValueError):
        return  # Python tries again, and says so
    os._exit(code)


if __name__ == "__main__":
    program()
