from __future__ import annotations

import pytest

from msgflow.verify.condition import (
    ConditionError,
    Dimension,
    format_value,
    parse_condition,
)

TIMES = ("median", "p95", "p99", "max")


@pytest.mark.parametrize(
    ("text", "dimension", "statistics", "inside", "outside"),
    [
        ("p99 < 80 ms", Dimension.TIME, TIMES, 79_999_999, 80_000_000),
        ("p99 <= 80ms", Dimension.TIME, TIMES, 80_000_000, 80_000_001),
        ("max ≤ 1.5 s", Dimension.TIME, TIMES, 1_500_000_000, 1_500_000_001),
        ("median > 2 us", Dimension.TIME, TIMES, 2_001, 2_000),
        ("median >= 2 µs", Dimension.TIME, TIMES, 2_000, 1_999),
        ("p95   ≥  7   ns", Dimension.TIME, TIMES, 7, 6),
        ("100 Hz ± 5 %", Dimension.RATE, (), 95, 94.99),
        ("100 Hz +- 5 %", Dimension.RATE, (), 105, 105.01),
        ("1 kHz +/- 5 Hz", Dimension.RATE, (), 995, 994),
        ("< 1 %", Dimension.SHARE, (), 0.0099, 0.01),
        ("50 % ± 5 %", Dimension.SHARE, (), 0.45, 0.44),
        ("p99 10 ms ± 1 ms", Dimension.TIME, TIMES, 11_000_000, 11_000_001),
        ("< 1", Dimension.COUNT, (), 0, 1),
    ],
)
def test_bounds_and_units(
    text: str, dimension: Dimension, statistics: tuple[str, ...], inside: float, outside: float
) -> None:
    condition = parse_condition(text, dimension, statistics, "it")
    assert condition.holds(inside)
    assert not condition.holds(outside)


def test_too_large_is_not_too_small() -> None:
    condition = parse_condition("10 Hz ± 1 Hz", Dimension.RATE, (), "rate")
    assert condition.is_exceeded_by(12)
    assert not condition.is_exceeded_by(10)
    assert not condition.is_exceeded_by(8)
    assert parse_condition("< 1", Dimension.COUNT, (), "missed").is_exceeded_by(1)


@pytest.mark.parametrize(
    ("text", "dimension", "statistics", "message", "hint"),
    [
        ("p99 == 80 ms", Dimension.TIME, TIMES, "no such operator — ==", "<, <=, >, >="),
        ("p99 ~ 80 ms", Dimension.TIME, TIMES, "no such operator — ~", "<, <=, >, >="),
        ("p99 < 80 Ms", Dimension.TIME, TIMES, "no such unit for it — Ms", "did you mean ms"),
        ("p99 < 80 msec", Dimension.TIME, TIMES, "no such unit for it — msec", "did you mean ms"),
        ("p99 < 80", Dimension.TIME, TIMES, "it has no unit", "a time: ns, us, ms or s"),
        ("p99 < 80 Hz", Dimension.TIME, TIMES, "no such unit for it — Hz", "a time"),
        ("< 1 ms", Dimension.SHARE, (), "no such unit for it — ms", "a share: %"),
        ("< 1 %", Dimension.COUNT, (), "no such unit for it — %", "without a unit"),
        ("10 Hz ± 1 ms", Dimension.RATE, (), "no such unit for it — ms", "a rate: Hz or kHz"),
        ("p98 < 80 ms", Dimension.TIME, TIMES, "no such statistic — p98", "did you mean p9"),
        ("p99 < 1 %", Dimension.SHARE, (), "it is one value, it has no p99", "< 1 %"),
        ("< 80 ms", Dimension.TIME, TIMES, "which it is not said", "p99 < 80 ms"),
        ("fast", Dimension.TIME, TIMES, "cannot be read — fast", "p99 < 80 ms"),
        ("p99 < -5 ms", Dimension.TIME, TIMES, "cannot be read", "p99 < 80 ms"),
        ("p99 < 1e9 ms", Dimension.TIME, TIMES, "cannot be read", "p99 < 80 ms"),
        ("0", Dimension.COUNT, (), "cannot be read — 0", "< 1"),
    ],
)
def test_what_cannot_be_read(
    text: str, dimension: Dimension, statistics: tuple[str, ...], message: str, hint: str
) -> None:
    with pytest.raises(ConditionError) as error:
        parse_condition(text, dimension, statistics, "it")
    assert message in str(error.value)
    assert hint in error.value.hint


def test_values_for_people() -> None:
    assert format_value(80_000_000, Dimension.TIME) == "80.000 ms"
    assert format_value(9.99955, Dimension.RATE) == "9.99955 Hz"
    assert format_value(0.0123, Dimension.SHARE) == "1.23 %"
    assert format_value(3, Dimension.COUNT) == "3"
