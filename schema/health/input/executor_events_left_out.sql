-- title: Executors without the events that delimit their states
-- description: An executor says that it waits for work, looks for what is ready, and executes. The
--     recording has not all of these, so nothing shows when its threads waited, and their states
--     have no end. Callbacks, services, takes and links are not affected.
-- cause: The session left out rclcpp_executor_wait_for_work or rclcpp_executor_get_next_ready, such
--     as against busy waiting, or all events of executors.
-- cure: Record all three events where it matters what executors do.
-- grain: one row per process with such threads
-- severity: warning
-- when: staging.executor_first WHERE is_undelimited, staging.executor_named
WITH left_out AS (
    SELECT process_id, thread_id FROM staging.executor_first WHERE is_undelimited
    UNION
    -- CARET names the kind of the executor. These kinds have events.
    SELECT p.process_id, p.thread_id
    FROM staging.callback_run AS p
    ANTI JOIN staging.executor_first AS f ON p.thread_id = f.thread_id
    WHERE p.process_id IN (SELECT process_id FROM staging.executor_named WHERE kind IN (
        'single_threaded_executor', 'multi_threaded_executor'
    ))
    GROUP BY p.process_id, p.thread_id
    HAVING count(*) > 1
)
SELECT
    process_id,
    count(*) AS count,
    'nothing shows when its threads waited for work' AS detail
FROM left_out
GROUP BY process_id
