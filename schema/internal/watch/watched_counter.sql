-- description: Counters of a part of a recording that is watched (main.counter_bin), by the names
--     that metrics have.
-- grain: one row per kind, node and topic, or host and program
SELECT
    c.kind,
    CASE
        WHEN c.kind = 'cpu' THEN h.hostname
        ELSE main.node_label(n.full_name, p.name, p.pid)
    END AS owner,
    c.name,
    CASE WHEN c.kind = 'queue' THEN max(c.value) ELSE sum(c.value) END AS value
FROM main.counter_bin($runs, $start_ns, $end_ns, $end_ns - $start_ns) AS c
JOIN main.host AS h ON c.host_id = h.host_id
LEFT JOIN main.process AS p ON c.process_id = p.process_id
LEFT JOIN main.publisher AS b ON c.kind = 'rate' AND c.object_id = b.publisher_id
LEFT JOIN main.subscription AS s ON c.kind = 'queue' AND c.object_id = s.subscription_id
LEFT JOIN main.node AS n ON coalesce(b.node_id, s.node_id) = n.node_id
WHERE NOT coalesce(b.is_internal, s.is_internal, false)
GROUP BY c.kind, owner, c.name
ORDER BY c.kind, owner, c.name
