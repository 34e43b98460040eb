-- description: State changes of managed nodes, by the state machine that the node created last.
-- grain: one row per rcl_lifecycle_transition
-- when: raw.ros2_rcl_lifecycle_transition
WITH machine AS (
    SELECT m.event_id, m.process_id, m.state_machine, n.node_id
    FROM staging.located('raw.ros2_rcl_lifecycle_state_machine_init') AS m
    JOIN staging.object_node AS n ON m.event_id = n.event_id
)
SELECT
    m.node_id,
    t.ts_ns AS at_ns,
    t.start_label AS start_state,
    t.goal_label AS goal_state
FROM staging.located('raw.ros2_rcl_lifecycle_transition') AS t
ASOF LEFT JOIN machine AS m
    ON t.process_id = m.process_id
    AND t.state_machine = m.state_machine
    AND t.event_id >= m.event_id
ORDER BY t.event_id
