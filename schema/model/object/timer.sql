-- description: Timers. The node is linked after the timer was made (since Galactic). One that was
--     used but never initialised in the trace gets a row without period.
-- grain: one row per timer
-- when: raw.ros2_rcl_timer_init, staging.timer_use, staging.callback_owner
WITH every_timer AS (
    SELECT
        event_id, process_id,
        period AS period_ns,
        timer_handle,
        ts_ns AS created_ns
    FROM staging.located('raw.ros2_rcl_timer_init')
    UNION ALL BY NAME
    SELECT
        timer_event_id AS event_id,
        process_id,
        any_value(timer_handle) AS timer_handle
    FROM (
        SELECT timer_event_id, process_id, timer_handle FROM staging.timer_use WHERE is_inferred
        UNION ALL
        SELECT owner_event_id, process_id, handle
        FROM staging.callback_owner
        WHERE kind = 'timer' AND is_inferred
    )
    GROUP BY timer_event_id, process_id
),
linked AS (
    SELECT
        u.timer_event_id,
        min(n.node_id) AS node_id
    FROM staging.timer_use AS u
    JOIN staging.object_node AS n ON u.event_id = n.event_id
    GROUP BY u.timer_event_id
)
SELECT
    row_number() OVER (ORDER BY t.event_id) AS timer_id,
    t.process_id, l.node_id, t.period_ns, t.timer_handle, t.created_ns, t.event_id
FROM every_timer AS t
LEFT JOIN linked AS l ON t.event_id = l.timer_event_id
