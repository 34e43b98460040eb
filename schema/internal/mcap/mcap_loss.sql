-- description: Messages that a subscription did not get, though it was connected.
-- grain: one row per publication and subscription that did not get it
SELECT
    b.start_ns AS at_ns,
    main.node_label(n.full_name, o.name, o.pid) AS node,
    concat(
        coalesce(s.topic_name, '?'), ' was ', d.status, ' (', d.reason,
        '): publication ', d.publication_id, ', msgflow flow --publication ', d.publication_id
    ) AS message
FROM main.stat_delivery AS d
JOIN main.publication AS b ON d.publication_id = b.publication_id
JOIN main.subscription AS s ON d.subscription_id = s.subscription_id
JOIN main.process AS o ON s.process_id = o.process_id
LEFT JOIN main.node AS n ON s.node_id = n.node_id
WHERE list_contains($runs, d.run_id) AND d.status IN ('dropped', 'lost')
    AND NOT coalesce(s.is_internal, false)
    AND b.start_ns >= $start_ns AND b.start_ns < $end_ns
ORDER BY at_ns, node, message
