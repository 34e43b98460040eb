"""Compiles the kernel where there is a C compiler; msgflow is complete without."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import zlib
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

FLAGS = ("-std=c11", "-O2", "-Wall", "-Wextra", "-fPIC", "-shared")
DIRECTORY = Path("msgflow", "kernel")


class KernelHook(BuildHookInterface):  # type: ignore[type-arg]
    """Puts the compiled kernel into a wheel, or beside its source if that is installed editable."""

    _directory: str | None = None

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile it, and say so where that does not work."""
        if self.target_name != "wheel":
            return
        source = Path(self.root, DIRECTORY, "kernel.c")
        if version == "editable":
            compile_kernel(source, source.with_name("kernel.so"))
            return
        self._directory = tempfile.mkdtemp()
        library = Path(self._directory, "kernel.so")
        if compile_kernel(source, library):
            build_data["force_include"][str(library)] = str(DIRECTORY / "kernel.so")
            build_data["pure_python"] = False
            platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
            build_data["tag"] = f"py3-none-{platform}"

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove what is in the wheel now."""
        if self._directory is not None:
            shutil.rmtree(self._directory)


def compile_kernel(source: Path, library: Path, *flags: str) -> bool:
    """Compile it; tell whether that worked."""
    if not sys.platform.startswith("linux"):
        return False
    made_from = f"-DMSGFLOW_SOURCE={zlib.crc32(source.read_bytes())}u"
    compiler = shlex.split(os.environ.get("CC", "cc"))
    # A process may have the old one in use.
    new = library.with_suffix(f".{os.getpid()}")
    command = [*compiler, *FLAGS, *flags, made_from, "-o", str(new), str(source)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        problem = done.stderr.strip() if done.returncode else ""
        if not problem:
            new.replace(library)
            return True
    except (OSError, UnicodeDecodeError) as error:
        problem = str(error)
    finally:
        new.unlink(missing_ok=True)
    print(
        "note: the kernel of msgflow is not compiled, it reads large traces slower: "
        + (problem or "the compiler failed"),
        file=sys.stderr,
    )
    return False
