"""`ros2 msgflow`: the program as a command of ros2cli; only ros2cli imports this module."""

from __future__ import annotations

from argparse import REMAINDER, ArgumentParser, Namespace

from ros2cli.command import CommandExtension

_NO_PREFIX = "\0"


class MsgflowCommand(CommandExtension):  # type: ignore[misc]
    """Ask recorded traces where every message went, and where the time was lost."""

    def add_arguments(self, parser: ArgumentParser, cli_name: str) -> None:
        """Take all words as they are; msgflow itself reads `-h` and the other options."""
        parser.prefix_chars = _NO_PREFIX
        parser.add_argument("argv", nargs=REMAINDER)

    def main(self, *, parser: ArgumentParser, args: Namespace) -> None:
        """Run msgflow, and exit with its code."""
        from msgflow.cli.signals import HANDLER

        def run() -> None:
            from msgflow.cli.app import app

            app(args.argv, prog_name="ros2 msgflow")

        HANDLER.run(run)
