"""Values of parameters are those of the vocabulary."""

from __future__ import annotations

import re

from msgflow.db import objects
from msgflow.query.catalogue import load_query


def test_reasons_of_unmatched() -> None:
    """What the audit of the vocabulary allows as a reason can be asked for, and nothing else."""
    (audit,) = (h for h in objects.load("health/check") if h.name == "check.vocabulary_is_closed")
    lists = re.findall(r"reason NOT IN \(([^)]*)\)", audit.body)
    (reason,) = (p for p in load_query("unmatched").params if p.name == "reason")
    assert set(reason.choices) == set(re.findall(r"'(\w+)'", " ".join(lists)))
