"""Which changes of the numbers and comparisons of an SQL file no test notices.

    python benchmarks/mutants.py FILE… --tests SELECTION… [--line N]… [--timeout 600]

Copies the checkout, then for each number of the files (doubled, halved) and each comparison
(turned round) runs the tests with that one change. Prints a line for each: the test that failed
first, or `SURVIVED`. Numbers 0 and 1 and those in comments and quotes are left alone. The exit code
is 1 if a change survived.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).parents[1]
LEFT_OUT = (".git", ".venv", ".mypy_cache", ".pytest_cache", ".ruff_cache", "__pycache__")
# Comments and quotes come first, so that nothing within them counts.
TOKEN = re.compile(
    r"--[^\n]*|'(?:[^']|'')*'|(?P<number>(?<![\w.])\d+(?:\.\d+)?(?:e\d+)?(?![\w.]))"
    r"|(?P<comparison><=|>=|<>|(?<![<>!:=-])[<>](?![<>=]))"
)
TURNED = {"<=": ">", ">=": "<", "<": ">=", ">": "<=", "<>": "="}
TRIVIAL = {"0", "1"}


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


def mutants(file: Path) -> Iterator[Mutant]:
    """Return every change of a file, given from the root of the checkout."""
    text = (ROOT / file).read_text()
    for match in TOKEN.finditer(text):
        old = match[0]
        changes: list[str] = []
        if match["number"] and old not in TRIVIAL:
            value = float(old)
            whole = value.is_integer() and "." not in old and "e" not in old
            changes = [str(round(each)) if whole else repr(each) for each in (value * 2, value / 2)]
        elif match["comparison"]:
            changes = [TURNED[old]]
        line = text.count("\n", 0, match.start()) + 1
        for new in changes:
            yield Mutant(file, match.start(), match.end(), old, new, line)


def caught_by(mutant: Mutant, checkout: Path, tests: list[str], timeout: float) -> str | None:
    """Return the first test that fails with a change, or None if all pass."""
    path = checkout / mutant.file
    text = path.read_text()
    path.write_text(text[: mutant.begin] + mutant.new + text[mutant.end :])
    try:
        return first_failure(checkout, tests, timeout)
    finally:
        path.write_text(text)


def first_failure(checkout: Path, tests: list[str], timeout: float) -> str | None:
    """Run the tests of a checkout; a run that takes too long has failed."""
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *tests]
    try:
        done = subprocess.run(
            command, cwd=checkout, env={"PYTHONPATH": str(checkout), "PATH": ""},
            capture_output=True, text=True, timeout=timeout, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return "timeout"
    if done.returncode == 0:
        return None
    failed = re.search(r"^(?:FAILED|ERROR) (\S+)", done.stdout, re.MULTILINE)
    return failed[1] if failed else f"exit code {done.returncode}"


def main() -> None:
    """Try every change and say what survives."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="from the root")
    parser.add_argument("--tests", nargs="+", required=True, help="what pytest is to run")
    parser.add_argument("--line", action="append", type=int, help="only changes of this line")
    parser.add_argument("--timeout", type=float, default=600, help="seconds for the tests")
    arguments = parser.parse_args()
    todo = [
        mutant
        for file in arguments.files
        for mutant in mutants(file)
        if not arguments.line or mutant.line in arguments.line
    ]
    survived = 0
    with tempfile.TemporaryDirectory() as temporary:
        checkout = Path(temporary) / "checkout"
        shutil.copytree(ROOT, checkout, ignore=shutil.ignore_patterns(*LEFT_OUT))
        if failure := first_failure(checkout, arguments.tests, arguments.timeout):
            sys.exit(f"fails without any change — {failure}")
        for mutant in todo:
            caught = caught_by(mutant, checkout, arguments.tests, arguments.timeout)
            survived += caught is None
            print(f"{mutant}  {caught or 'SURVIVED'}", flush=True)
    print(f"\n{len(todo)} changes, {survived} survived")
    sys.exit(1 if survived else 0)


if __name__ == "__main__":
    main()
