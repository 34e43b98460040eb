-- description: When each message could be received at the earliest, on the clock of those who
--     subscribe to its topic: at the end of its publication. A message that goes through a ring
--     buffer counts from `rclcpp_intra_publish` on, since it may be taken before publish() returns.
--     That is shifted to another clock where messages tell how far the two are apart, else by the
--     correction of both clocks (NULL: nothing tells). Agnocast's topics are others, and end at
--     the kernel.
-- grain: one row per publication on a topic with a subscription, and clock of its subscriptions
WITH audience AS (
    SELECT DISTINCT
        s.run_id,
        derive.own_topic(s.topic_name, s.is_agnocast, c.clock_id) AS topic_name,
        c.clock_id
    FROM store.subscription AS s
    JOIN derive.process_clock AS c ON s.process_id = c.process_id
    WHERE s.topic_name IS NOT NULL
),
sent AS (
    SELECT
        b.run_id, b.publication_id, b.publisher_id, a.topic_name, b.intra_ns, b.end_ns,
        b.source_timestamp_ns,
        f.clock_id AS from_clock_id,
        a.clock_id
    FROM store.publication AS b
    JOIN store.publisher AS p ON b.publisher_id = p.publisher_id
    JOIN derive.process_clock AS f ON p.process_id = f.process_id
    JOIN audience AS a
        ON p.run_id = a.run_id
        AND derive.own_topic(p.topic_name, p.is_agnocast, f.clock_id) = a.topic_name
)
SELECT
    run_id, publication_id, publisher_id, topic_name, source_timestamp_ns, clock_id,
    coalesce(intra_ns, end_ns) AS arrival_ns,
    true AS has_one_clock
FROM sent
WHERE from_clock_id = clock_id
UNION ALL
SELECT
    s.run_id, s.publication_id, s.publisher_id, s.topic_name, s.source_timestamp_ns, s.clock_id,
    coalesce(
        s.end_ns + c.shift_ns,
        CASE
            WHEN f.reference_clock_id = o.reference_clock_id
                THEN derive.recorded_ns(derive.corrected_ns(s.end_ns, f), o)
        END
    ),
    false
FROM (SELECT * FROM sent WHERE from_clock_id <> clock_id) AS s
ASOF LEFT JOIN derive.clock_shift AS c
    ON s.run_id = c.run_id
    AND s.from_clock_id = c.from_clock_id
    AND s.clock_id = c.to_clock_id
    AND s.end_ns >= c.from_ns
JOIN store.clock AS f ON s.from_clock_id = f.clock_id
JOIN store.clock AS o ON s.clock_id = o.clock_id
