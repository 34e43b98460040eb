-- description: Which rcl subscription each rclcpp subscription object belongs to; one rcl handle
--     has two objects where intra-process communication is on. An object that is asked for belongs
--     to its initialisation in the same construction (since the thread's last
--     rcl_subscription_init), before or after; else to the latest before, else to the first after.
-- grain: one row per event that names an rclcpp subscription object
-- when: raw.ros2_rclcpp_subscription_callback_added, raw.ros2_rclcpp_ipb_to_subscription
WITH construction AS (
    SELECT
        event_id AS construction_event_id,
        thread_id
    FROM staging.subscription_known
),
initialised AS (
    SELECT
        i.event_id, i.process_id, i.thread_id, i.subscription, c.construction_event_id,
        s.event_id AS subscription_event_id
    FROM staging.located('raw.ros2_rclcpp_subscription_init') AS i
    ASOF LEFT JOIN construction AS c
        ON i.thread_id = c.thread_id AND i.event_id >= c.construction_event_id
    ASOF LEFT JOIN staging.subscription_known AS s
        ON i.process_id = s.process_id
        AND i.subscription_handle = s.subscription_handle
        AND i.event_id >= s.event_id
),
use AS (
    SELECT event_id, process_id, thread_id, subscription
    FROM staging.located('raw.ros2_rclcpp_subscription_callback_added')
    UNION ALL
    SELECT event_id, process_id, thread_id, subscription
    FROM staging.located('raw.ros2_rclcpp_ipb_to_subscription')
),
placed AS (
    SELECT u.event_id, u.process_id, u.thread_id, u.subscription, c.construction_event_id
    FROM use AS u
    ASOF LEFT JOIN construction AS c
        ON u.thread_id = c.thread_id AND u.event_id >= c.construction_event_id
),
same_construction AS (
    SELECT
        p.event_id,
        min(i.subscription_event_id) AS subscription_event_id
    FROM placed AS p
    JOIN initialised AS i
        ON p.thread_id = i.thread_id
        AND p.construction_event_id = i.construction_event_id
        AND p.subscription = i.subscription
    GROUP BY p.event_id
)
SELECT
    p.event_id,
    coalesce(
        s.subscription_event_id, e.subscription_event_id, l.subscription_event_id
    ) AS subscription_event_id
FROM placed AS p
LEFT JOIN same_construction AS s ON p.event_id = s.event_id
ASOF LEFT JOIN initialised AS e
    ON p.process_id = e.process_id
    AND p.subscription = e.subscription
    AND p.event_id >= e.event_id
ASOF LEFT JOIN initialised AS l
    ON p.process_id = l.process_id
    AND p.subscription = l.subscription
    AND p.event_id <= l.event_id
