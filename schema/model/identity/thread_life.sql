-- name: staging.thread_life
-- description: Threads within the life of their process: what turns the contexts of an event into
--     its thread and process.
-- grain: one row per thread of a process life
-- when: staging.thread_presence
WITH lived AS (
    SELECT
        p.thread_index, l.host_id, l.pid_ns, l.vpid, p.vtid, l.life, l.from_event_id,
        l.until_event_id, p.procname, p.first_event_id, p.last_event_id, p.first_seen_ns,
        p.last_seen_ns
    FROM staging.thread_presence AS p
    JOIN staging.process_life AS l
        ON p.host_id = l.host_id
        AND p.pid_ns IS NOT DISTINCT FROM l.pid_ns
        AND p.vpid = l.vpid
        AND p.last_event_id >= l.from_event_id
        AND p.first_event_id < l.until_event_id
),
-- A stretch that two lives share has to be looked at event by event.
divided AS (
    SELECT
        v.thread_index,
        v.life,
        min(e.event_id) AS first_event_id,
        max(e.event_id) AS last_event_id,
        min(e.ts_ns) AS first_seen_ns,
        max(e.ts_ns) AS last_seen_ns
    FROM lived AS v
    JOIN staging.event AS e
        ON v.thread_index = e.thread_index
        AND e.event_id >= v.first_event_id
        AND e.event_id <= v.last_event_id
        AND e.event_id >= v.from_event_id
        AND e.event_id < v.until_event_id
    WHERE v.first_event_id < v.from_event_id OR v.last_event_id >= v.until_event_id
    GROUP BY ALL
)
SELECT
    v.thread_index, v.host_id, v.pid_ns, v.vpid, v.life, v.from_event_id, v.until_event_id, v.vtid,
    arg_max(v.procname, v.last_event_id) AS name,
    min(coalesce(d.first_event_id, v.first_event_id)) AS first_event_id,
    max(coalesce(d.last_event_id, v.last_event_id)) AS last_event_id,
    min(coalesce(d.first_seen_ns, v.first_seen_ns)) AS first_seen_ns,
    max(coalesce(d.last_seen_ns, v.last_seen_ns)) AS last_seen_ns
FROM lived AS v
LEFT JOIN divided AS d
    ON v.thread_index = d.thread_index
    AND v.life = d.life
    AND (v.first_event_id < v.from_event_id OR v.last_event_id >= v.until_event_id)
WHERE d.life IS NOT NULL
    OR (v.first_event_id >= v.from_event_id AND v.last_event_id < v.until_event_id)
GROUP BY ALL
