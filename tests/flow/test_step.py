"""The picture of a flow has the vertices and links that the walkers find."""

from __future__ import annotations

import pytest
from support.analysis import Analysis
from support.random_system import random_system
from support.thorough import thorough

MACROS = {"forward": "flow_forward", "backward": "flow_backward", "both": "flow_both"}
STARTS = """
SELECT 'publication', publication_id FROM publication
UNION ALL SELECT 'take', take_id FROM take
UNION ALL SELECT 'callback_instance', callback_instance_id FROM callback_instance
ORDER BY ALL
"""
COLUMNS = "from_kind, from_id, link_kind, kind, id"


@pytest.mark.thorough
@pytest.mark.parametrize(("seed", "every"), [(1, 31), thorough(1, 7), thorough(2, 7)])
def test_the_picture_is_that_of_the_walkers(analysis: Analysis, seed: int, every: int) -> None:
    analysis.build(random_system(seed, actions=60))
    con = analysis.connection
    starts = analysis.rows(STARTS)
    assert len(starts) > 50
    for kind, number in starts[::every]:
        for direction, macro in MACROS.items():
            rows = con.execute(
                f"SELECT {COLUMNS} FROM flow_step(?, ?, direction := ?, internal := true) "
                "WHERE kind <> 'subscription'",
                [kind, number, direction],
            ).fetchall()
            assert len(rows) == len(set(rows))
            vertices = {row[-2:] for row in rows}
            assert vertices == set(
                con.execute(f"SELECT kind, id FROM {macro}(?, ?)", [kind, number]).fetchall()
            )
            links = {
                row
                for row in analysis.rows(
                    "SELECT from_kind, from_id, link_kind, to_kind, to_id FROM flow_edge"
                )
                if row[:2] in vertices and row[3:] in vertices
            }
            assert {row for row in rows if row[0] is not None} == links


@pytest.mark.thorough
@pytest.mark.parametrize("every", [7, thorough(1)])
def test_what_was_not_taken_is_what_no_link_shows(analysis: Analysis, every: int) -> None:
    analysis.build(random_system(1, actions=60))
    shown = 0
    numbers = analysis.rows("SELECT publication_id FROM publication ORDER BY ALL")
    for (number,) in numbers[::every]:
        subscriptions = set(
            analysis.rows(
                f"SELECT s.subscription_id FROM publication AS b JOIN publisher AS p "
                f"USING (publisher_id) JOIN subscription AS s USING (topic_name) "
                f"WHERE b.publication_id = {number} AND s.subscription_id NOT IN ("
                f"SELECT t.subscription_id FROM link_transport AS l JOIN take AS t USING (take_id) "
                f"WHERE l.publication_id = {number} AND t.subscription_id IS NOT NULL)"
            )
        )
        found = analysis.rows(
            f"SELECT id FROM flow_step('publication', {number}, direction := 'forward', "
            "max_depth := 0) WHERE kind = 'subscription'"
        )
        assert set(found) == subscriptions
        shown += len(found)
    assert shown
