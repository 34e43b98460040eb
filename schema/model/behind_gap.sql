-- name: staging.behind_gap
-- kind: macro
-- description: The events of a table that have a gap between themselves and the one before them in
--     it on their thread: a loss on the CPU of either, or a pause of the trace.
-- grain: one row per event behind a gap
-- needs: staging.loss_interval
CREATE OR REPLACE MACRO staging.behind_gap(events) AS TABLE
WITH gap AS (
    SELECT trace_id - 1 AS trace_index, cpu, start_ns FROM staging.loss_interval
),
exposed AS (
    SELECT
        event_id, thread_id, trace_index, ts_ns, cpu_id,
        lag(ts_ns) OVER on_thread AS previous_ns,
        lag(cpu_id) OVER on_thread AS previous_cpu_id
    FROM query_table(events)
    WHERE trace_index IN (SELECT trace_index FROM gap)
    WINDOW on_thread AS (PARTITION BY thread_id ORDER BY event_id)
),
own_cpu AS (
    SELECT e.event_id, e.thread_id
    FROM exposed AS e
    ASOF JOIN gap AS g
        ON e.trace_index = g.trace_index AND e.cpu_id = g.cpu AND e.ts_ns > g.start_ns
    WHERE g.start_ns >= e.previous_ns
),
previous_cpu AS (
    SELECT e.event_id, e.thread_id
    FROM exposed AS e
    ASOF JOIN gap AS g
        ON e.trace_index = g.trace_index AND e.previous_cpu_id = g.cpu AND e.ts_ns > g.start_ns
    WHERE g.start_ns >= e.previous_ns
),
every_cpu AS (
    SELECT e.event_id, e.thread_id
    FROM exposed AS e
    ASOF JOIN (SELECT trace_index, start_ns FROM gap WHERE cpu IS NULL) AS g
        ON e.trace_index = g.trace_index AND e.ts_ns > g.start_ns
    WHERE g.start_ns >= e.previous_ns
)
SELECT event_id, thread_id FROM own_cpu
UNION
SELECT event_id, thread_id FROM previous_cpu
UNION
SELECT event_id, thread_id FROM every_cpu
