from __future__ import annotations

import pyarrow as pa
import pytest
from rich.cells import cell_len

from msgflow.cli.sections import screen_sections
from msgflow.query.catalogue import load_query
from msgflow.result.query_result import QueryResult
from msgflow.run.choice import Run

WAITS = {
    "node": ["/slow", "/slow", "/talker"],
    "callback": ["Subscription(/sensor)", "Subscription(/sensor)", "Timer(10 ms)"],
    "meanwhile_node": ["/slow", "/slow", "/talker"],
    "meanwhile_callback": ["Subscription(/fast)", "Subscription(/sensor)", "Timer(5 ms)"],
    "worst_ns": [10_163_000, 10_227_000, 125_778],
    "share": [0.503, 0.497, 0.537],
}


@pytest.mark.parametrize(("is_chosen", "distinguishes"), [(True, True), (False, False)])
def test_columns_take_the_room_of_a_remark_that_is_not_made(
    is_chosen: bool, distinguishes: bool
) -> None:
    """Rows that differ in one column only look alike without it."""
    run = Run(1, "morning", 1_700_000_000_000_000_000)
    result = QueryResult(pa.table(WAITS), load_query("waits-pair"), (run,))
    lines = list(screen_sections({"waits": result}, 80, is_chosen=is_chosen))
    assert max(map(cell_len, lines)) <= 80
    assert ("meanwhile_callback" in lines[1]) == distinguishes
