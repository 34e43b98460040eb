-- title: How busy the processes of nodes are
-- description: From samples of the system.
-- grain: one row per node
-- when: main.program_usage
-- reads: callback_name
-- column: node VARCHAR  Node
-- column: is_python BOOLEAN  Its process is of Python, whose threads compute one after the other
-- column: cpus DOUBLE  CPUs that its process used, on average
-- column: own_cpus DOUBLE  Part of it: the threads of its callbacks
WITH used AS (
    SELECT
        process_id,
        sum(cpu_ns) / (max(end_ns) - min(start_ns)) AS cpus
    FROM main.program_usage
    WHERE list_contains($runs, run_id) AND process_id IS NOT NULL
    GROUP BY process_id
),
own AS (
    SELECT
        t.process_id,
        sum(u.running_ns) / (max(u.end_ns) - min(u.start_ns)) AS cpus
    FROM main.thread_usage AS u
    JOIN main.thread AS t ON u.thread_id = t.thread_id
    WHERE list_contains($runs, u.run_id)
        AND u.thread_id IN (
            SELECT thread_id FROM main.callback_instance WHERE list_contains($runs, run_id)
        )
    GROUP BY t.process_id
)
SELECT
    n.node,
    bool_or(p.python_version IS NOT NULL) AS is_python,
    max(u.cpus) AS cpus,
    coalesce(max(o.cpus), 0) AS own_cpus
FROM (SELECT DISTINCT node, process_id FROM callback_name) AS n
JOIN main.process AS p ON n.process_id = p.process_id
JOIN used AS u ON n.process_id = u.process_id
LEFT JOIN own AS o ON n.process_id = o.process_id
GROUP BY n.node
