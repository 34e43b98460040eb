"""Values of parameters are those of the vocabulary."""

from __future__ import annotations

import re

from msgflow.db.finding import kinds_of, short_name
from msgflow.query.catalogue import load_query


def test_reasons_of_unmatched() -> None:
    """Each reason that the vocabulary allows can be asked for, and no other."""
    (kind,) = (h for h in kinds_of("database") if short_name(h) == "vocabulary_is_closed")
    lists = re.findall(r"reason NOT IN \(([^)]*)\)", kind.body)
    (reason,) = (p for p in load_query("topics-unmatched").params if p.name == "reason")
    assert set(reason.choices) == set(re.findall(r"'(\w+)'", " ".join(lists)))
