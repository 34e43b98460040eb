"""Which changes of SQL files no test notices.

    python benchmarks/mutants.py [FILE… --tests SELECTION…] [--line N]… [--replace OLD NEW]…
        [--timeout 300]

For each change, or each place of OLD, runs the tests in a child that reads the file with that one
change. A number is doubled and halved; a comparison, a function, a join and a truth value become
their opposite; a condition, a branch of a CASE and a part of a UNION are left out.
Without files: the rules of `RULES`, each with the tests that are about it (`make mutants`).
No file is written. Prints a line for each change: the test that failed first, or `SURVIVED`.
Numbers 0 and 1, what comments and quotes hold, and conditions that only choose the run are left
alone. The exit code is 1 if a change survived.
"""

from __future__ import annotations

import argparse
import os
import re
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
# Comments and quotes come first, so that nothing within them counts.
TOKEN = re.compile(
    r"(?P<skipped>--[^\n]*)|'(?:[^']|'')*'"
    r"|(?P<number>(?<![\w.])\d[\d_]*(?:\.\d+)?(?:e[-+]?\d+)?(?![\w.]))"
    r"|\$?[A-Za-z_]\w*|->|=>|[<>!:]=|<>|[^\s]"
)
# Numbers that change nothing where they count rows, and everything where they name a column.
TRIVIAL = {"0", "1"}
PAIRS = (
    ("<=", ">"), ("<", ">="), ("=", "<>"), ("min", "max"), ("least", "greatest"),
    ("lag", "lead"), ("bool_and", "bool_or"), ("arg_min", "arg_max"),
    ("arg_min_null", "arg_max_null"), ("SEMI", "ANTI"), ("true", "false"),
)  # fmt: skip
OPPOSITE = dict(PAIRS) | {new: old for old, new in PAIRS}
# A condition with `=` is left out instead: its opposite is further off, and noticed sooner.
DROPPED_ALONE = {"="}
BEFORE_CONDITION = {"WHERE", "ON", "HAVING", "QUALIFY", "WHEN", "AND", "OR"}
BEHIND_CONDITION = {
    "AND", "OR", "THEN", "GROUP", "HAVING", "QUALIFY", "WINDOW", "ORDER", "LIMIT", "UNION",
    "JOIN", "LEFT", "ASOF", "SEMI", "ANTI", "CROSS", "WHERE", "AS", "ELSE", "END", ",",
}  # fmt: skip
ONLY_RUN = re.compile(r"(\w+\.)?run_id (= (only_run|\w+\.run_id)|IN \(SELECT run_id FROM \w+\))")
# Findings with conditions of their own: their golden cases have to notice when one changes.
FINDINGS = (
    "busy_waiting",
    "clock_jumps",
    "clock_set",
    "discarded_events",
    "doubtful_answer",
    "latency_uncertain",
    "missing_layer",
    "path_cut",
    "process_fell_silent",
    "service_without_callbacks",
    "started_late",
    "stream_ends_early",
    "untaken_request",
)
# Kinds of culprits that limits decide of.
CULPRITS = (
    "burst", "callback", "late_start", "lock", "lost", "never_matched", "no_cpu", "overload",
    "service", "stale", "waits",
)  # fmt: skip
# Rules about messages that are matched by time, with cases of their own.
NEAREST = (
    "agreed_difference", "clock_drift", "clock_step", "publication_beside_gap", "unstamped_call",
    "unstamped_message", "unstamped_publication",
)  # fmt: skip
# No finding of the input says that it found nothing.
NOTHING_FOUND = "model/test_findings.py"
# Likewise rules, and the tests that are about them.
RULES = (
    (
        "link/nearest",
        (
            *(f"schema/cases/derive.{each}" for each in NEAREST),
            "schema/test_nearest_rules.py",
            "schema/test_pair_rules.py",
            "schema/test_clock_rules.py",
            "schema/test_stamp_clock.py",
        ),
    ),
    (
        "link/transport/link_transport_nearest.sql",
        ("schema/cases/derive.link_transport_nearest",),
    ),
    ("link/causal/answer_doubtful.sql", ("schema/test_answer_doubtful.py",)),
    (
        "link/causal/timed_publisher.sql",
        ("schema/cases/derive.timed_publisher", "schema/test_answer_doubtful.py"),
    ),
    ("link/causal/link_causal_polled.sql", ("model/test_polled_links.py",)),
    (
        "link/causal/link_causal_take_adjacent.sql",
        ("schema/cases/derive.link_causal_take_adjacent", "model/test_take_adjacent_links.py"),
    ),
    ("link/causal/link_call.sql", ("schema/cases/derive.link_call", "model/test_call_links.py")),
    *(
        (
            f"link/causal/{each}.sql",
            (f"schema/cases/derive.{each}", "schema/cases/derive.link_causal_indirect"),
        )
        for each in ("approximate_message", "approximate_set")
    ),
    *(
        (f"link/causal/{each}.sql", ("schema/test_causal_link.py",))
        for each in ("causal_link", "link_causal_by_hand", "link_causal_annotated")
    ),
    (
        "link/causal/link_causal_approximate.sql",
        ("schema/cases/derive.link_causal_indirect", "model/test_approximate_links.py"),
    ),
    (
        "link/causal/link_causal_indirect.sql",
        ("schema/cases/derive.link_causal_indirect", "model/test_nested_inputs.py"),
    ),
    (
        "delivery/delivery_limit.sql",
        ("schema/test_delivery_rules.py", "schema/test_orphan_rules.py"),
    ),
    ("delivery/expected_arrival.sql", ("schema/test_expected_arrival.py",)),
    ("delivery/undelivered.sql", ("schema/test_delivery_rules.py",)),
    ("delivery/orphan_take.sql", ("schema/test_orphan_rules.py", "schema/test_delivery_rules.py")),
    ("clock/clock_hull.sql", ("schema/test_clock_hull.py", "schema/test_clock_pair.py")),
    ("clock/clock_pair.sql", ("schema/test_clock_pair.py", "schema/test_clock_hull.py")),
    ("clock/clock_line.sql", ("schema/test_clock_pair.py", "schema/test_clock_hull.py")),
    ("clock/clock_line_error.sql", ("schema/test_clock_pair.py", "schema/test_clock_hull.py")),
    ("clock/clock_sync.sql", ("schema/test_clock_chain.py", "schema/test_clock_pair.py")),
    ("model/gap/pause_limit.sql", ("model/test_loss.py",)),
    ("model/gap/gap.sql", ("model/test_gap.py", "model/test_loss.py")),
    ("model/identity/thread.sql", ("model/test_process.py",)),
    ("model/identity/process.sql", ("model/test_process.py",)),
    ("model/callback/innermost_run.sql", ("model/test_user_event.py",)),
    ("model/callback/deferred_end.sql", ("model/test_service.py",)),
    ("model/callback/callback_known.sql", ("model/test_service.py",)),
    ("model/object/timer_use.sql", ("model/test_unknown_objects.py",)),
    (
        "model/executor/executor_first.sql",
        ("schema/cases/finding.polled_executor", "model/test_executor.py"),
    ),
    *(
        (f"overlap/{each}.sql", ("schema/test_given_namespace.py",))
        for each in ("given_namespace", "alternating_name")
    ),
    ("link/gap/early_stream.sql", ("schema/cases/finding.stream_ends_early",)),
    ("flow/many_chains.sql", ("schema/test_many_chains.py", "schema/cases/finding.path_cut")),
    ("flow/certain_cause.sql", ("schema/cases/derive.certain_cause",)),
    (
        "flow/stuck_root.sql",
        ("schema/cases/derive.stuck_root", "schema/cases/main.end_to_end", "query/cases/flows"),
    ),
    ("flow/unanswered_subscription.sql", ("schema/cases/derive.unanswered_subscription",)),
    ("public/dead_end.sql", ("schema/cases/main.dead_end", "schema/cases/finding.dead_end")),
    ("overlap/session_container.sql", ("schema/test_session_container.py",)),
    ("overlap/session_pair.sql", ("schema/test_session_pair.py",)),
    ("public/goal.sql", ("schema/cases/main.goal",)),
    ("public/action_client.sql", ("schema/cases/main.action_client",)),
    ("public/action_server.sql", ("schema/cases/main.action_server",)),
    *(
        (each, ("schema/cases/main.goal", "schema/cases/main.action_server"))
        for each in ("stat/action", "link/action")
    ),
    ("link/causal/answer_to_call.sql", ("model/test_take_adjacent_links.py",)),
    (
        "stat/executor/callback_release.sql",
        ("schema/cases/main.executor_wait", "schema/cases/derive.callback_release"),
    ),
    # Limits of what matters: by what they decide.
    (
        "internal/why/noticed.sql",
        ("schema/cases/internal.harm", *(f"schema/cases/culprit.{each}" for each in CULPRITS)),
    ),
    *((f"health/recording/{each}.sql", (f"schema/cases/finding.{each}",)) for each in FINDINGS),
    *(
        (f"health/input/{each.stem}.sql", (f"schema/cases/finding.{each.stem}", NOTHING_FOUND))
        for each in sorted((ROOT / "schema" / "health" / "input").glob("*.sql"))
        if each.stem != "process_label"
    ),
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


@dataclass(frozen=True)
class Token:
    """A word or sign of a file, and how many parentheses are open around it."""

    text: str
    begin: int
    end: int
    depth: int
    is_number: bool


def mutants(file: Path, replaced: Sequence[Sequence[str]]) -> Iterator[Mutant]:
    """Return every change of a file, given from the root of the checkout."""
    text = (ROOT / file).read_text()
    found = [
        (place.start(), place.end(), new)
        for old, new in replaced
        for place in re.finditer(re.escape(old), text)
    ]
    for begin, end, new in found if replaced else sorted(set(changes(text))):
        yield Mutant(file, begin, end, text[begin:end], new, text.count("\n", 0, begin) + 1)


def changes(text: str) -> Iterator[tuple[int, int, str]]:
    """Return begin, end and new text of every change of an SQL file."""
    tokens = list(_tokens(text))
    for position, token in enumerate(tokens):
        for new in _instead(token):
            yield token.begin, token.end, new
        behind = tokens[position + 1 :]
        if token.text == "LEFT" and behind[0].text == "JOIN":
            yield token.begin, behind[0].begin, ""
        if token.text == "NOT" and behind[0].text not in {"NULL", "MATERIALIZED", "DISTINCT"}:
            yield token.begin, behind[0].begin, ""
        if token.text == "UNION":
            yield token.begin, _end(token, behind, {"UNION"}), ""
        if token.text in BEFORE_CONDITION and behind[0].text != "REPLACE":
            end = _end(token, behind, BEHIND_CONDITION)
            if not ONLY_RUN.fullmatch(text[token.end : end].strip()):
                yield token.end, end, " false " if token.text in {"OR", "WHEN"} else " true "


def _tokens(text: str) -> Iterator[Token]:
    depth = 0
    between = set()  # depths at which a BETWEEN waits for its AND
    for match in TOKEN.finditer(text):
        if match["skipped"]:
            continue
        word = match[0]
        depth -= word in {")", "]", "}"}
        if word == "BETWEEN":
            between.add(depth)
        elif word == "AND" and depth in between:
            between.remove(depth)
            word = "and"  # joins no conditions
        yield Token(word, match.start(), match.end(), depth, bool(match["number"]))
        depth += word in {"(", "[", "{"}


def _instead(token: Token) -> list[str]:
    if token.text in OPPOSITE and token.text not in DROPPED_ALONE:
        return [OPPOSITE[token.text]]
    if not token.is_number or token.text in TRIVIAL:
        return []
    value = float(token.text)
    whole = value.is_integer() and "." not in token.text and "e" not in token.text
    return [str(round(each)) if whole else repr(each) for each in (value * 2, value / 2)]


def _end(token: Token, behind: Sequence[Token], words: set[str]) -> int:
    """Return where what follows a token ends: before such a word, or what closes around both."""
    end = token.end
    for other in behind:
        if other.depth < token.depth or (other.depth == token.depth and other.text in words):
            break
        end = other.end
    return end


class FirstFailure:
    """Keeps the first test that fails, or the place that cannot be read."""

    name = ""

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Look at each step of each test."""
        self.keep(report)

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """Look at what each file and folder gave."""
        self.keep(report)

    def keep(self, report: pytest.TestReport | pytest.CollectReport) -> None:
        """Keep what failed, if nothing did before."""
        if report.failed:
            self.name = self.name or report.nodeid


def first_failure(tests: Sequence[str], timeout: int, mutant: Mutant | None = None) -> str | None:
    """Return the first test that fails in a child; one that takes too long has failed.

    Only the child imports the program, so that nothing remembers the file without the change.
    """
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        signal.alarm(timeout)
        failure = "the tests cannot be run"
        try:
            failure = _run(tests, mutant)
        finally:
            os.write(writing, failure.encode())
            os._exit(0)
    os.close(writing)
    with os.fdopen(reading) as pipe:
        failure = pipe.read()
    _, status = os.waitpid(child, 0)
    return "timeout or crash" if status else failure or None


def _run(tests: Sequence[str], mutant: Mutant | None) -> str:
    if mutant is not None:
        _change(mutant)
        with Path(os.devnull).open("w") as nowhere:
            os.dup2(nowhere.fileno(), 1)
            os.dup2(nowhere.fileno(), 2)
    first = FirstFailure()
    options = ["-q", "-x", "-p", "no:cacheprovider", "-p", "no:xdist"]
    code = pytest.main([*options, *tests], plugins=[first])
    return first.name or ("" if code == 0 else "the tests cannot be run")


def _change(mutant: Mutant) -> None:
    """Let everything that reads the file find it changed."""
    read = Path.read_text

    def changed(path: Path, *arguments: str, **named: str) -> str:
        text = read(path, *arguments, **named)
        if path.name != mutant.file.name or path.resolve() != ROOT / mutant.file:
            return text
        return text[: mutant.begin] + mutant.new + text[mutant.end :]

    Path.read_text = changed  # type: ignore[assignment, method-assign]


def every_rule(options: Sequence[str]) -> int:
    """Try every change of `RULES`, each in a process of its own; return the exit code."""
    codes = []
    for place, tests in RULES:
        found = ROOT / "schema" / place
        files = sorted(found.glob("*.sql")) if found.is_dir() else [found]
        command = [sys.executable, __file__, *(str(file.relative_to(ROOT)) for file in files)]
        command += ["--tests", *(f"tests/{test}" for test in tests), *options]
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
    todo = [
        mutant
        for file in arguments.files
        for mutant in mutants(file, arguments.replace)
        if not arguments.line or mutant.line in arguments.line
    ]
    os.chdir(ROOT)
    # The program beside this file, whatever is installed.
    sys.path.insert(0, str(ROOT))
    # Each change makes an empty database of its own: none of them is for the cache of the user.
    with tempfile.TemporaryDirectory(prefix="msgflow-mutants-") as cache:
        os.environ["XDG_CACHE_HOME"] = cache
        if failure := first_failure(arguments.tests, arguments.timeout):
            sys.exit(f"fails without any change — {failure}")
        survived = 0
        for mutant in todo:
            failure = first_failure(arguments.tests, arguments.timeout, mutant)
            survived += failure is None
            print(f"{mutant}  {failure or 'SURVIVED'}", flush=True)
    print(f"\n{len(todo)} changes, {survived} survived")
    sys.exit(bool(survived))


if __name__ == "__main__":
    main()
