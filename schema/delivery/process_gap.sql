-- description: When each process may have done something that is not in its traces, for ASOF
--     joins as with derive.recording_gap: in gaps of its recordings; before its first event, if
--     it existed then; and between two recordings. The tracer tells one process after the other
--     to stop and to go on. So for a process, a pause lasts from its last event before the pause
--     to its first one after it.
-- grain: one row per process and gap
-- param: has_gaps BOOLEAN = true  The recording has gaps; false: none is looked up
-- param: has_pauses BOOLEAN = true  Likewise pauses
CREATE OR REPLACE MACRO derive.process_gap(only_run, has_gaps := true, has_pauses := true) AS TABLE
WITH presence AS MATERIALIZED (
    SELECT run_id, process_id, recording_id, begin_ns, end_ns, first_ns, last_ns, is_born
    FROM derive.process_presence
    WHERE run_id = only_run
),
interval_of_process AS MATERIALIZED (
    SELECT p.run_id, p.process_id, l.kind, l.start_ns, l.end_ns
    FROM store.gap AS l
    JOIN derive.recording AS r ON l.trace_id = r.trace_id
    JOIN presence AS p ON r.recording_id = p.recording_id
),
pause AS MATERIALIZED (
    SELECT run_id, process_id, start_ns, end_ns FROM interval_of_process WHERE kind = 'pause'
),
-- What the paused processes did, where there are any.
moment AS (
    SELECT
        process_id,
        start_ns AS at_ns
    FROM store.publication
    WHERE run_id = only_run
    UNION ALL
    SELECT process_id, end_ns
    FROM store.publication
    WHERE run_id = only_run
    UNION ALL
    SELECT process_id, taken_ns
    FROM store.take
    WHERE run_id = only_run
    UNION ALL
    SELECT process_id, start_ns
    FROM store.callback_instance
    WHERE run_id = only_run
    UNION ALL
    SELECT process_id, end_ns
    FROM store.callback_instance
    WHERE run_id = only_run
    UNION ALL
    SELECT t.process_id, s.start_ns
    FROM store.executor_state AS s
    JOIN store.thread AS t ON s.thread_id = t.thread_id
    WHERE s.run_id = only_run
),
active AS MATERIALIZED (
    SELECT process_id, at_ns
    FROM moment
    WHERE process_id IN (SELECT process_id FROM pause) AND at_ns IS NOT NULL
),
absence AS (
    SELECT
        p.run_id, p.process_id,
        coalesce(b.at_ns, p.start_ns) AS start_ns,
        coalesce(a.at_ns, p.end_ns) AS end_ns
    FROM pause AS p
    ASOF LEFT JOIN active AS b ON p.process_id = b.process_id AND p.start_ns >= b.at_ns
    ASOF LEFT JOIN active AS a ON p.process_id = a.process_id AND p.end_ns <= a.at_ns
),
following AS (
    SELECT
        run_id, process_id, begin_ns, first_ns, is_born,
        max(end_ns) OVER earlier AS previous_end_ns,
        max(last_ns) OVER earlier AS previous_last_ns
    FROM presence
    WINDOW earlier AS (
        PARTITION BY run_id, process_id ORDER BY begin_ns, recording_id
        ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
    )
),
gap AS (
    SELECT run_id, process_id, start_ns, end_ns
    FROM interval_of_process
    WHERE has_gaps AND kind <> 'pause'
    UNION ALL
    SELECT run_id, process_id, start_ns, end_ns FROM absence WHERE has_pauses
    UNION ALL
    SELECT
        run_id, process_id,
        CASE WHEN previous_end_ns IS NULL THEN begin_ns ELSE previous_last_ns END,
        CASE WHEN previous_end_ns IS NULL THEN first_ns - 1 ELSE first_ns END
    FROM following
    WHERE begin_ns > previous_end_ns OR (previous_end_ns IS NULL AND NOT is_born)
)
SELECT
    run_id, process_id, start_ns,
    max(end_ns) OVER (
        PARTITION BY run_id, process_id ORDER BY start_ns, end_ns ROWS UNBOUNDED PRECEDING
    ) AS covered_until_ns
FROM gap
