-- description: Which executors callback groups were added to (CARET), directly or by way of the
--     collector of entities of an executor. An address means what was there last before; what is
--     reported late may come in any order, then what was there first after.
-- grain: one row per callback group and executor
-- when: raw.ros2_caret_add_callback_group, raw.ros2_caret_add_callback_group_static_executor,
--     raw.ros2_caret_callback_group_to_executor_entity_collector
WITH collected AS (
    SELECT event_id, process_id, executor_addr, entities_collector_addr
    FROM staging.located('raw.ros2_caret_construct_static_executor')
    UNION ALL
    SELECT event_id, process_id, executor_addr, entities_collector_addr
    FROM staging.located('raw.ros2_caret_executor_entity_collector_to_executor')
),
to_collector AS (
    SELECT event_id, process_id, callback_group_addr, group_type_name, entities_collector_addr
    FROM staging.located('raw.ros2_caret_add_callback_group_static_executor')
    UNION ALL
    SELECT event_id, process_id, callback_group_addr, group_type_name, entities_collector_addr
    FROM staging.located('raw.ros2_caret_callback_group_to_executor_entity_collector')
),
nearest_collector AS (
    SELECT
        a.event_id,
        coalesce(
            max(CASE WHEN c.event_id <= a.event_id THEN c.event_id END), min(c.event_id)
        ) AS collected_event_id
    FROM to_collector AS a
    JOIN collected AS c
        ON a.process_id = c.process_id AND a.entities_collector_addr = c.entities_collector_addr
    GROUP BY a.event_id
),
added AS (
    SELECT event_id, process_id, callback_group_addr, group_type_name, executor_addr
    FROM staging.located('raw.ros2_caret_add_callback_group')
    UNION ALL
    SELECT a.event_id, a.process_id, a.callback_group_addr, a.group_type_name, c.executor_addr
    FROM to_collector AS a
    LEFT JOIN nearest_collector AS n ON a.event_id = n.event_id
    LEFT JOIN collected AS c ON n.collected_event_id = c.event_id
),
owned AS (
    SELECT
        a.event_id, a.process_id, a.callback_group_addr, a.group_type_name,
        coalesce(
            max(CASE WHEN x.event_id <= a.event_id THEN x.event_id END), min(x.event_id)
        ) AS executor_event_id
    FROM added AS a
    LEFT JOIN staging.executor_named AS x
        ON a.process_id = x.process_id AND a.executor_addr = x.executor_addr
    GROUP BY a.event_id, a.process_id, a.callback_group_addr, a.group_type_name
)
SELECT
    row_number() OVER (ORDER BY min(event_id)) AS callback_group_id,
    min(event_id) AS event_id,
    process_id, callback_group_addr, executor_event_id,
    arg_min(group_type_name, event_id) AS kind
FROM owned
GROUP BY process_id, callback_group_addr, executor_event_id
