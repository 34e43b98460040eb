-- kind: inline
-- description: The tracks of processes. Two processes (of two hosts, or lives) may have one pid;
--     Perfetto would take them for one.
-- grain: one row per process
SELECT
    p.process_id * 8 + 1 AS track,
    CASE WHEN count(*) OVER (PARTITION BY p.pid) = 1 THEN p.pid
        ELSE 1000000000 + row_number() OVER (ORDER BY p.process_id) END AS pid,
    printf('%s %d on %s', coalesce(p.name, '?'), p.pid, h.hostname) AS name
FROM main.process AS p
JOIN main.host AS h ON p.host_id = h.host_id
WHERE p.run_id = $run_id
ORDER BY track
