"""Groups with a default command: `msgflow runs` means `msgflow runs list`."""

from __future__ import annotations

from typing import Any

from typer.core import TyperGroup

_HELP = ("--help", "-h")


def with_default(name: str) -> type[TyperGroup]:
    """Return the class of a group that runs its command `name` when the user names none."""

    class DefaultGroup(TyperGroup):
        """A group with a default command."""

        def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
            """Put the default command in front, unless a command or --help comes first."""
            if not args or (args[0].startswith("-") and args[0] not in _HELP):
                args = [name, *args]
            return super().parse_args(ctx, args)

    return DefaultGroup
