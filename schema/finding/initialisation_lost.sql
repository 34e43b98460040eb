-- name: finding.initialisation_lost
-- title: Events of initialisation were lost
-- description: Objects were used whose creation is not in the trace, and events of the time when
--     their process was created are missing. They are placeholders without a name or with one
--     deduced from messages, so that topics and nodes are missing in results.
-- cause: The buffers were full while the process started, which is when it records most; or packets
--     of that time are missing.
-- cure: Record with larger sub-buffers (see what was discarded), or in discard mode where packets
--     were overwritten; or record initialisation into a snapshot session that runs all the time,
--     and ingest both.
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
WHERE c.inferred > 0 AND p.process_id IN (SELECT process_id FROM derive.lossy_start)
GROUP BY p.run_id, p.process_id, p.name, p.pid, h.hostname
