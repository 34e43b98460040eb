-- title: Nodes that ended and began again
-- description: A node of the same name in another process, which began after the first one had
--     ended; and the messages that came meanwhile.
-- grain: one row per node, of several times the longest
-- param: asked_ns BIGINT  Begin of what was asked for: with the warm-up, which start_ns leaves out
-- column: node VARCHAR  Node
-- column: gap_ns BIGINT [ns]  From the last event of its process until its next callback ran, or
--     else until it was created again
-- column: begun_ns BIGINT [epoch ns]  When it ran again
-- column: topic_name VARCHAR  The topic that it missed most on; NULL: it misses none
-- column: lost BIGINT  Messages on that topic meanwhile
-- column: published BIGINT  All messages on it
WITH life AS (
    SELECT
        n.full_name AS node,
        n.node_id, n.created_ns, p.last_seen_ns,
        lead(n.created_ns) OVER in_time AS next_created_ns,
        lead(n.node_id) OVER in_time AS next_id
    FROM main.node AS n
    JOIN main.process AS p ON n.process_id = p.process_id
    WHERE list_contains($runs, n.run_id)
    WINDOW in_time AS (PARTITION BY p.host_id, n.full_name ORDER BY n.created_ns)
),
gap AS (
    SELECT
        l.node, l.next_id,
        l.last_seen_ns AS ended_ns,
        coalesce(min(i.start_ns), any_value(l.next_created_ns)) AS begun_ns
    FROM life AS l
    LEFT JOIN main.callback AS c ON l.next_id = c.node_id
    LEFT JOIN main.callback_instance AS i ON c.callback_id = i.callback_id
    WHERE l.next_created_ns > l.last_seen_ns
        AND l.last_seen_ns < $end_ns AND l.next_created_ns >= $asked_ns
    GROUP BY l.node, l.next_id, l.last_seen_ns
),
missed AS (
    SELECT
        g.node, g.ended_ns, s.topic_name,
        count(DISTINCT b.publication_id) FILTER (
            WHERE b.start_ns BETWEEN g.ended_ns AND g.begun_ns
        ) AS lost,
        count(DISTINCT b.publication_id) AS published
    FROM gap AS g
    JOIN main.subscription AS s ON g.next_id = s.node_id
    JOIN main.publisher AS p ON s.run_id = p.run_id AND s.topic_name = p.topic_name
    JOIN main.publication AS b ON p.publisher_id = b.publisher_id
    WHERE NOT s.is_internal
    GROUP BY g.node, g.ended_ns, s.topic_name
    HAVING count(*) FILTER (WHERE b.start_ns BETWEEN g.ended_ns AND g.begun_ns) > 0
)
SELECT
    g.node,
    g.begun_ns - g.ended_ns AS gap_ns,
    g.begun_ns, m.topic_name, m.lost, m.published
FROM gap AS g
LEFT JOIN missed AS m ON g.node = m.node AND g.ended_ns = m.ended_ns
QUALIFY row_number() OVER (
    PARTITION BY g.node ORDER BY g.begun_ns - g.ended_ns DESC, m.lost DESC, m.topic_name
) = 1
