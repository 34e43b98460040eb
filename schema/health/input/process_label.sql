-- kind: inline
-- description: How processes are named in details.
-- grain: one row per process
SELECT
    p.process_id, p.life,
    printf('%s %d on %s', coalesce(p.name, '?'), p.pid, h.hostname) AS label
FROM staging.process AS p
JOIN staging.host AS h ON p.host_id = h.host_id
