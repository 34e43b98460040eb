-- kind: inline
-- title: Traces of processes
-- description: Where a recording would have the events of a process.
-- grain: one row per process
SELECT
    p.process_id,
    min(t.trace_id) AS trace_id
FROM main.process AS p
JOIN main.trace AS t ON p.host_id = t.host_id
WHERE p.run_id = $run_id AND t.run_id = $run_id AND t.domain IS DISTINCT FROM 'kernel'
GROUP BY p.process_id
