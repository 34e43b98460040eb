-- title: A process that fell silent
-- description: The process has no event in the last half second of the recording or longer, though
--     messages were sent to it meanwhile, and its middleware did not say goodbye, as it does when
--     ROS is shut down. These messages count as not delivered (subscription_ended), or wait where
--     it did not come back from a callback (reader_in_callback). Processes whose middleware does
--     not say in the trace what it has (ros_discovery_info) are not looked at.
-- cause: It was killed (SIGKILL, out of memory), crashed, hangs, or is busy in a callback.
-- cure: See its output, and dmesg. Callbacks without an end show what it did last.
-- grain: one row per process
-- severity: warning
-- when: store.undelivered WHERE reason = 'subscription_ended' OR reason = 'reader_in_callback'
WITH missed AS (
    SELECT
        s.process_id,
        count(DISTINCT u.publication_id) AS number
    FROM store.undelivered AS u
    JOIN store.subscription AS s ON u.subscription_id = s.subscription_id
    WHERE u.reason IN ('subscription_ended', 'reader_in_callback') AND NOT s.is_internal
    GROUP BY s.process_id
),
-- What the middleware publishes for itself.
announced AS (
    SELECT
        process_id,
        max(end_ns) AS last_ns
    FROM store.publication
    WHERE publisher_id IS NULL AND rclcpp_ns IS NULL AND rcl_ns IS NULL AND rmw_ns IS NOT NULL
    GROUP BY process_id
),
host_end AS (
    SELECT
        host_id,
        max(last_seen_ns) AS end_ns
    FROM store.process
    GROUP BY host_id
)
SELECT
    p.run_id, p.process_id,
    m.number AS count,
    printf(
        'silent for the last %.3f s, in which %s came',
        (e.end_ns - p.last_seen_ns) / 1e9, derive.counted(m.number, 'message')
    ) AS detail
FROM missed AS m
JOIN announced AS a ON m.process_id = a.process_id
-- As recorded: a correction of the clocks moves the times of main.process alone.
JOIN store.process AS p ON m.process_id = p.process_id
JOIN host_end AS e ON p.host_id = e.host_id
-- LTTng stops one stream after the other, which takes 0.2 s at most.
WHERE e.end_ns - p.last_seen_ns > 500_000_000
    -- Real processes had no other event more than 4 ms after their goodbye; CPUs may be busy.
    AND p.last_seen_ns - a.last_ns > 100_000_000
