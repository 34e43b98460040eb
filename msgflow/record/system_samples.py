"""Samples of what the system does meanwhile, written beside a recording."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from msgflow.record import sampler
from msgflow.trace.discovery import SYSTEM_SAMPLES

_LONGEST_END = 5.0


@contextmanager
def sampled(directory: Path, note: Callable[[str], None]) -> Iterator[None]:
    """Have threads, programs and the machine sampled during the block, into a file of a directory.

    What goes wrong ends the samples, and never the recording: `note` gets a sentence.
    """
    with tempfile.TemporaryFile("w+") as words:
        # It needs no packages. A group of its own: Ctrl-C of the terminal is not for it.
        try:
            child = subprocess.Popen(
                [sys.executable, "-I", "-S", sampler.__file__, str(directory / SYSTEM_SAMPLES)],
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=words,
                start_new_session=True,
            )
        except OSError as error:
            note(f"the system is not sampled: {(error.strerror or str(error)).lower()}")
            yield
            return
        try:
            yield
        finally:
            assert child.stdin is not None
            child.stdin.close()
            try:
                child.wait(_LONGEST_END)
            except subprocess.TimeoutExpired:
                child.kill()
                child.wait()
            if child.returncode:
                words.seek(0)
                said = words.read().strip().splitlines()
                reason = said[-1] if said else f"exit code {child.returncode}"
                note(f"the system is not sampled until the end of the recording: {reason}")
