"""Inputs that a callback receives nested in it, before it looks at its own message."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from support.ingested import Ingested


@pytest.mark.thorough
def test_nested_inputs_are_the_only_candidates(simulations: Callable[[str], Ingested]) -> None:
    expected = (
        "SELECT p.publication_rmw_ns, i.start_ns, 1 FROM truth_causal AS p "
        "JOIN truth_callback_instance AS i USING (callback_instance_id) "
        "WHERE p.kind = 'partial_sync' AND p.topic_name = '/spinning/0'"
    )
    found = (
        "SELECT b.rmw_ns, i.start_ns, l.candidate_count FROM link_causal AS l "
        "JOIN publication AS b USING (publication_id) JOIN publisher AS p USING (publisher_id) "
        "JOIN callback_instance AS i ON l.callback_instance_id = i.callback_instance_id "
        "WHERE l.kind = 'partial_sync' AND p.topic_name = '/spinning/0'"
    )
    simulated = simulations("partial_sync")
    assert simulated.differences(expected, found) == ([], [])
    # Most of the others ran nested.
    ((nested, count),) = simulated.rows(
        "SELECT count(i.parent_id), count(*) FROM truth_causal AS p "
        "JOIN truth_callback_instance AS i USING (callback_instance_id) "
        "WHERE p.kind = 'partial_sync' AND p.topic_name = '/spinning/0'"
    )
    assert nested > 0.8 * count > 8
