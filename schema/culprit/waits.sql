-- title: Messages that wait, for what is not known
-- description: They are on the way, or their executor does not take them, although it runs nothing.
--     Where callbacks are known to keep them waiting ten times as long, these are the culprit; if
--     they wait too little to notice, as long.
-- grain: one row per topic and node that takes it
-- reads: application_path, blame, callback_use, noticed
-- next: query waits --by instance --slowest 5 --node {node}
SELECT
    9 AS place,
    b.waiting_node AS node,
    b.waiting_callback AS callback,
    u.function, b.path, b.topic_name,
    b.mean_ns AS harm_ns,
    b.p95_ns, b.lost, b.published,
    s.count,
    s.name = 'not_woken' AS is_supposed,
    CASE
        WHEN s.node IS NOT NULL THEN NULL
        WHEN b.waiting_callback IS NULL THEN 'callbacks'
        WHEN NOT ($has_kernel OR $has_usage) THEN 'samples'
    END AS lacks,
    [b.waiting_node || ' waits'] AS claims
FROM blame AS b
JOIN application_path AS a ON b.path = a.path
LEFT JOIN callback_use AS u ON b.waiting_node = u.node AND b.waiting_callback = u.callback
LEFT JOIN (
    SELECT
        n.full_name AS node,
        f.topic_name, f.name, f.count
    FROM main.finding AS f
    JOIN main.node AS n
        ON f.process_id = n.process_id AND coalesce(f.node_id = n.node_id, true)
    WHERE f.name IN ('busy_waiting', 'not_woken') AND list_contains($runs, f.run_id)
) AS s
    ON b.waiting_node = s.node AND coalesce(b.topic_name = s.topic_name, true)
CROSS JOIN noticed AS l
WHERE b.node IS NULL AND NOT b.is_cpu AND b.waiting_node IS NOT NULL
    AND b.mean_ns >= l.least_ns
    AND b.mean_ns > CASE WHEN b.p95_ns >= l.late_ns THEN l.of_path ELSE 1 END * (
        SELECT coalesce(sum(k.mean_ns), 0)
        FROM blame AS k
        WHERE k.node IS NOT NULL AND k.path = b.path AND k.topic_name = b.topic_name
            AND k.waiting_node = b.waiting_node
    )
    AND (
        b.p95_ns >= greatest(coalesce(u.limit_ns, l.late_ns), l.of_path * a.p95_ns)
        OR (b.lost >= l.lost AND b.lost >= l.of_messages * b.published)
    )
QUALIFY row_number() OVER (
    PARTITION BY b.waiting_node, b.topic_name ORDER BY b.mean_ns DESC, b.path, s.name DESC
) = 1
