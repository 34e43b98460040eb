-- title: What may be missing behind paths
-- description: Findings of dead ends, of those nodes and topics at which one of the paths ends.
-- grain: one row per node and topic
-- param: paths VARCHAR[]  The paths
SELECT f.detail
FROM main.finding AS f
JOIN main.node AS n ON f.node_id = n.node_id
WHERE list_contains($runs, f.run_id)
    AND f.name = 'dead_end'
    AND len(list_filter(
        $paths, lambda path: ends_with(path, printf(' → %s → %s', f.topic_name, n.full_name))
    )) > 0
ORDER BY f.node_id, f.topic_name
