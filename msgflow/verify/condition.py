"""Conditions of requirements as people write them: `p99 < 80 ms`, `100 Hz ± 5 %`, `< 1 %`."""

from __future__ import annotations

import re
from dataclasses import dataclass

from msgflow.backports import StrEnum
from msgflow.text.name_suggestions import meant_or, nearest
from msgflow.text.values import format_duration

OPERATORS = ("<", "<=", ">", ">=")
_SAME = {"≤": "<=", "≥": ">="}
_NUMBER = r"(?P<number>\d{1,15}(?:\.\d{1,15})?)\s*(?P<unit>[^\W\d_]*|%)"
_BOUND = re.compile(rf"(?P<statistic>[A-Za-z]\w*)?\s*(?P<operator>[<>=!≤≥~]+)\s*{_NUMBER}")
_AROUND = re.compile(
    rf"(?P<statistic>[A-Za-z]\w*)?\s*{_NUMBER}\s*(?:±|\+-|\+/-)\s*"
    r"(?P<margin>\d{1,15}(?:\.\d{1,15})?)\s*(?P<margin_unit>[^\W\d_]*|%)"
)


class Dimension(StrEnum):
    """The dimension of a measured value, which is its unit in the verdicts."""

    TIME = "ns"
    RATE = "Hz"
    SHARE = "share"
    COUNT = "count"


UNITS: dict[Dimension, dict[str, float]] = {
    Dimension.TIME: {"ns": 1, "us": 1e3, "µs": 1e3, "μs": 1e3, "ms": 1e6, "s": 1e9},
    Dimension.RATE: {"Hz": 1, "kHz": 1e3},
    Dimension.SHARE: {"%": 0.01},
    Dimension.COUNT: {"": 1},
}
_NAMES = {
    Dimension.TIME: "a time: ns, us, ms or s",
    Dimension.RATE: "a rate: Hz or kHz",
    Dimension.SHARE: "a share: %",
    Dimension.COUNT: "a number without a unit",
}
_EXAMPLES = {
    Dimension.TIME: "< 80 ms",
    Dimension.RATE: "100 Hz ± 5 %",
    Dimension.SHARE: "< 1 %",
    Dimension.COUNT: "< 1",
}


@dataclass(frozen=True)
class Condition:
    """The range of a measured value."""

    text: str  # as the user wrote it, with single blanks
    statistic: str  # the statistic that is measured; '' if there is one value only
    lower: float | None  # the least value; None: no limit
    upper: float | None  # the largest value; None: no limit
    is_strict: bool  # equal to a bound is not enough

    def holds(self, value: float) -> bool:
        """Tell whether a measured value, in the unit of its dimension, is in the range."""
        if self.is_strict and value in (self.lower, self.upper):
            return False
        return (self.lower is None or value >= self.lower) and (
            self.upper is None or value <= self.upper
        )

    def is_exceeded_by(self, value: float) -> bool:
        """Tell whether a value is too large, rather than too small."""
        return not self.holds(value) and self.upper is not None and value >= self.upper


class ConditionError(ValueError):
    """A condition that cannot be read; `hint` says what can."""

    def __init__(self, message: str, hint: str) -> None:
        super().__init__(message)
        self.hint = hint


def parse_condition(
    text: str, dimension: Dimension, statistics: tuple[str, ...], metric: str
) -> Condition:
    """Return the condition that a text means."""
    words = " ".join(text.split())
    example = f"{'p99 ' if 'p99' in statistics else ''}{_EXAMPLES[dimension]}"
    if match := _BOUND.fullmatch(words):
        operator = _SAME.get(match["operator"], match["operator"])
        if operator not in OPERATORS:
            raise ConditionError(
                f"there is no such operator — {operator}",
                f"the operators are {', '.join(OPERATORS)}, and ± for a range",
            )
        statistic = _statistic(match["statistic"], statistics, metric, example)
        limit = _value(match["number"], match["unit"], dimension, metric)
        is_upper = operator.startswith("<")
        return Condition(
            words,
            statistic,
            None if is_upper else limit,
            limit if is_upper else None,
            len(operator) == 1,
        )
    if match := _AROUND.fullmatch(words):
        statistic = _statistic(match["statistic"], statistics, metric, example)
        middle = _value(match["number"], match["unit"], dimension, metric)
        if match["margin_unit"] == "%" and dimension is not Dimension.SHARE:
            margin = middle * float(match["margin"]) / 100
        else:
            margin = _value(match["margin"], match["margin_unit"], dimension, metric)
        return Condition(words, statistic, middle - margin, middle + margin, False)
    raise ConditionError(f"{metric} has a condition that cannot be read — {words}", example)


def format_value(value: float, dimension: Dimension) -> str:
    """Return a measured value as people read it."""
    if dimension is Dimension.TIME:
        return format_duration(value)
    if dimension is Dimension.RATE:
        return f"{value:.6g} Hz"
    if dimension is Dimension.SHARE:
        return f"{100 * value:.4g} %"
    return f"{value:.10g}"


def _statistic(given: str | None, statistics: tuple[str, ...], metric: str, example: str) -> str:
    if given is None and statistics:
        raise ConditionError(
            f"which {metric} is not said", f"one of {', '.join(statistics)}, as in {example}"
        )
    if given is not None and given not in statistics:
        if not statistics:
            raise ConditionError(f"{metric} is one value, it has no {given}", example)
        raise ConditionError(
            f"{metric} has no such statistic — {given}",
            meant_or(nearest(given, statistics)[:1], f"it has {', '.join(statistics)}"),
        )
    return given or ""


def _value(number: str, unit: str, dimension: Dimension, metric: str) -> float:
    units = UNITS[dimension]
    if unit not in units:
        known = [name for of in UNITS.values() for name in of if name]
        fitting = [name for name in units if name.lower() == unit.lower()]
        near = fitting or [name for name in nearest(unit, known) if name in units]
        what = f"there is no such unit for {metric} — {unit}" if unit else f"{metric} has no unit"
        raise ConditionError(what, meant_or(near[:1], f"{metric} is {_NAMES[dimension]}"))
    return float(number) * units[unit]
