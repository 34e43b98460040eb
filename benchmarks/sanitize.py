"""Runs the compiled kernel on damaged traces with sanitizers of addresses and undefined behaviour.

    python benchmarks/sanitize.py [--cases 3000] [--first 0] [--seed 1]

Compiles the kernel for that, with gcc or what CC says, and reads small traces of random layouts,
most of them damaged, with it and without. Every third case instead gives the functions of the
kernel damaged parts of packets, hundreds of them. A sanitizer that finds something ends the
process; the number of the case is one of the hundred from the last that was printed on. The exit
code is 1 where batches differ, too.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from random import Random
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "packaging"), str(ROOT / "tests" / "support")]
FLAGS = ("-g", "-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
LIBRARY = "MSGFLOW_SANITIZED"


def main() -> None:
    """Compile, start again below the sanitizer, go through the cases."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=3000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    if LIBRARY not in os.environ:
        sys.exit(start())
    from msgflow import kernel

    kernel.LIBRARY = Path(os.environ[LIBRARY])
    if kernel.library() is None:
        sys.exit("the sanitized kernel cannot be loaded")
    different = 0
    for case in range(arguments.first, arguments.first + arguments.cases):
        if case % 100 == 0:
            print(f"case {case}", flush=True)
        try:
            run_case(case, Random(f"{arguments.seed} {case}"))
        except AssertionError as error:
            different += 1
            print(f"case {case}: {error}", flush=True)
    print(f"{arguments.cases} cases, {different} with batches that differ")
    sys.exit(bool(different))


def start() -> int:
    """Run this program again with the sanitizers; return its exit code."""
    from hatch_build import compile_kernel

    with tempfile.TemporaryDirectory() as directory:
        library = Path(directory, "kernel.so")
        if not compile_kernel(ROOT / "msgflow" / "kernel" / "kernel.c", library, *FLAGS):
            return 1
        compiler = os.environ.get("CC", "cc")
        runtime = subprocess.run(
            [compiler, "-print-file-name=libasan.so"], capture_output=True, text=True, check=True
        ).stdout.strip()
        environment = {
            **os.environ,
            LIBRARY: str(library),
            "LD_PRELOAD": runtime,
            # Python keeps its own until the end.
            "ASAN_OPTIONS": "detect_leaks=0:abort_on_error=0",
            "PYTHONMALLOC": "malloc",
        }
        command = [sys.executable, *sys.argv]
        return subprocess.run(command, env=environment, check=False).returncode


def run_case(case: int, random: Random) -> None:
    """Read one trace with the kernel and without, or call the kernel directly."""
    from ctf_layouts import Style, TraceMaker
    from kernels import without_kernel
    from mutations import MUTATIONS
    from same_batches import differences, read

    from msgflow.errors import TraceError

    style = Style(*(random.random() < 0.5 for _ in range(4)))
    with tempfile.TemporaryDirectory() as directory:
        trace = TraceMaker(style, random).write(Path(directory, "trace"), 4, 6)
        if case % 3 == 0:
            feed(trace, random)
            return
        for _ in range(random.randrange(4)):
            random.choice(MUTATIONS)(trace, random)

        def contents() -> Any:
            try:
                return read(trace)
            except TraceError as error:
                return str(error)

        fast = contents()
        with without_kernel():
            slow = contents()
    if isinstance(fast, str) or isinstance(slow, str):
        assert fast == slow, f"{fast} and {slow}"
        return
    # A NaN is not equal to itself, but its text is.
    different = [text for text in differences(fast, slow) if "nan" not in text]
    assert not different, different
    assert fast.damages == slow.damages, f"{fast.damages} and {slow.damages}"


def feed(trace: Path, random: Random) -> None:
    """Let the kernel look for events in packets cut and changed anywhere."""
    import numpy as np
    from mutations import streams

    import msgflow.trace
    from msgflow.trace.ctf.compiled import compiled
    from msgflow.trace.ctf.layout import Span
    from msgflow.trace.ctf.memory import Memory
    from msgflow.trace.ctf.plans import make_plan

    stream = max(streams(trace), key=lambda path: path.stat().st_size).read_bytes()
    with msgflow.trace.open([trace]) as traces:
        for layout in traces._layouts:  # type: ignore[attr-defined]
            fast = compiled(layout)
            if fast is None:
                continue
            for _ in range(200):
                begin = random.randrange(len(stream))
                content = bytearray(stream[begin : begin + random.randrange(1, 3000)])
                for _ in range(random.choice((0, 3, 100))):
                    content[random.randrange(len(content))] = random.randrange(256)
                memory = Memory(content)
                align = layout.header.align
                first = random.randrange(len(content)) // align * align
                limit = random.randrange(first, len(content) + 1)
                end = -(-limit // align) * align
                found = fast.scan(layout, memory, Span(0, first, end, limit))
                count = found.positions.size
                headers = fast.headers(
                    memory, found.positions, np.array([count]), np.array([7], np.uint64)
                )
                for known in layout.classes.values():
                    plan = make_plan(layout, known, wanted_of(known))
                    bodies = headers.bodies[headers.classes == known.number]
                    anywhere = np.array(
                        [random.randrange(-9, len(content) + 9) for _ in range(5)], np.int64
                    )
                    for places in (bodies, anywhere):
                        plan.gatherer.gather(memory, places, None)


def wanted_of(known: Any) -> Any:
    """Return all columns of an event class."""
    from msgflow.trace.ctf.arrow_types import declared_schema

    return declared_schema(known.event.payload)


if __name__ == "__main__":
    main()
