"""A group of commands one of which is meant where none is named."""

from __future__ import annotations

from typing import Any

from typer.core import TyperGroup

_HELP = ("--help", "-h")


def with_default(name: str) -> type[TyperGroup]:
    """Return the class of a group that runs its command `name` where no command is named."""

    class DefaultGroup(TyperGroup):
        """A group with a default; help, and what is no option, stay as they are."""

        def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
            """Put the default in front where nothing or an option comes first."""
            if not args or (args[0].startswith("-") and args[0] not in _HELP):
                args = [name, *args]
            return super().parse_args(ctx, args)

    return DefaultGroup
