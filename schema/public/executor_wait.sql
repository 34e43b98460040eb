-- description: How long callback instances waited in their executor, and what for. A trace does not
--     say when an input arrived: it became ready between earliest_ns and latest_ns. It could not
--     start (the executor was busy) while all threads ran callbacks, or one ran that excludes it.
--     The rest of the time was the network, an idle executor, or its own overhead. Callback
--     instances nested in others are left out.
-- grain: one row per callback instance that is not nested in another
-- column: run_id
-- column: callback_instance_id BIGINT  Callback instance that waited
-- column: executor_id, thread_id, callback_id, since, origin_ns, earliest_ns, latest_ns
-- column: start_ns BIGINT [epoch ns]  callback_start
-- column: wait_ns, busy_min_ns, busy_max_ns, blocked_max_ns, idle_ns, is_loss_affected, held_max_ns
WITH executor AS (
    SELECT
        executor_id,
        NULL::BIGINT AS until_ns
    FROM derive.executor_size
),
ready AS (FROM derive.callback_ready('executor'))
FROM derive.executor_waits('ready')
