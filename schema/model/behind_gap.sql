-- name: staging.behind_gap
-- description: Events with a gap between themselves and their predecessor in a sequence of their
--     thread: a loss on the CPU of either, or a pause of the trace. Nothing is paired across it.
-- grain: one row per event and sequence that a gap interrupts
-- needs: staging.predecessor, staging.event, staging.loss_interval
WITH gap AS (
    SELECT trace_id - 1 AS trace_index, cpu, start_ns FROM staging.loss_interval
),
exposed AS (
    SELECT
        e.event_id, e.thread_index, e.trace_index, e.sequence, e.ts_ns, e.cpu_id,
        p.ts_ns AS previous_ns, p.cpu_id AS previous_cpu_id
    FROM staging.predecessor AS e
    JOIN staging.event AS p ON e.previous_event_id = p.event_id
    WHERE e.trace_index IN (SELECT trace_index FROM gap)
),
own_cpu AS (
    SELECT e.event_id, e.thread_index, e.sequence
    FROM exposed AS e
    ASOF JOIN gap AS g
        ON e.trace_index = g.trace_index AND e.cpu_id = g.cpu AND e.ts_ns > g.start_ns
    WHERE g.start_ns >= e.previous_ns
),
previous_cpu AS (
    SELECT e.event_id, e.thread_index, e.sequence
    FROM exposed AS e
    ASOF JOIN gap AS g
        ON e.trace_index = g.trace_index AND e.previous_cpu_id = g.cpu AND e.ts_ns > g.start_ns
    WHERE g.start_ns >= e.previous_ns
),
every_cpu AS (
    SELECT e.event_id, e.thread_index, e.sequence
    FROM exposed AS e
    ASOF JOIN (SELECT trace_index, start_ns FROM gap WHERE cpu IS NULL) AS g
        ON e.trace_index = g.trace_index AND e.ts_ns > g.start_ns
    WHERE g.start_ns >= e.previous_ns
)
SELECT event_id, thread_index, sequence FROM own_cpu
UNION
SELECT event_id, thread_index, sequence FROM previous_cpu
UNION
SELECT event_id, thread_index, sequence FROM every_cpu
