"""Events of the user's own tracepoints in a simulated robot: all there, each in its callback."""

from __future__ import annotations

from pathlib import Path

import duckdb
import pytest
from scoring import compare_simulated
from support.thorough import thorough

from msgflow.ingest import ingest
from msgflow_sim import Recording, simulate

S = 1_000_000_000
DIFFERENT = """
(
    SELECT host, pid, tid, at_ns, name, frame, score, label, callback_instance_id IS NULL
    FROM '{truth}'
)
EXCEPT ALL
(
    SELECT h.hostname, p.pid, t.tid, u.at_ns, u.name, (u.fields->>'$.frame')::BIGINT,
        (u.fields->>'$.score')::DOUBLE, u.fields->>'$.label', u.callback_instance_id IS NULL
    FROM user_event AS u
    JOIN thread AS t USING (thread_id)
    JOIN process AS p ON t.process_id = p.process_id
    JOIN host AS h ON p.host_id = h.host_id
)
"""


@pytest.mark.thorough
@pytest.mark.parametrize(
    "recording",
    [
        Recording(),
        thorough(Recording(lost_event_share=0.3), id="loss"),
        thorough(Recording(pauses=((S // 10, S // 5),)), id="pause"),
        thorough(
            Recording(start_ns=S // 10, is_dual_session=True, clock_error_ns=3_000), id="dual"
        ),
    ],
    ids=["perfect", None, None, None],
)
def test_each_is_in_the_callback_that_recorded_it(tmp_path: Path, recording: Recording) -> None:
    """Nested ones too, and none in one that was over, with or without what was lost."""
    done = simulate("own_events", tmp_path / "trace", factor=0.1, recording=recording)
    database = tmp_path / "run.duckdb"
    ingest([done.directory], database, events=["my_pkg:*"])
    scores = {one.kind: one for one in compare_simulated(database, done.truth)[0]}
    for kind in ("user_event", "recorded_in"):
        one = scores[kind]
        assert one.decided > 0
        assert (one.wrong, one.missing, one.repeated) == (0, 0, 0), one
    assert scores["recorded_in"].happened < scores["user_event"].happened
    if recording == Recording():
        with duckdb.connect(str(database), read_only=True) as connection:
            asked = DIFFERENT.format(truth=done.truth["user_event"])
            assert connection.execute(asked).fetchall() == []
            ((count, deep),) = connection.execute(
                "SELECT count(*), max(depth) FROM user_event"
                " JOIN callback_instance USING (callback_instance_id)"
            ).fetchall()
        assert count == scores["recorded_in"].happened
        assert deep > 1
