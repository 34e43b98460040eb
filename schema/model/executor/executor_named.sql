-- description: Executors that name themselves (CARET), or are named by a thread that works for
--     them (Python). Of some, only the address is known, since their construction was not traced.
-- grain: one row per executor
-- when: raw.ros2_caret_construct_executor, raw.ros2_caret_construct_static_executor,
--     raw.ros2_caret_add_callback_group, raw.ros2_caret_executor_entity_collector_to_executor,
--     staging.python_mark WHERE kind = 'executor'
WITH constructed AS (
    SELECT
        event_id, process_id, executor_addr,
        executor_type_name AS kind
    FROM staging.located('raw.ros2_caret_construct_executor')
    UNION ALL
    SELECT event_id, process_id, executor_addr, executor_type_name
    FROM staging.located('raw.ros2_caret_construct_static_executor')
),
used AS (
    SELECT event_id, process_id, executor_addr
    FROM staging.located('raw.ros2_caret_add_callback_group')
    UNION ALL
    SELECT event_id, process_id, executor_addr
    FROM staging.located('raw.ros2_caret_executor_entity_collector_to_executor')
)
SELECT
    event_id, process_id, executor_addr,
    coalesce(kind, 'unknown') AS kind
FROM constructed
UNION ALL
SELECT
    min(u.event_id),
    u.process_id, u.executor_addr, 'unknown'
FROM used AS u
ANTI JOIN constructed AS c ON u.process_id = c.process_id AND u.executor_addr = c.executor_addr
GROUP BY u.process_id, u.executor_addr
UNION ALL
SELECT
    min(event_id),
    process_id, number,
    arg_min(text, event_id)
FROM staging.python_mark
WHERE kind = 'executor'
GROUP BY process_id, number
