-- title: Quotas of CPU time that hold nodes up
-- description: From samples of the system.
-- grain: one row per node, the quota alone that holds it up longest
-- when: main.quota_usage
-- reads: callback_name
-- column: node VARCHAR  Node
-- column: quota VARCHAR  Its cgroup
-- column: cpus DOUBLE  CPUs that it may use
-- column: throttled_count BIGINT  How often it had to stop
-- column: throttled_ns BIGINT [ns]  For how long
SELECT
    n.node,
    q.name AS quota,
    any_value(q.cpus) AS cpus,
    sum(q.throttled_count)::BIGINT AS throttled_count,
    sum(q.throttled_ns)::BIGINT AS throttled_ns
FROM (SELECT DISTINCT node, process_id FROM callback_name) AS n
JOIN main.quota_usage AS q ON n.process_id = q.process_id
WHERE list_contains($runs, q.run_id) AND q.start_ns >= $start_ns AND q.start_ns < $end_ns
GROUP BY n.node, q.name
QUALIFY row_number() OVER (PARTITION BY n.node ORDER BY sum(q.throttled_ns) DESC, q.name) = 1
