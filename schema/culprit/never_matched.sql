-- title: A publisher and a subscription that never met
-- description: Both were there, and the node of the subscription ran callbacks, but it took no
--     message. If their processes had other messages of each other, they are in one domain.
-- grain: one row per topic, publishing node and subscribing node
-- reads: application_path, callback_use, named_path, node_restart, noticed
-- next: check
SELECT
    0 AS place,
    n.full_name AS node,
    f.topic_name,
    r.length_ns // 2 AS harm_ns,
    r.length_ns AS p95_ns,
    f.count AS lost,
    f.count AS published,
    p.full_name AS other,
    EXISTS (
        FROM main.link_transport AS l
        JOIN main.publication AS b ON l.publication_id = b.publication_id
        JOIN main.take AS t ON l.take_id = t.take_id
        WHERE b.process_id IN (n.process_id, p.process_id)
            AND t.process_id IN (n.process_id, p.process_id)
            AND b.process_id <> t.process_id
    ) AS is_supposed,
    [n.full_name || f.topic_name] AS claims
FROM main.finding AS f
JOIN main.node AS n ON f.node_id = n.node_id
LEFT JOIN main.node AS p ON f.publishing_node_id = p.node_id
CROSS JOIN (SELECT max(length_ns) AS length_ns FROM application_path) AS r
CROSS JOIN noticed AS l
WHERE list_contains($runs, f.run_id) AND f.name = 'never_taken' AND f.count >= 3 * l.lost
    AND n.full_name IN (SELECT node FROM callback_use)
    AND n.full_name NOT IN (SELECT node FROM node_restart)
    -- Neither plumbing.
    AND f.topic_name NOT IN (
        SELECT name
        FROM (
            SELECT unnest(topics) AS name
            FROM named_path
            WHERE path NOT IN (SELECT path FROM application_path)
        )
        WHERE name IS NOT NULL
    )
