-- description: Values of counters, as main.counter has them.
-- grain: one row per value
SELECT
    c.kind,
    c.object_id AS id,
    c.process_id,
    CASE
        WHEN c.kind = 'rate' THEN 'rate of ' || c.name
        WHEN c.kind = 'queue' THEN 'not yet taken of ' || c.name
        WHEN c.process_id IS NULL THEN printf('CPUs of %s (%s)', c.name, h.hostname)
        ELSE 'CPUs'
    END AS name,
    CASE c.kind WHEN 'rate' THEN 'Hz' WHEN 'queue' THEN 'messages' ELSE 'CPUs' END AS unit,
    c.at_ns, c.value
FROM main.counter([$run_id], $start_ns, $end_ns) AS c
JOIN main.host AS h ON c.host_id = h.host_id
ORDER BY c.kind, c.object_id, name, c.at_ns, c.place
