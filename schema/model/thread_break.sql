-- name: staging.thread_break
-- description: Where the record of a thread breaks: the first of all its events behind each gap, a
--     loss on the CPU of that event or the one before, or a pause of the trace.
-- grain: one row per event with a gap between itself and the one before on its thread
-- needs: staging.event, staging.loss_interval, staging.context, staging.thread
WITH gap AS (
    SELECT trace_id - 1 AS trace_index, coalesce(cpu, -1) AS cpu_id, start_ns
    FROM staging.loss_interval
),
exposed AS (
    SELECT
        event_id, thread_index, trace_index, ts_ns, cpu_id,
        lag(ts_ns) OVER on_thread AS previous_ns,
        lag(cpu_id) OVER on_thread AS previous_cpu_id
    FROM staging.event
    WHERE trace_index IN (SELECT trace_index FROM gap)
    WINDOW on_thread AS (PARTITION BY thread_index ORDER BY event_id)
),
place AS (
    SELECT
        event_id, thread_index, trace_index, ts_ns, previous_ns,
        unnest([cpu_id, previous_cpu_id, -1]) AS cpu_id
    FROM exposed
    WHERE previous_ns IS NOT NULL
),
behind AS (
    SELECT DISTINCT p.event_id, p.thread_index, p.ts_ns
    FROM place AS p
    ASOF JOIN gap AS g
        ON p.trace_index = g.trace_index AND p.cpu_id = g.cpu_id AND p.ts_ns > g.start_ns
    WHERE g.start_ns >= p.previous_ns
)
SELECT c.thread_id, b.event_id AS resumed_event_id, b.ts_ns AS resumed_ns
FROM behind AS b
JOIN staging.context AS c
    ON b.thread_index = c.thread_index
    AND b.event_id >= c.from_event_id
    AND b.event_id < c.until_event_id
JOIN staging.thread AS t ON c.thread_id = t.thread_id AND b.event_id > t.first_event_id
