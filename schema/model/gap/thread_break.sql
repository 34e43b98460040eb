-- name: staging.thread_break
-- description: Where the record of a thread breaks: the first of all its events behind each gap, a
--     loss on the CPU of that event or the one before, or a pause of the trace; or, where
--     `is_elsewhere`, a loss on other CPUs only, which the thread may have visited meanwhile.
-- grain: one row per event with a gap between itself and the one before on its thread
-- needs: staging.event, staging.exposed_trace, staging.gap, staging.context, staging.thread
WITH exposed AS (
    SELECT
        event_id, thread_index, trace_index, ts_ns, cpu_id,
        lag(ts_ns) OVER on_thread AS previous_ns,
        lag(cpu_id) OVER on_thread AS previous_cpu_id
    FROM staging.event
    WHERE trace_index IN (SELECT trace_index FROM staging.exposed_trace)
    WINDOW on_thread AS (PARTITION BY thread_index ORDER BY event_id)
),
near AS (
    SELECT e.*
    FROM (
        SELECT x.*, t.recording_index
        FROM exposed AS x
        JOIN staging.exposed_trace AS t ON x.trace_index = t.trace_index
        WHERE x.previous_ns IS NOT NULL
    ) AS e
    ASOF JOIN staging.gap AS g
        ON e.recording_index = g.recording_index AND e.ts_ns > g.start_ns
    WHERE g.start_ns >= e.previous_ns OR g.any_covered_until_ns > e.previous_ns
),
place AS (
    SELECT
        event_id, recording_index, ts_ns, previous_ns,
        unnest([cpu_id, previous_cpu_id, -1]) AS cpu_id
    FROM near
),
behind AS (
    SELECT DISTINCT p.event_id
    FROM place AS p
    ASOF JOIN staging.gap AS g
        ON p.recording_index = g.recording_index AND p.cpu_id = g.cpu_id AND p.ts_ns > g.start_ns
    WHERE g.start_ns >= p.previous_ns OR g.covered_until_ns > p.previous_ns
)
SELECT
    c.thread_id,
    n.event_id AS resumed_event_id,
    n.ts_ns AS resumed_ns,
    b.event_id IS NULL AS is_elsewhere
FROM near AS n
LEFT JOIN behind AS b ON n.event_id = b.event_id
JOIN staging.context AS c
    ON n.thread_index = c.thread_index
    AND n.event_id >= c.from_event_id
    AND n.event_id < c.until_event_id
JOIN staging.thread AS t ON c.thread_id = t.thread_id AND n.event_id > t.first_event_id
