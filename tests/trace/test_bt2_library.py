"""Finding Babeltrace 2's bindings, or saying what to do."""

from __future__ import annotations

import subprocess
import sys
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from typing import Any

import pytest

from msgflow.errors import TraceError
from msgflow.trace import bt2_library


@pytest.fixture
def no_bt2(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """As if bt2 were in no Python; returns the only place that is searched."""
    for name in [name for name in sys.modules if name.partition(".")[0] == "bt2"]:
        monkeypatch.delitem(sys.modules, name)

    class Refuse:
        def find_spec(self, name: str, path: object = None, target: object = None) -> None:
            if name == "bt2":
                raise ModuleNotFoundError("No module named 'bt2'", name="bt2")

    monkeypatch.setattr(sys, "meta_path", [Refuse(), *sys.meta_path])
    monkeypatch.setattr(bt2_library, "PREFIXES", (str(tmp_path),))
    return tmp_path


def package(root: Path, suffix: str, init: str = "") -> Path:
    directory = root / "python3/dist-packages/bt2"
    directory.mkdir(parents=True)
    (directory / "__init__.py").write_text(init)
    (directory / f"_native_bt{suffix}").touch()
    return directory


def test_not_installed(no_bt2: Path) -> None:
    with pytest.raises(TraceError, match="are not installed") as caught:
        bt2_library.load()
    assert caught.value.hint == "apt install python3-bt2"


@pytest.mark.parametrize(
    ("tag", "version", "hint"),
    [
        ("399", r"3\.99", "install msgflow for it: /usr/bin/python3.99"),
        ("310", r"3\.10", "if that is 3.10 or newer"),
        ("36m", r"3\.6", "if that is 3.10 or newer"),
    ],
)
def test_installed_for_another_python(no_bt2: Path, tag: str, version: str, hint: str) -> None:
    package(no_bt2, f".cpython-{tag}-x86_64-linux-gnu.so")
    with pytest.raises(TraceError, match=rf"for Python {version}, msgflow runs in") as caught:
        bt2_library.load()
    assert hint in (caught.value.hint or "")


def test_broken(no_bt2: Path) -> None:
    package(no_bt2, EXTENSION_SUFFIXES[0], "raise ImportError('libbabeltrace2.so.0: not found')")
    with pytest.raises(TraceError, match=r"cannot be imported — libbabeltrace2.so.0: not found"):
        bt2_library.load()
    assert "bt2" not in sys.modules


def test_found_without_touching_the_path(bt2_bindings: Any) -> None:
    script = (
        "import sys; before = list(sys.path); from msgflow.trace import bt2_library; "
        "assert bt2_library.load().__version__ >= '2'; "
        "assert sys.path == before"
    )
    subprocess.run([sys.executable, "-c", script], check=True)


def test_twice_is_the_same(bt2_bindings: Any) -> None:
    assert bt2_library.load() is bt2_bindings


def test_importing_the_package_is_cheap() -> None:
    script = "import sys, msgflow.trace; print(*{m.partition('.')[0] for m in sys.modules})"
    result = subprocess.run(
        [sys.executable, "-c", script], check=True, capture_output=True, text=True
    )
    assert not {"bt2", "pyarrow", "duckdb", "numpy", "pandas"} & set(result.stdout.split())
