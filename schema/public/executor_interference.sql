-- name: main.executor_interference
-- description: What the threads of its executor ran while a callback instance waited. Overlaps of
--     one thread add up to the time for which it was busy; those of several threads run side by
--     side.
-- grain: one row per waiting callback instance and one that its executor was busy with meanwhile
-- column: run_id BIGINT  Run that the row belongs to
-- column: callback_instance_id BIGINT  Callback instance that waited
-- column: meanwhile_id BIGINT  Callback instance that the executor was busy with
-- column: executor_id BIGINT  Their executor
-- column: thread_id BIGINT  Thread that was busy
-- column: overlap_ns BIGINT [ns]  From earliest_ns of the wait on (latest_ns where that is unknown)
-- column: certain_ns BIGINT [ns]  From latest_ns of the wait on
-- needs: derive.executor_meanwhile
SELECT
    run_id, callback_instance_id, meanwhile_id, executor_id, thread_id, overlap_ns, certain_ns
FROM derive.executor_meanwhile(NULL)
