-- description: Messages between nodes of one process, by the slot of the ring buffer: what is
--     taken out of a slot was put in last. Exceptions: the buffer was cleared or made anew
--     meanwhile, or a gap of the trace may hide that the slot was used again. The slots are used
--     in turn, so a slot is used again after as many messages as the buffer has slots. Within a
--     gap, messages are assumed to come no faster than where nothing is missing.
-- grain: one row per dequeue whose publication is known
-- when: store.ring_buffer_event
CREATE OR REPLACE MACRO derive.link_transport_ring_buffer(only_run) AS TABLE
WITH slot_use AS (
    SELECT
        run_id, trace_id, process_id, buffer_handle, slot, kind, at_ns, take_id, event_id,
        lag(kind) OVER in_slot AS previous_kind,
        lag(event_id) OVER in_slot AS previous_event_id,
        lag(at_ns) OVER in_slot AS previous_ns,
        lag(trace_id) OVER in_slot AS previous_trace_id,
        lag(publication_id) OVER in_slot AS publication_id
    FROM store.ring_buffer_event
    WHERE run_id = only_run AND kind <> 'clear'
    WINDOW in_slot AS (PARTITION BY run_id, process_id, buffer_handle, slot ORDER BY event_id)
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
behind_gap AS (
    SELECT
        e.take_id, e.process_id, e.buffer_handle,
        e.at_ns - e.previous_ns AS stay_ns
    FROM (
        SELECT
            take_id, process_id, buffer_handle, at_ns, previous_ns,
            unnest([trace_id, previous_trace_id]) AS either_trace_id
        FROM slot_use
    ) AS e
    JOIN derive.exposed_trace AS x ON e.either_trace_id = x.trace_id
    ASOF JOIN derive.recording_gap AS g ON x.recording_id = g.recording_id AND e.at_ns > g.start_ns
    WHERE g.start_ns >= e.previous_ns OR g.covered_until_ns > e.previous_ns
),
-- The time from one message put into a buffer to the next, where no gap lies in between.
filled AS (
    SELECT
        e.process_id, e.buffer_handle, e.slot, e.at_ns, x.recording_id,
        lag(e.at_ns) OVER (
            PARTITION BY e.process_id, e.buffer_handle ORDER BY e.event_id
        ) AS previous_ns
    FROM slot_use AS e
    JOIN derive.exposed_trace AS x ON e.trace_id = x.trace_id
    WHERE e.kind = 'enqueue'
        AND (e.process_id, e.buffer_handle) IN (SELECT (process_id, buffer_handle) FROM behind_gap)
),
pace AS (
    SELECT
        f.process_id, f.buffer_handle,
        max(f.slot) + 1 AS slot_count,
        min(
            CASE
                WHEN g.covered_until_ns > f.previous_ns OR g.start_ns >= f.previous_ns THEN NULL
                ELSE f.at_ns - f.previous_ns
            END
        ) AS shortest_ns
    FROM filled AS f
    ASOF LEFT JOIN derive.recording_gap AS g
        ON f.recording_id = g.recording_id AND f.at_ns > g.start_ns
    GROUP BY f.process_id, f.buffer_handle
),
-- Where the pace is not known, every take behind a gap is doubtful.
doubtful AS (
    SELECT g.take_id
    FROM behind_gap AS g
    LEFT JOIN pace AS p ON g.process_id = p.process_id AND g.buffer_handle = p.buffer_handle
    WHERE coalesce(g.stay_ns >= p.slot_count * p.shortest_ns, true)
)
SELECT
    s.run_id, s.publication_id, s.take_id, b.publisher_id, t.subscription_id,
    'ring_buffer' AS method,
    1::BIGINT AS candidate_count,
    false AS is_loss_affected
FROM slot_use AS s
JOIN store.publication AS b ON s.publication_id = b.publication_id
JOIN store.take AS t ON s.take_id = t.take_id
ANTI JOIN cleared AS c ON s.take_id = c.take_id
ANTI JOIN doubtful AS g ON s.take_id = g.take_id
WHERE b.run_id = only_run
    AND t.run_id = only_run
    AND s.kind = 'dequeue'
    AND s.previous_kind = 'enqueue'
