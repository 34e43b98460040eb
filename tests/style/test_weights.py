"""What msgflow weighs is what weights.toml says."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from support.weigh import WEIGHTS

from msgflow.backports import tomllib

FILE = Path(__file__).with_name("weights.toml")


@pytest.mark.parametrize("weight", WEIGHTS, ids=lambda weight: weight.__name__)
def test_weight(weight: Callable[[], int]) -> None:
    name, found = weight.__name__, weight()
    said = tomllib.loads(FILE.read_text())[name]
    assert found <= said, f"{name} = {found}: make it {said} again, or raise it in {FILE}"
    assert found >= 0.98 * said, f"{name} = {found}: lower it from {said} in {FILE}"


def test_nothing_else_is_said() -> None:
    assert {weight.__name__ for weight in WEIGHTS} == {*tomllib.loads(FILE.read_text())}
