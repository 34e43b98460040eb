-- description: What the handles of annotations mean at the time of the annotation: the object
--     initialised last before, else the one that was used but never seen to be initialised. A
--     subscription without initialisation is known by the callback of its rclcpp object.
-- grain: one row per message_link event, side and handle; one per event without any
-- when: raw.ros2_message_link_approximate_sync, raw.ros2_message_link_partial_sync,
--     raw.ros2_message_link_periodic_async

CREATE OR REPLACE TEMP TABLE annotation_event AS
SELECT
    event_id, process_id,
    'periodic_async' AS kind,
    subs AS inputs,
    pubs AS outputs
FROM staging.located('raw.ros2_message_link_periodic_async')
UNION ALL
SELECT event_id, process_id, 'partial_sync', subs, pubs
FROM staging.located('raw.ros2_message_link_partial_sync')
UNION ALL
SELECT event_id, process_id, 'approximate_sync', subs, pubs
FROM staging.located('raw.ros2_message_link_approximate_sync');

WITH input AS (
    SELECT DISTINCT
        event_id, process_id,
        unnest(inputs) AS handle
    FROM annotation_event
),
output AS (
    SELECT DISTINCT
        event_id, process_id,
        unnest(outputs) AS handle
    FROM annotation_event
),
input_by_handle AS (
    SELECT i.event_id, i.process_id, i.handle, s.subscription_id
    FROM input AS i
    ASOF LEFT JOIN (SELECT * FROM staging.subscription WHERE NOT is_inferred) AS s
        ON i.process_id = s.process_id
        AND i.handle = s.subscription_handle
        AND i.event_id >= s.event_id
),
input_by_callback AS (
    SELECT i.event_id, i.handle, c.subscription_id
    FROM input_by_handle AS i
    ASOF JOIN staging.located('raw.ros2_rclcpp_subscription_init') AS o
        ON i.process_id = o.process_id
        AND i.handle = o.subscription_handle
        AND i.event_id >= o.event_id
    ASOF JOIN staging.located('raw.ros2_rclcpp_subscription_callback_added') AS a
        ON o.process_id = a.process_id
        AND o.subscription = a.subscription
        AND i.event_id >= a.event_id
    JOIN staging.callback AS c ON a.event_id = c.event_id
    WHERE i.subscription_id IS NULL
),
output_by_handle AS (
    SELECT o.event_id, o.process_id, o.handle, p.publisher_id
    FROM output AS o
    ASOF LEFT JOIN (SELECT * FROM staging.publisher WHERE NOT is_inferred) AS p
        ON o.process_id = p.process_id
        AND o.handle = p.publisher_handle
        AND o.event_id >= p.event_id
),
object AS (
    SELECT
        i.event_id,
        'input' AS side,
        i.handle,
        coalesce(i.subscription_id, c.subscription_id) AS object_id
    FROM input_by_handle AS i
    LEFT JOIN input_by_callback AS c ON i.event_id = c.event_id AND i.handle = c.handle
    UNION ALL
    SELECT
        o.event_id, 'output', o.handle,
        coalesce(o.publisher_id, p.publisher_id)
    FROM output_by_handle AS o
    LEFT JOIN staging.publisher AS p
        ON p.is_inferred AND o.process_id = p.process_id AND o.handle = p.publisher_handle
)
SELECT e.event_id, e.process_id, e.kind, o.side, o.handle, o.object_id
FROM annotation_event AS e
LEFT JOIN object AS o ON e.event_id = o.event_id
