-- name: derive.link_transport_ring_buffer
-- kind: macro
-- description: Messages between nodes of one process, by the slot of the ring buffer: what is taken
--     out was put in last, unless the buffer was cleared or made anew meanwhile, or a gap of the
--     trace may hide that it was used again.
-- grain: one row per dequeue whose publication is known
-- param: only_run BIGINT  Run to look at
-- needs: store.ring_buffer_event, derive.exposed_trace, derive.recording_gap, store.publication,
--     store.take
CREATE OR REPLACE MACRO derive.link_transport_ring_buffer(only_run) AS TABLE
WITH slot_use AS (
    SELECT
        run_id, trace_id, process_id, buffer_handle, kind, at_ns, take_id, event_id,
        lag(kind) OVER in_slot AS previous_kind,
        lag(event_id) OVER in_slot AS previous_event_id,
        lag(at_ns) OVER in_slot AS previous_ns,
        lag(trace_id) OVER in_slot AS previous_trace_id,
        lag(publication_id) OVER in_slot AS publication_id
    FROM store.ring_buffer_event
    WHERE run_id = only_run AND kind <> 'clear'
    WINDOW in_slot AS (
        PARTITION BY run_id, process_id, buffer_handle, slot ORDER BY event_id
    )
),
cleared AS (
    SELECT s.run_id, s.take_id
    FROM slot_use AS s
    ASOF JOIN (
        SELECT * FROM store.ring_buffer_event WHERE run_id = only_run AND kind = 'clear'
    ) AS c
        ON s.run_id = c.run_id
        AND s.process_id = c.process_id
        AND s.buffer_handle = c.buffer_handle
        AND s.event_id > c.event_id
    WHERE c.event_id > s.previous_event_id
),
exposed AS (
    SELECT s.take_id, s.at_ns, s.previous_ns, x.recording_id
    FROM slot_use AS s
    JOIN derive.exposed_trace AS x ON s.trace_id = x.trace_id
    UNION ALL
    SELECT s.take_id, s.at_ns, s.previous_ns, x.recording_id
    FROM slot_use AS s
    JOIN derive.exposed_trace AS x ON s.previous_trace_id = x.trace_id
    WHERE s.previous_trace_id <> s.trace_id
),
behind_gap AS (
    SELECT e.take_id
    FROM exposed AS e
    ASOF JOIN derive.recording_gap AS g
        ON e.recording_id = g.recording_id AND e.at_ns > g.start_ns
    WHERE g.start_ns >= e.previous_ns OR g.covered_until_ns > e.previous_ns
)
SELECT
    s.run_id,
    s.publication_id,
    s.take_id,
    b.publisher_id,
    t.subscription_id,
    'ring_buffer' AS method,
    1::BIGINT AS candidate_count,
    false AS is_loss_affected
FROM slot_use AS s
JOIN store.publication AS b ON s.publication_id = b.publication_id
JOIN store.take AS t ON s.take_id = t.take_id
ANTI JOIN cleared AS c ON s.take_id = c.take_id
ANTI JOIN behind_gap AS g ON s.take_id = g.take_id
WHERE b.run_id = only_run
    AND t.run_id = only_run
    AND s.kind = 'dequeue'
    AND s.previous_kind = 'enqueue'
