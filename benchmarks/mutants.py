"""Which changes of the numbers and comparisons of SQL files no test notices.

    python benchmarks/mutants.py [FILE… --tests SELECTION…] [--line N]… [--replace OLD NEW]…
        [--timeout 300]

Collects the tests once, then for each number of the files (doubled, halved) and each comparison
(turned round), or each place of OLD, runs them in a child that reads the file with that one change.
Without files: the rules of `RULES`, each with the tests that are about it (`make mutants`).
No file is written. Prints a line for each change: the test that failed first, or `SURVIVED`.
Numbers 0 and 1 and those in comments and quotes are left alone. The exit code is 1 if a change
survived.
"""

from __future__ import annotations

import argparse
import os
import re
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from msgflow.db import derivation, objects

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

ROOT = Path(__file__).parents[1]
# Comments and quotes come first, so that nothing within them counts.
TOKEN = re.compile(
    r"--[^\n]*|'(?:[^']|'')*'|(?P<number>(?<![\w.])\d[\d_]*(?:\.\d+)?(?:e[-+]?\d+)?(?![\w.]))"
    r"|(?P<comparison><=|>=|<>|(?<![<>!:=-])[<>](?![<>=]))"
)
TURNED = {"<=": ">", ">=": "<", "<": ">=", ">": "<=", "<>": "="}
TRIVIAL = {"0", "1"}
# Rules with numbers of their own, and the tests that have to notice when one changes.
RULES = (
    (
        "link/nearest",
        ("test_nearest_rules", "test_pair_rules", "test_clock_rules", "test_stamp_clock"),
    ),
    ("delivery/delivery_limit.sql", ("test_delivery_rules", "test_orphan_rules")),
    ("delivery/undelivered.sql", ("test_delivery_rules",)),
    ("delivery/orphan_take.sql", ("test_orphan_rules", "test_delivery_rules")),
    ("clock/clock_hull.sql", ("test_clock_hull", "test_clock_pair")),
    ("clock/clock_pair.sql", ("test_clock_pair", "test_clock_hull")),
    ("clock/clock_line.sql", ("test_clock_pair", "test_clock_hull")),
    ("clock/clock_line_error.sql", ("test_clock_pair", "test_clock_hull")),
    ("clock/clock_sync.sql", ("test_clock_chain", "test_clock_pair")),
)


@dataclass(frozen=True)
class Mutant:
    """One change of a file: `begin` to `end` become `new`."""

    file: Path
    begin: int
    end: int
    old: str
    new: str
    line: int

    def __str__(self) -> str:
        """The place, as editors understand it, and the change."""
        return f"{self.file}:{self.line}: {self.old} → {self.new}"


def mutants(file: Path, replaced: Sequence[Sequence[str]]) -> Iterator[Mutant]:
    """Return every change of a file, given from the root of the checkout."""
    text = (ROOT / file).read_text()
    found = [
        (place.start(), old, new)
        for old, new in replaced
        for place in re.finditer(re.escape(old), text)
    ]
    if not replaced:
        found = [
            (match.start(), match[0], new) for match in TOKEN.finditer(text) for new in _new(match)
        ]
    for begin, old, new in found:
        yield Mutant(file, begin, begin + len(old), old, new, text.count("\n", 0, begin) + 1)


def _new(match: re.Match[str]) -> list[str]:
    old = match[0]
    if match["comparison"]:
        return [TURNED[old]]
    if not match["number"] or old in TRIVIAL:
        return []
    value = float(old)
    whole = value.is_integer() and "." not in old and "e" not in old
    return [str(round(each)) if whole else repr(each) for each in (value * 2, value / 2)]


class Loop:
    """Runs the collected tests for each change, in place of once."""

    def __init__(self, todo: Sequence[Mutant], timeout: int) -> None:
        self.todo = todo
        self.timeout = timeout
        self.survived = 0

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        """Run the tests without any change, and then with each."""
        if failure := self.first_failure(session, None):
            pytest.exit(f"fails without any change — {failure}", 2)
        for mutant in self.todo:
            failure = self.first_failure(session, mutant)
            self.survived += failure is None
            print(f"{mutant}  {failure or 'SURVIVED'}", flush=True)
        print(f"\n{len(self.todo)} changes, {self.survived} survived")
        return True

    def first_failure(self, session: pytest.Session, mutant: Mutant | None) -> str | None:
        """Return the first test that fails in a child; one that takes too long has failed."""
        reading, writing = os.pipe()
        child = os.fork()
        if child == 0:
            os.close(reading)
            signal.alarm(self.timeout)
            failure = "the tests cannot be run"
            try:
                failure = _run(session, mutant) or ""
            finally:
                os.write(writing, failure.encode())
                os._exit(0)
        os.close(writing)
        with os.fdopen(reading) as pipe:
            failure = pipe.read()
        _, status = os.waitpid(child, 0)
        return "timeout or crash" if status else failure or None


def _run(session: pytest.Session, mutant: Mutant | None) -> str | None:
    if mutant is not None:
        _change(mutant)
    with Path(os.devnull).open("w") as nowhere:
        os.dup2(nowhere.fileno(), 1)
        os.dup2(nowhere.fileno(), 2)
    for place, item in enumerate(session.items):
        following = session.items[place + 1] if place + 1 < len(session.items) else None
        failed = session.testsfailed
        item.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
        if session.testsfailed > failed:
            return item.nodeid
    return None


def _change(mutant: Mutant) -> None:
    """Let everything that reads the file find it changed."""
    read = Path.read_text

    def changed(path: Path, *arguments: str, **named: str) -> str:
        text = read(path, *arguments, **named)
        if path.name != mutant.file.name or path.resolve() != ROOT / mutant.file:
            return text
        return text[: mutant.begin] + mutant.new + text[mutant.end :]

    Path.read_text = changed  # type: ignore[assignment, method-assign]
    # What collecting the tests has read.
    for cached in (
        objects.load,
        objects.views,
        objects.definition_hash,
        derivation.derivation_hash,
    ):
        cached.cache_clear()


def every_rule(options: Sequence[str]) -> int:
    """Try every change of `RULES`, each in a process of its own; return the exit code."""
    codes = []
    for place, tests in RULES:
        found = ROOT / "schema" / place
        files = sorted(found.glob("*.sql")) if found.is_dir() else [found]
        command = [sys.executable, __file__, *(str(file.relative_to(ROOT)) for file in files)]
        command += ["--tests", *(f"tests/schema/{test}.py" for test in tests), *options]
        codes.append(subprocess.run(command, cwd=ROOT, check=False).returncode)
    return max(codes)


def main() -> None:
    """Try every change and say what survives."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE", help="from the root")
    parser.add_argument("--tests", nargs="+", help="what pytest is to run")
    parser.add_argument("--line", action="append", type=int, help="only changes of this line")
    parser.add_argument("--replace", action="append", nargs=2, default=[], metavar=("OLD", "NEW"))
    parser.add_argument("--timeout", type=int, default=300, help="seconds for the tests")
    arguments = parser.parse_args()
    if not arguments.files:
        sys.exit(every_rule(sys.argv[1:]))
    if not arguments.tests:
        parser.error("which tests? give --tests")
    loop = Loop(
        [
            mutant
            for file in arguments.files
            for mutant in mutants(file, arguments.replace)
            if not arguments.line or mutant.line in arguments.line
        ],
        arguments.timeout,
    )
    os.chdir(ROOT)
    options = ["-p", "no:cacheprovider", "-p", "no:xdist", "-s", *arguments.tests]
    code = pytest.main(options, plugins=[loop])
    sys.exit(code or bool(loop.survived))


if __name__ == "__main__":
    main()
