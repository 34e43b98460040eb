-- description: Threads within the life of their process. An event is of the thread and process of
--     the row that has its thread index, and in whose stretch of event ids it lies.
-- grain: one row per thread of a process life
-- when: staging.thread_presence
WITH start AS (
    SELECT host_id, pid_ns, vpid, -9223372036854775807 AS from_event_id
    FROM staging.thread_presence
    GROUP BY ALL
    UNION ALL
    SELECT host_id, pid_ns, vpid, event_id FROM staging.process_restart
),
life AS (
    SELECT
        host_id, pid_ns, vpid, from_event_id,
        row_number() OVER of_pid AS life,
        lead(from_event_id, 1, 9223372036854775807) OVER of_pid AS until_event_id
    FROM start
    WINDOW of_pid AS (PARTITION BY host_id, pid_ns, vpid ORDER BY from_event_id)
),
lived AS (
    SELECT
        p.thread_index, l.host_id, l.pid_ns, l.vpid, p.vtid, l.life, l.from_event_id,
        l.until_event_id, p.procname, p.first_event_id, p.last_event_id, p.first_seen_ns,
        p.last_seen_ns
    FROM staging.thread_presence AS p
    JOIN life AS l
        ON p.host_id = l.host_id
        AND p.pid_ns IS NOT DISTINCT FROM l.pid_ns
        AND p.vpid = l.vpid
        AND p.last_event_id >= l.from_event_id
        AND p.first_event_id < l.until_event_id
),
-- A stretch that two lives share has to be looked at event by event.
divided AS (
    SELECT
        v.thread_index, v.life,
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
),
thread AS (
    SELECT
        v.thread_index, v.host_id, v.pid_ns, v.vpid, v.life, v.from_event_id, v.until_event_id,
        v.vtid,
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
),
of_process AS (
    SELECT
        *,
        min(first_event_id) OVER (PARTITION BY host_id, pid_ns, vpid, life)
            AS process_first_event_id
    FROM thread
)
SELECT
    * EXCLUDE (process_first_event_id),
    row_number() OVER (ORDER BY first_event_id) AS thread_id,
    dense_rank() OVER (ORDER BY process_first_event_id) AS process_id
FROM of_process
