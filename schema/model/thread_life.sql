-- name: staging.thread_life
-- description: Threads within the life of their process: what turns the contexts of an event into
--     its thread and process.
-- grain: one row per thread of a process life
-- needs: staging.thread_presence, staging.process_life, staging.event, staging.trace
WITH whole AS (
    SELECT
        l.host_id,
        l.pid_ns,
        l.vpid,
        l.life,
        l.from_event_id,
        l.until_event_id,
        p.vtid,
        arg_max(p.procname, p.last_event_id) AS name,
        min(p.first_event_id) AS first_event_id,
        max(p.last_event_id) AS last_event_id,
        min(p.first_seen_ns) AS first_seen_ns,
        max(p.last_seen_ns) AS last_seen_ns
    FROM staging.process_life AS l
    JOIN staging.thread_presence AS p
        ON l.host_id = p.host_id
        AND l.pid_ns IS NOT DISTINCT FROM p.pid_ns
        AND l.vpid = p.vpid
    GROUP BY ALL
),
is_split AS (
    SELECT host_id, pid_ns, vpid
    FROM staging.process_life
    WHERE life > 1
    GROUP BY ALL
),
divided AS (
    SELECT
        l.host_id,
        l.pid_ns,
        l.vpid,
        l.life,
        l.from_event_id,
        l.until_event_id,
        e.vtid,
        arg_max(e.procname, e.event_id) AS name,
        min(e.event_id) AS first_event_id,
        max(e.event_id) AS last_event_id,
        min(e.ts_ns) AS first_seen_ns,
        max(e.ts_ns) AS last_seen_ns
    FROM staging.event AS e
    JOIN staging.trace AS t ON e.trace_index + 1 = t.trace_id
    JOIN is_split AS s
        ON t.host_id = s.host_id
        AND e.pid_ns IS NOT DISTINCT FROM s.pid_ns
        AND e.vpid = s.vpid
    JOIN staging.process_life AS l
        ON t.host_id = l.host_id
        AND e.pid_ns IS NOT DISTINCT FROM l.pid_ns
        AND e.vpid = l.vpid
        AND e.event_id >= l.from_event_id
        AND e.event_id < l.until_event_id
    GROUP BY ALL
)
SELECT
    w.host_id, w.pid_ns, w.vpid, w.life, w.from_event_id, w.until_event_id, w.vtid, w.name,
    w.first_event_id, w.last_event_id, w.first_seen_ns, w.last_seen_ns
FROM whole AS w
ANTI JOIN is_split AS s
    ON w.host_id = s.host_id
    AND w.pid_ns IS NOT DISTINCT FROM s.pid_ns
    AND w.vpid = s.vpid
UNION ALL
SELECT
    host_id, pid_ns, vpid, life, from_event_id, until_event_id, vtid, name,
    first_event_id, last_event_id, first_seen_ns, last_seen_ns
FROM divided
