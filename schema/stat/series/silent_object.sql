-- description: Callbacks and publishers that were busy, and that nothing is seen of any more,
--     though the recording goes on: for a second at least, and for ten times as long as it took
--     them from one time to the next. `what`: 'timer', 'topic', or 'callback' of anything else.
-- grain: one row per object
WITH object AS (
    SELECT
        c.run_id, c.process_id, c.node_id,
        CASE c.kind WHEN 'timer' THEN c.kind ELSE 'callback' END AS what,
        c.callback_id AS object_id,
        s.topic_name,
        min(i.start_ns) AS first_ns,
        max(i.start_ns) AS last_ns,
        count(*) AS number
    FROM store.callback_instance AS i
    JOIN store.callback AS c ON i.callback_id = c.callback_id
    LEFT JOIN store.subscription AS s ON c.subscription_id = s.subscription_id
    GROUP BY ALL
    UNION ALL
    SELECT
        p.run_id, p.process_id, p.node_id, 'topic', p.publisher_id, p.topic_name,
        min(b.start_ns),
        max(b.start_ns),
        count(*)
    FROM store.publication AS b
    JOIN store.publisher AS p ON b.publisher_id = p.publisher_id
    WHERE NOT p.is_internal
    GROUP BY ALL
)
SELECT o.run_id, o.process_id, o.node_id, o.what, o.object_id, o.topic_name, o.last_ns
FROM object AS o
JOIN store.process AS p ON o.process_id = p.process_id
QUALIFY o.number > 10
    AND max(p.last_seen_ns) OVER (PARTITION BY o.run_id, p.host_id) - o.last_ns
        > greatest(10 * (o.last_ns - o.first_ns) / (o.number - 1), 1_000_000_000)
