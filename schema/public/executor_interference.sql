-- description: What the threads of its executor ran while a callback instance waited. Overlaps on
--     one thread add up to the time for which it was busy; overlaps on several threads may lie side
--     by side in time.
-- grain: one row per waiting callback instance and one that its executor was busy with meanwhile
-- column: run_id
-- column: callback_instance_id BIGINT  Callback instance that waited
-- column: meanwhile_id BIGINT  Callback instance that the executor was busy with
-- column: meanwhile_callback_id BIGINT  Its callback
-- column: executor_id
-- column: thread_id BIGINT  Thread that was busy
-- column: overlap_ns BIGINT [ns]  Overlap from earliest_ns of the wait on (from latest_ns if that
--     is unknown)
-- column: certain_ns BIGINT [ns]  Overlap from latest_ns of the wait on
WITH executor AS (
    SELECT
        executor_id,
        NULL::BIGINT AS until_ns
    FROM derive.executor_size
),
ready AS (FROM derive.callback_ready('executor'))
FROM derive.executor_meanwhile('ready')
