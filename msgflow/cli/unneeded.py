"""Leaves out what Typer imports for help and errors, and what ours never need.

Typer can print help that is written in Markdown, and tracebacks in colours. Importing what that
takes, two parsers, is a third of the time of `msgflow --help`.
"""

from __future__ import annotations

import importlib
import sys
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import PathFinder
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Sequence
    from importlib.machinery import ModuleSpec

_PRINTER = "typer.rich_utils"
_UNNEEDED = ("rich.markdown", "rich.traceback")


class _Later(type):
    """A class in whose place another one is imported, when it is used after all."""

    place: tuple[str, str]

    def _real(cls) -> Any:
        module, name = cls.place
        return getattr(importlib.import_module(module), name)

    def __call__(cls, *args: Any, **options: Any) -> Any:
        return cls._real()(*args, **options)

    def __getattr__(cls, name: str) -> Any:
        return getattr(cls._real(), name)


class _Empty(ModuleType):
    """A module of which every class is `_Later`."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return _Later(name, (), {"place": (self.__name__, name)})


class _Leaner(MetaPathFinder, Loader):
    """Finds the module of Typer that prints help, and lets it import less."""

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        spec = PathFinder.find_spec(name, path, target) if name == _PRINTER else None
        if spec is not None and spec.loader is not None:
            self._loader = spec.loader
            spec.loader = self
        return spec

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        return self._loader.create_module(spec)

    def exec_module(self, module: ModuleType) -> None:
        left_out = {name: _Empty(name) for name in _UNNEEDED if name not in sys.modules}
        sys.modules.update(left_out)
        try:
            self._loader.exec_module(module)
        finally:
            for name in left_out:
                del sys.modules[name]


def leave_out() -> None:
    """Let Typer import what it needs for help and errors, and no more."""
    if not any(isinstance(finder, _Leaner) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Leaner())
