-- name: staging.process_life
-- description: Lives of each pid.
-- grain: one row per host, PID namespace, pid and life
-- when: staging.thread_presence
WITH start AS (
    SELECT host_id, pid_ns, vpid, -9223372036854775807 AS from_event_id
    FROM staging.thread_presence
    GROUP BY ALL
    UNION ALL
    SELECT host_id, pid_ns, vpid, event_id FROM staging.process_restart
)
SELECT
    host_id,
    pid_ns,
    vpid,
    row_number() OVER life AS life,
    from_event_id,
    lead(from_event_id, 1, 9223372036854775807) OVER life AS until_event_id
FROM start
WINDOW life AS (PARTITION BY host_id, pid_ns, vpid ORDER BY from_event_id)
