"""Modules that are imported while something else is done."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from msgflow.cli.meanwhile import import_meanwhile


def test_a_module_is_imported_in_another_thread(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    name = "imported_by_a_thread"
    body = "import threading\nthread = threading.current_thread().name\n"
    (tmp_path / f"{name}.py").write_text(body, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    thread = import_meanwhile(name)
    assert thread is not None
    thread.join()
    assert sys.modules[name].thread == f"import {name}"
    assert import_meanwhile(name) is None
    del sys.modules[name]


def test_what_cannot_be_imported_is_told_by_whoever_needs_it(
    capfd: pytest.CaptureFixture[str],
) -> None:
    thread = import_meanwhile("no_module_of_this_name")
    assert thread is not None
    thread.join()
    assert capfd.readouterr() == ("", "")
