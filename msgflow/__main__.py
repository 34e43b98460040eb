"""`msgflow` and `python -m msgflow`."""

from msgflow.cli.stop import STOP


def main() -> None:
    """Run the program; its exit codes are those of `msgflow.errors.ExitCode`."""
    # Before the imports, which take longest.
    STOP.install()
    from msgflow.cli.app import app

    app()


if __name__ == "__main__":
    main()
