"""Files of requirements that are wrong: the line and what was meant are named."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from msgflow.errors import UsageError
from msgflow.verify.targets_file import read_targets
from msgflow.verify.verify import Verification


@pytest.mark.parametrize(
    ("text", "line", "message", "hint"),
    [
        ("", 1, "the file is empty", "targets:"),
        ("targets: []", 1, "has no target", "targets:"),
        ("goals: []", 1, "the file has no goals", "it has targets"),
        ("targets:\n  - [a]", 2, "not a mapping", "targets:"),
        ("targets:\n  - tpoic: /a\n    rate: < 1 Hz", 2, "what it is of", "did you mean topic"),
        ("targets:\n  - topic: /a", 2, "nothing is required", "rate"),
        ("targets:\n  - topic: /a\n    rtae: < 1 Hz", 3, "no rtae", "did you mean rate"),
        ("targets:\n  - topic: /a\n    lateness: p99 < 1 ms", 3, "no lateness", "latency"),
        ("targets:\n  - topic: /a\n    timer: /b\n    rate: < 1 Hz", 2, "one thing", "two targets"),
        ("targets:\n  - topic: /a\n    rate: < 1 Hz\n    rate: < 2 Hz", 4, "given twice", ""),
        ("targets:\n  - topic: /a\n    rate:", 3, "rate has no value", "targets:"),
        ("targets:\n  - topic: /a\n    rate: []", 3, "rate is empty", "targets:"),
        ("targets:\n  - topic: /a\n    rate: {a: 1}", 3, "not a condition", "targets:"),
        ("targets:\n  - topic: /a\n    rate:\n      - < 1 Hz\n      - < 1 m", 5, "unit", "a rate"),
        ("targets:\n  - topic: /a\n    rate: [< 1 Hz, < 2 Hz]", 3, "required twice", "line 3"),
        (
            "targets:\n  - topic: /a\n    rate: < 1 Hz\n  - topic: /a\n    rate: 2 Hz ± 1 %",
            5,
            "rate of this topic is required twice",
            "line 3",
        ),
        ("targets:\n  - path: /a\n    latency: p99 < 1 s", 2, "two topics", "targets:"),
        (
            "targets:\n  - path: [/a, /b,\n      /a]\n    latency: p99 < 1 s",
            3,
            "a path does not come to a topic twice — /a",
            "loops",
        ),
        ("targets:\n  - topic: /a\n    rate: > 1 Hz", 3, "expected", "quote"),
        ("targets:\n  - topic: *.raw\n    rate: < 1 Hz", 2, "alias", "quote"),
        ("targets: &a\n  - *a", 1, "not a mapping", "targets:"),
    ],
)
def test_a_mistake_is_named_with_its_line(
    tmp_path: Path, text: str, line: int, message: str, hint: str
) -> None:
    path = tmp_path / "targets.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(UsageError) as error:
        read_targets(path)
    assert error.value.message.startswith(f"{path}, line {line}: ")
    assert message in error.value.message
    assert hint in (error.value.hint or "")


def test_a_file_that_is_none(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="cannot read the file"):
        read_targets(tmp_path / "missing.yaml")


@pytest.mark.parametrize(
    ("text", "line", "message", "hint"),
    [
        ("targets:\n  - path: [/a,\n      /bb]\n    latency: p99 < 1 s", 3, "topic — /bb", "/b"),
        ("targets:\n  - topic: /q*\n    rate: < 1 Hz", 2, "topic — /q*", "it has /a, /b, /c"),
        ("targets:\n  - topic: /a\n    node: /sorce\n    rate: < 1 Hz", 3, "node", "/source"),
        ("targets:\n  - timer: /relay\n    rate: < 1 Hz", 2, "node with timers", "/source"),
        ("targets:\n  - service: /ad\n    completeness: < 1 %", 2, "service — /ad", "/add"),
        ("targets:\n  - action: /dock\n    goal: max < 1 s", 2, "action — /dock", "no action"),
        ("targets:\n  - process: x\n    utilisation: < 1 %", 2, "process — x", "process"),
        ("targets:\n  - callback: X\n    duration: p99 < 1 s", 2, "callback — X", "Timer"),
    ],
)
def test_names_that_the_run_does_not_have(
    check: Callable[[str], Verification], text: str, line: int, message: str, hint: str
) -> None:
    """It is not measured, and says why; the others are judged."""
    verification = check(text + "\n  - topic: /a\n    rate: '> 0 Hz'")
    rows = verification.result.to_arrow().to_pylist()
    (missing,) = (row for row in rows if "no such" in (row["reason"] or ""))
    passed = [row for row in rows if row["verdict"] == "passed"]
    assert missing["verdict"] == "not measured"
    assert missing["line"] >= line
    assert message in missing["reason"]
    assert hint in missing["reason"]
    assert passed
    assert "the run has no such" in verification.to_junit()
