"""The kernel is compiled where that is possible, and never used where it does not fit."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from kernels import needs_kernel

from msgflow import kernel

ROOT = Path(__file__).resolve().parents[2]
LOADED = "from msgflow import kernel; print(kernel.library() is not None)"


@pytest.fixture
def hook() -> ModuleType:
    path = ROOT / "packaging" / "hatch_build.py"
    spec = importlib.util.spec_from_file_location("hatch_build", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def source(tmp_path: Path) -> Path:
    """A copy of the package of the kernel."""
    shutil.copytree(
        ROOT / "msgflow" / "kernel", tmp_path / "kernel", ignore=shutil.ignore_patterns("*.so")
    )
    return tmp_path / "kernel" / "kernel.c"


@pytest.mark.parametrize("compiler", ["/nonexistent", "false"])
def test_no_compiler(
    hook: ModuleType, source: Path, compiler: str, monkeypatch: Any, capsys: Any
) -> None:
    """Said once, and nothing is left behind."""
    monkeypatch.setenv("CC", compiler)
    before = sorted(source.parent.iterdir())
    assert not hook.compile_kernel(source, source.with_name("kernel.so"))
    assert sorted(source.parent.iterdir()) == before
    assert capsys.readouterr().err.startswith("note: the kernel of msgflow is not compiled")


@needs_kernel
def test_of_another_source(hook: ModuleType, source: Path, monkeypatch: Any) -> None:
    library = source.with_name("kernel.so")
    if not hook.compile_kernel(source, library):
        pytest.skip("no C compiler")
    monkeypatch.setattr(kernel, "SOURCE", source)
    monkeypatch.setattr(kernel, "LIBRARY", library)
    assert kernel.library.__wrapped__() is not None
    source.write_text(source.read_text() + "\n")
    assert kernel.library.__wrapped__() is None


def test_left_out_by_a_variable() -> None:
    environment = {**os.environ, kernel.VARIABLE: "off"}
    done = subprocess.run(
        [sys.executable, "-c", LOADED], env=environment, check=True, capture_output=True, text=True
    )
    assert done.stdout == "False\n"


def test_no_library(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setattr(kernel, "LIBRARY", tmp_path / "kernel.so")
    assert kernel.library.__wrapped__() is None


def test_a_wheel_made_without_compiler_fits_any_machine(tmp_path: Path) -> None:
    """It is installed anywhere, and complete."""
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)],
        cwd=ROOT,
        env={**os.environ, "CC": "/nonexistent"},
        check=True,
        capture_output=True,
    )
    (wheel,) = tmp_path.glob("*.whl")
    assert wheel.name.endswith("-py3-none-any.whl")


def test_a_wheel_for_another_machine_has_its_name_and_its_compiler(tmp_path: Path) -> None:
    """The compiler may have options, and a space in its path."""
    compiler = tmp_path / "a compiler"
    compiler.write_text(
        '#!/bin/sh\n[ "$1" = "-target" ] || exit 1\n'
        'while [ "$1" != "-o" ]; do shift; done\necho other > "$2"\n'
    )
    compiler.chmod(0o755)
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)],
        cwd=ROOT,
        env={
            **os.environ,
            "CC": f"'{compiler}' -target other",
            "TMPDIR": str(temporary),
            "_PYTHON_HOST_PLATFORM": "linux-aarch64",
        },
        check=True,
        capture_output=True,
    )
    (wheel,) = tmp_path.glob("*.whl")
    assert wheel.name.endswith("-py3-none-linux_aarch64.whl")
    assert zipfile.ZipFile(wheel).read("msgflow/kernel/kernel.so") == b"other\n"
    assert not [*temporary.iterdir()]
