-- description: Processes, with their hosts: those of two hosts may have one pid.
-- grain: one row per process
SELECT
    p.process_id, p.pid,
    printf('%s %d on %s', coalesce(p.name, '?'), p.pid, h.hostname) AS name
FROM main.process AS p
JOIN main.host AS h ON p.host_id = h.host_id
WHERE p.run_id = $run_id
ORDER BY p.process_id
