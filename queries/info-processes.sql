-- title: Processes
-- description: The processes of a run with the number of their threads and nodes.
-- grain: one row per process life
-- column: run_id
-- column: hostname VARCHAR [host]  Host it ran on
-- column: pid
-- column: process_name VARCHAR              Name of the process
-- column: tracetools_version VARCHAR        Version of tracetools it was built with
-- column: python_version VARCHAR            Python, where callbacks of its nodes are traced
-- column: node_count BIGINT                 ROS nodes in it
-- column: thread_count BIGINT               Threads seen
-- column: first_seen_ns BIGINT [epoch ns]   First event
-- column: duration_ns BIGINT [ns]           From its first event to its last
-- brief: process_name, pid, hostname, node_count, thread_count, duration_ns, tracetools_version,
--     python_version, first_seen_ns
SELECT
    process.run_id, host.hostname, process.pid,
    process.name AS process_name,
    process.tracetools_version, process.python_version,
    (SELECT count(*) FROM main.node WHERE node.process_id = process.process_id) AS node_count,
    (SELECT count(*) FROM main.thread WHERE thread.process_id = process.process_id) AS thread_count,
    process.first_seen_ns,
    process.last_seen_ns - process.first_seen_ns AS duration_ns
FROM main.process
JOIN main.host ON host.host_id = process.host_id
WHERE list_contains($runs, process.run_id)
ORDER BY process.run_id, host.hostname, process.pid, process.process_id
