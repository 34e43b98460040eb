-- description: Callbacks in callback groups (CARET), and the executor of each. A group usually is
--     filled before it is added to an executor; else it was added to it last.
-- grain: one row per callback in a callback group
-- when: staging.callback_group_owner
WITH entry AS (
    SELECT
        event_id, process_id, callback_group_addr,
        'timer' AS kind,
        timer_handle AS handle
    FROM staging.located('raw.ros2_caret_callback_group_add_timer')
    UNION ALL
    SELECT event_id, process_id, callback_group_addr, 'subscription', subscription_handle
    FROM staging.located('raw.ros2_caret_callback_group_add_subscription')
    UNION ALL
    SELECT event_id, process_id, callback_group_addr, 'service', service_handle
    FROM staging.located('raw.ros2_caret_callback_group_add_service')
),
object AS (
    SELECT
        event_id, process_id,
        'timer' AS kind,
        timer_handle AS handle,
        timer_id AS object_id
    FROM staging.timer
    UNION ALL
    SELECT event_id, process_id, 'subscription', subscription_handle, subscription_id
    FROM staging.subscription
    UNION ALL
    SELECT event_id, process_id, 'service', service_handle, service_id FROM staging.service
    UNION ALL
    -- Services of managed nodes have copies.
    SELECT k.event_id, k.process_id, 'service', k.service_handle, s.service_id
    FROM staging.callback_known AS k
    JOIN staging.service AS s
        ON k.service_event_id = s.event_id AND k.service_handle <> s.service_handle
),
filled AS (
    SELECT
        e.event_id, e.kind,
        coalesce(
            max(CASE WHEN o.event_id <= e.event_id THEN o.event_id END), min(o.event_id)
        ) AS object_event_id
    FROM entry AS e
    JOIN object AS o ON e.process_id = o.process_id AND e.kind = o.kind AND e.handle = o.handle
    GROUP BY e.event_id, e.kind
),
owned AS (
    SELECT
        e.event_id,
        coalesce(
            min(CASE WHEN g.event_id >= e.event_id THEN g.event_id END), max(g.event_id)
        ) AS group_event_id
    FROM entry AS e
    JOIN staging.callback_group_owner AS g
        ON e.process_id = g.process_id AND e.callback_group_addr = g.callback_group_addr
    GROUP BY e.event_id
),
entered AS (
    SELECT
        c.callback_id,
        min(w.group_event_id) AS group_event_id
    FROM filled AS f
    JOIN owned AS w ON f.event_id = w.event_id
    JOIN object AS o ON f.kind = o.kind AND f.object_event_id = o.event_id
    JOIN staging.callback AS c
        ON o.kind = c.kind
        AND o.object_id = CASE c.kind
            WHEN 'timer' THEN c.timer_id
            WHEN 'subscription' THEN c.subscription_id
            WHEN 'service' THEN c.service_id
        END
    GROUP BY c.callback_id
)
SELECT g.callback_group_id, e.callback_id, g.executor_event_id
FROM entered AS e
JOIN staging.callback_group_owner AS g ON e.group_event_id = g.event_id
ORDER BY e.callback_id
