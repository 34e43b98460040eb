-- name: staging.dispatch_event
-- description: Starts of callbacks and the executor event directly before each, in traces with gaps
--     only: what has to be looked at to tell whether a gap lies between the two.
-- grain: one row per start of a callback, and one per executor event directly before some
-- needs: staging.callback_event, staging.executor_event, staging.dispatch_candidate,
--     staging.loss_interval
WITH gap AS (
    SELECT DISTINCT trace_id - 1 AS trace_index FROM staging.loss_interval
)
SELECT c.event_id, c.ts_ns, c.trace_index, c.cpu_id, c.thread_id
FROM staging.callback_event AS c
WHERE c.is_start AND c.trace_index IN (SELECT trace_index FROM gap)
UNION ALL
SELECT x.event_id, x.ts_ns, x.trace_index, x.cpu_id, x.thread_id
FROM staging.executor_event AS x
WHERE x.trace_index IN (SELECT trace_index FROM gap)
    AND x.event_id IN (SELECT executor_event_id FROM staging.dispatch_candidate)
