"""Everything that a simulated system did is in the database, row by row, and nothing else."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from support.ingested import Ingested
from support.thorough import SHOWN, few

from msgflow_sim import scenarios

# Table of truth, what is compared of it, and the same from the public views. Nodes of one name at a
# time go with their host or process there.
CASES = {
    "publication": (
        """
        SELECT host, pid, tid, node, nullif(topic_name, 'ros_discovery_info') AS topic_name,
            publisher_handle, rclcpp_ns, rcl_ns, rmw_ns, source_timestamp_ns
        FROM truth_publication
        WHERE publication_id IN (FROM named)
        """,
        """
        SELECT p.hostname, p.pid, p.tid, regexp_replace(n.full_name, '@.*', ''),
            u.topic_name, u.publisher_handle,
            b.rclcpp_ns, b.rcl_ns, b.rmw_ns, b.source_timestamp_ns
        FROM publication AS b
        JOIN place AS p USING (thread_id)
        LEFT JOIN publisher AS u USING (publisher_id)
        LEFT JOIN node AS n ON u.node_id = n.node_id
        WHERE b.rcl_ns IS NOT NULL OR b.intra_ns IS NOT NULL
        """,
    ),
    "take": (
        """
        SELECT host, pid, tid, node, topic_name, subscription_handle, rmw_ns, source_timestamp_ns
        FROM truth_take
        WHERE method = 'rmw'
        """,
        """
        SELECT p.hostname, p.pid, p.tid, regexp_replace(n.full_name, '@.*', ''),
            s.topic_name, s.subscription_handle,
            t.taken_ns, t.source_timestamp_ns
        FROM take AS t
        JOIN place AS p USING (thread_id)
        JOIN subscription AS s USING (subscription_id)
        JOIN node AS n ON s.node_id = n.node_id
        WHERE t.method = 'rmw'
        """,
    ),
    "callback_instance": (
        """
        SELECT c.host, c.pid, c.tid, c.node, c.kind, c.callback_handle, c.start_ns, c.end_ns,
            t.rmw_ns
        FROM truth_callback_instance AS c
        LEFT JOIN truth_take AS t ON c.take_id = t.take_id AND t.method = 'rmw'
        """,
        """
        SELECT p.hostname, p.pid, p.tid, regexp_replace(n.full_name, '@.*', ''),
            c.kind, c.callback_handle, i.start_ns,
            CASE WHEN NOT i.is_end_inferred THEN i.end_ns END, t.taken_ns
        FROM callback_instance AS i
        JOIN place AS p USING (thread_id)
        JOIN callback AS c USING (callback_id)
        JOIN node AS n ON c.node_id = n.node_id
        LEFT JOIN take AS t ON i.take_id = t.take_id AND t.method = 'rmw'
        """,
    ),
    "transport": (
        """
        SELECT topic_name, publication_host, publication_pid, publication_tid, publication_rmw_ns,
            source_timestamp_ns, take_host, take_pid, take_tid, take_rmw_ns
        FROM truth_transport
        WHERE method = 'rmw' AND publication_id NOT IN (FROM ambiguous)
        """,
        """
        SELECT u.topic_name, bp.hostname, bp.pid, bp.tid, b.rmw_ns, b.source_timestamp_ns,
            tp.hostname, tp.pid, tp.tid, t.taken_ns
        FROM link_transport AS l
        JOIN publication AS b USING (publication_id)
        JOIN place AS bp USING (thread_id)
        JOIN publisher AS u USING (publisher_id)
        JOIN take AS t ON l.take_id = t.take_id
        JOIN place AS tp ON t.thread_id = tp.thread_id
        WHERE l.method = 'exact' AND l.candidate_count = 1 AND NOT l.is_loss_affected
        """,
    ),
    "causal": (
        """
        SELECT host, pid, tid, kind, callback_start_ns, take_rmw_ns, topic_name,
            publication_rcl_ns, publication_rmw_ns
        FROM truth_causal
        WHERE kind NOT IN ('take_adjacent', 'triggered') AND publication_id IN (FROM named)
        """,
        """
        SELECT p.hostname, p.pid, p.tid, l.kind, i.start_ns, t.taken_ns, u.topic_name, b.rcl_ns,
            b.rmw_ns
        FROM link_causal AS l
        JOIN publication AS b USING (publication_id)
        LEFT JOIN callback_instance AS i USING (callback_instance_id)
        JOIN place AS p ON coalesce(i.thread_id, b.thread_id) = p.thread_id
        JOIN publisher AS u ON b.publisher_id = u.publisher_id
        LEFT JOIN take AS t ON l.take_id = t.take_id AND t.method = 'rmw'
        -- What Agnocast carries has no such times: test_agnocast.
        WHERE l.kind <> 'take_adjacent' AND NOT u.is_agnocast
        """,
    ),
    "executor_state": (
        "SELECT host, pid, tid, start_ns, end_ns, state FROM truth_executor_state",
        """
        SELECT p.hostname, p.pid, p.tid, e.start_ns, e.end_ns, e.state
        FROM executor_state AS e
        JOIN place AS p USING (thread_id)
        """,
    ),
}
END_TO_END = (
    """
    SELECT root_host, root_pid, root_tid, root_start_ns, path, sink_host, sink_pid, sink_tid,
        sink_node, sink_take_ns, sink_end_ns
    FROM truth_end_to_end
    """,
    """
    SELECT rp.hostname, rp.pid, rp.tid, e.root_ns, h.topics, tp.hostname, tp.pid, tp.tid,
        n.full_name, t.taken_ns, e.sink_ns
    FROM end_to_end(
        [1], NULL, NULL, 'callback_start', 'callback_end', 0, 9223372036854775807
    ) AS e
    JOIN flow_path([1], NULL, NULL) AS h USING (path_id)
    JOIN callback_instance AS i
        ON e.root_kind = 'callback_instance' AND e.root_id = i.callback_instance_id
    JOIN callback AS c ON i.callback_id = c.callback_id AND c.kind = 'timer'
    JOIN place AS rp ON i.thread_id = rp.thread_id
    JOIN take AS t ON e.take_id = t.take_id
    JOIN place AS tp ON t.thread_id = tp.thread_id
    JOIN subscription AS s ON t.subscription_id = s.subscription_id
    JOIN node AS n ON s.node_id = n.node_id
    WHERE e.status = 'reached'
    """,
)
PLACE = """
CREATE TEMP VIEW IF NOT EXISTS place AS
SELECT t.thread_id, h.hostname, p.pid, t.tid
FROM thread AS t
JOIN process AS p ON t.process_id = p.process_id
JOIN host AS h ON p.host_id = h.host_id;
-- A process may be killed in rclcpp_publish, which does not say who publishes.
CREATE TEMP VIEW IF NOT EXISTS named AS
SELECT publication_id
FROM truth_publication
WHERE rcl_ns IS NOT NULL OR intra_ns IS NOT NULL;
CREATE TEMP VIEW IF NOT EXISTS ambiguous AS
SELECT unnest(list(publication_id))
FROM truth_publication
WHERE rmw_ns IS NOT NULL
GROUP BY topic_name, source_timestamp_ns
HAVING count(*) > 1
"""


# Where callbacks overlap, which run filled a cache is a guess.
DOUBTFUL = {"reentrant"}
# What these systems do not do.
ABSENT = {
    ("timers", "causal"),
    ("actions", "causal"),
    ("intra_process", "take"),
    ("intra_process", "transport"),
}


@pytest.mark.parametrize("table", CASES)
@pytest.mark.parametrize("name", few(scenarios(), *SHOWN))
def test_row_by_row(simulations: Callable[[str], Ingested], name: str, table: str) -> None:
    simulated = simulations(name)
    simulated.connection.execute(PLACE)
    expected, actual = CASES[table]
    if table == "causal" and name in DOUBTFUL:
        certain = f"{actual} AND l.candidate_count = 1"
        assert simulated.differences(expected, certain)[1] == []
        return
    is_there = simulated.rows(f"SELECT count(*) > 0 FROM ({expected})")
    assert is_there == [((name, table) not in ABSENT,)]
    assert simulated.differences(*CASES[table]) == ([], [])


@pytest.mark.thorough
def test_a_wrong_indirect_link_is_marked_and_no_input_is_said_to_lack_a_message(
    simulations: Callable[[str], Ingested],
) -> None:
    simulated = simulations("reentrant")
    simulated.connection.execute(PLACE)
    expected, actual = CASES["causal"]
    wrong = dict(
        simulated.rows(
            f"SELECT kind, count(*) FROM (({actual}) EXCEPT ALL ({expected})) GROUP BY kind"
        )
    )
    assert min(wrong["partial_sync"], wrong["periodic_async"]) > 20
    # Each firing has one message of each input.
    assert simulated.rows(
        "SELECT count(*) FROM annotation_firing JOIN annotation USING (annotation_id) "
        "WHERE kind = 'partial_sync' AND NOT is_complete"
    ) == [(0,)]
    for kind in ("partial_sync", "periodic_async"):
        certain, doubtful = simulated.rows(
            "SELECT count(*) FILTER (candidate_count = 1), count(*) FILTER (candidate_count > 1) "
            f"FROM link_causal WHERE kind = '{kind}'"
        )[0]
        assert certain > 5
        assert doubtful >= wrong[kind]


def test_flows_row_by_row(complete: Ingested) -> None:
    complete.connection.execute(PLACE)
    assert complete.rows("SELECT count(*) FROM truth_end_to_end") > [(0,)]
    assert complete.differences(*END_TO_END) == ([], [])


def test_a_link_is_ambiguous_only_if_stamps_are_equal(simulated: Ingested) -> None:
    simulated.connection.execute(PLACE)
    columns = "topic_name, publication_rmw_ns, take_pid, take_rmw_ns"
    truth = (
        "FROM truth_transport WHERE method = 'rmw' AND publication_id IN (FROM ambiguous) "
        "AND NOT is_internal"
    )
    # In the order of publication, which is right where every message was delivered.
    assert simulated.differences(
        f"SELECT {columns} {truth}",
        """
        SELECT u.topic_name, b.rmw_ns, p.pid, t.taken_ns
        FROM link_transport AS l
        JOIN publication AS b USING (publication_id)
        JOIN publisher AS u USING (publisher_id)
        JOIN take AS t USING (take_id)
        JOIN place AS p ON t.thread_id = p.thread_id
        WHERE l.method = 'exact' AND l.candidate_count > 1 AND NOT u.is_internal
        """,
    ) == ([], [])


def test_latency_of_messages_on_one_clock(simulated: Ingested) -> None:
    """From the end of the publication to the take, as far as one clock can tell."""
    simulated.connection.execute(PLACE)
    assert simulated.differences(
        "SELECT take_rmw_ns, take_rmw_ns - publication_rmw_ns FROM truth_transport "
        "WHERE method = 'rmw' AND publication_id NOT IN (FROM ambiguous)",
        "SELECT taken_ns, taken_ns - end_ns FROM link_transport AS l JOIN take USING (take_id) "
        "JOIN publication USING (publication_id) "
        "WHERE l.method = 'exact' AND candidate_count = 1",
    ) == ([], [])


def test_latency_of_flows(complete: Ingested) -> None:
    """The true duration is that of the trace, where begin and end are on one host."""
    assert complete.differences(
        "SELECT latency_ns FROM truth_end_to_end WHERE root_host = sink_host",
        """
        SELECT latency_ns
        FROM end_to_end(
            [1], NULL, NULL, 'callback_start', 'callback_end', 0, 9223372036854775807
        ) AS e
        JOIN take AS t ON e.take_id = t.take_id
        JOIN callback_instance AS i ON root_id = i.callback_instance_id
        JOIN callback AS c ON i.callback_id = c.callback_id AND c.kind = 'timer'
        JOIN process AS rp ON i.process_id = rp.process_id
        JOIN process AS tp ON t.process_id = tp.process_id
        WHERE root_kind = 'callback_instance' AND status = 'reached' AND rp.host_id = tp.host_id
        """,
    ) == ([], [])


def test_nothing_is_guessed_and_nothing_was_lost(complete: Ingested) -> None:
    for view in ("node", "publisher", "subscription"):
        assert complete.rows(f"SELECT * FROM {view} WHERE is_inferred") == []
    assert complete.rows("SELECT * FROM take WHERE method <> 'rmw'") == []
    assert complete.rows("SELECT * FROM callback WHERE kind = 'unknown'") == []
    assert complete.rows("SELECT * FROM gap") == []


def test_a_take_without_publication_is_none_of_a_traced_publisher(simulated: Ingested) -> None:
    assert simulated.rows(
        "SELECT * FROM take ANTI JOIN link_transport USING (take_id) WHERE method = 'rmw'"
    ) == simulated.rows("SELECT * FROM truth_take WHERE publication_id IS NULL")
