-- name: finding.started_late
-- title: Tracing started after ROS
-- description: Objects were used whose creation is not in the trace. They are placeholders without
--     a name or with one deduced from messages, so that topics and nodes are missing in results.
--     Those of ROS itself do not count: /rosout is published on handles never initialised. Nor do
--     processes whose events of initialisation may have been lost (initialisation_lost).
-- cause: The session was started after the nodes, or the events of initialisation were not enabled.
-- cure: Start the session first: ros2 trace, or the Trace action at the head of the launch file; or
--     record initialisation into a snapshot session that runs all the time, and ingest both.
-- grain: one row per process
-- severity: warning
-- needs: main.node, main.publisher, main.subscription, main.timer, main.service, main.client,
--     main.callback, main.process, main.host, derive.lossy_start
WITH object AS (
    SELECT process_id, 'nodes' AS kind, is_inferred FROM main.node
    UNION ALL
    SELECT process_id, 'publishers', is_inferred FROM main.publisher WHERE NOT is_internal
    UNION ALL
    SELECT process_id, 'subscriptions', is_inferred FROM main.subscription WHERE NOT is_internal
    UNION ALL
    SELECT process_id, 'timers', is_inferred FROM main.timer
    UNION ALL
    SELECT process_id, 'services', is_inferred FROM main.service
    UNION ALL
    SELECT process_id, 'clients', is_inferred FROM main.client
    UNION ALL
    SELECT process_id, 'callbacks', created_ns IS NULL FROM main.callback
),
counted AS (
    SELECT process_id, kind, sum(is_inferred::BIGINT)::BIGINT AS inferred, count(*) AS number
    FROM object
    GROUP BY process_id, kind
)
SELECT
    p.run_id,
    printf('%s %d on %s', coalesce(p.name, '?'), p.pid, h.hostname) AS subject,
    sum(c.inferred)::BIGINT AS count,
    'not seen to be created: '
    || string_agg(printf('%d of %d %s', c.inferred, c.number, c.kind), ', ' ORDER BY c.kind)
        AS detail
FROM counted AS c
JOIN main.process AS p ON c.process_id = p.process_id
JOIN main.host AS h ON p.host_id = h.host_id
WHERE c.inferred > 0 AND p.process_id NOT IN (SELECT process_id FROM derive.lossy_start)
GROUP BY p.run_id, p.process_id, p.name, p.pid, h.hostname
