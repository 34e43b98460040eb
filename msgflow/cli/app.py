"""The program `msgflow`: a group of commands, each imported when it is run.

Another distribution adds a command by an entry point of the group `msgflow.commands`, which names a
module. The help shows the summary of that distribution.
"""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.metadata import entry_points
from inspect import getdoc
from itertools import takewhile
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from msgflow.cli.completion import is_completing
from msgflow.cli.errors import print_exception
from msgflow.cli.help import lay_out_help
from msgflow.cli.output import discard_stdout, print_error
from msgflow.cli.signals import HANDLER
from msgflow.errors import ExitCode, UsageError, require_utf8
from msgflow.sql.interrupt import Terminated
from msgflow.text.installation import install_command
from msgflow.version import __version__

COMMANDS = (
    "record",
    "watch",
    "ingest",
    "query",
    "why",
    "predict",
    "flow",
    "graph",
    "ui",
    "report",
    "compare",
    "verify",
    "sql",
    "info",
    "check",
    "runs",
    "links",
    "suggest",
    "clocks",
    "export",
    "events",
    "bag",
    "db",
    "fleet",
    "mcp",
)
"""The commands in the order in which a user needs them.

Each is a module of `msgflow.cli`, whose first sentence is the summary in the help. It has a
function `command`, or a group `app`. Its class `Command`, if it has one, reads the words of the
function. Its function `asked` returns the command of a query if the words behind the name ask that.
"""
_MORE = frozenset(("bag", "db", "events", "fleet", "mcp", "simulate"))
"""What users of one robot rarely need: it has a panel of its own in the help."""
_ADDED = "msgflow.commands"


class RootGroup(TyperGroup):
    """The group of all commands: it imports a command when it runs, and lets no exception out."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.commands = {name: _listed(name, _summary(name)) for name in COMMANDS}
        lay_out_help(self)

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of all commands, those of other distributions last."""
        for point in entry_points(group=_ADDED):
            summary = point.dist.metadata["Summary"] if point.dist else None
            self.commands.setdefault(point.name, _listed(point.name, summary))
        return super().list_commands(ctx)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the name, the imported command, and the words behind it."""
        # Behind `--` stands a program of the user.
        for word in takewhile(lambda word: word != "--", args):
            require_utf8(word)
        if args[0] not in COMMANDS and args[0] not in self.list_commands(ctx):
            from msgflow.query.catalogue import queries_meant

            if args[0] == "simulate":
                raise UsageError(
                    "the simulator is not installed",
                    f"in a checkout of msgflow: {install_command('./simulator')}",
                )
            if meant := queries_meant(args[0]):
                hint = " or ".join(header.command for header in meant)
                raise UsageError(f"there is no such command — {args[0]}", hint)
        name, summary, rest = super().resolve_command(ctx, args)
        return name, summary and _imported(str(name), rest), rest

    def main(self, *args: Any, **options: Any) -> None:
        """Run a command line; an exception becomes a message and an exit code."""
        options["standalone_mode"] = False
        try:
            code = ExitCode(super().main(*args, **options) or 0)
        except typer.Abort:
            code = ExitCode.INTERRUPTED
        except Exception as error:
            # After a signal the failure is only its consequence. A shell would show a message amid
            # the line that the user types.
            is_silent = HANDLER.came or is_completing()
            code = ExitCode.OK if is_silent else print_exception(error)
        code = HANDLER.came or code
        if code in (ExitCode.INTERRUPTED, ExitCode.TERMINATED):
            print_error(code.name.lower())
        sys.exit(int(code))

    def invoke(self, ctx: Any) -> Any:
        """Run the command; a reader that goes away (`… | head`) ends it quietly."""
        try:
            value = super().invoke(ctx)
            if sys.stdout is not None:
                sys.stdout.flush()
        except BrokenPipeError:
            discard_stdout()
            raise typer.Exit(ExitCode.OK) from None
        except Terminated:
            # Typer ends every KeyboardInterrupt with the exit code of Ctrl-C.
            raise typer.Exit(ExitCode.TERMINATED) from None
        return value


def _listed(name: str, summary: str | None) -> TyperCommand:
    return TyperCommand(name, help=summary, rich_help_panel="More" if name in _MORE else None)


def _summary(name: str) -> str:
    """Return the first sentence of the module of a command, without importing it."""
    text = Path(__file__).with_name(f"{name}.py").read_text(encoding="utf-8")
    return text.split('"""')[1].partition("\n\n")[0]


def _imported(name: str, words: list[str]) -> Any:
    is_own = name in COMMANDS
    module = import_module(f"msgflow.cli.{name}") if is_own else _loaded(name)
    members = vars(module)
    if "asked" in members:
        query = module.asked(words)
        if query is not None:
            return query
    summary = [_summary(name)] if is_own else []
    around = typer.Typer(add_completion=False)
    around.callback()(lambda: None)
    if "app" in members:
        around.add_typer(module.app, name=name, help="".join(summary) or None)
    else:
        text = "\n\n".join([*summary, getdoc(module.command) or ""])
        around.command(name, cls=members.get("Command"), help=text)(module.command)
    return lay_out_help(typer.main.get_group(around).commands[name])


def _loaded(name: str) -> Any:
    point = entry_points(group=_ADDED)[name]
    try:
        return point.load()
    except ImportError as error:
        owner = point.dist.name if point.dist else point.value
        raise UsageError(
            f"the command {name} cannot be imported: {error} — {owner}",
            f"pip install --upgrade {owner}",
        ) from error


app = typer.Typer(
    name="msgflow",
    cls=RootGroup,
    help="ROS 2 traces as a relational database: where every message went, what it caused, and"
    " where the time was lost.",
    epilog="Begin with: msgflow ingest TRACE, then: msgflow why",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"msgflow {__version__}")
        raise typer.Exit()


@app.callback(invoke_without_command=True)
def root(
    context: typer.Context,
    version: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version"),
    ] = False,
) -> None:
    """Print the help where no command is given."""
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())
