-- description: Nodes, and the executors that ran their callbacks.
-- grain: one row per node and executor that ran a callback of it
-- column: node VARCHAR  Full name of the node, or its process in brackets
-- column: host
-- column: process VARCHAR  Name of the process and its pid
-- column: executor_id
-- column: executor_kind VARCHAR  Its kind
-- column: threads BIGINT  Threads that it has
WITH ran AS (
    SELECT DISTINCT callback_id, thread_id FROM main.callback_instance WHERE run_id = $run
),
member AS (
    SELECT
        thread_id,
        min(executor_id) AS executor_id
    FROM main.executor_thread
    WHERE run_id = $run
    GROUP BY thread_id
)
SELECT
    l.node,
    h.hostname AS host,
    printf('%s %d', coalesce(p.name, '?'), p.pid) AS process,
    e.executor_id,
    e.kind AS executor_kind,
    (SELECT count(*) FROM main.executor_thread AS x WHERE x.executor_id = e.executor_id)
        AS threads
FROM ran AS r
JOIN member AS m ON r.thread_id = m.thread_id
JOIN main.executor AS e ON m.executor_id = e.executor_id
JOIN main.callback_label AS l ON r.callback_id = l.callback_id
JOIN main.process AS p ON e.process_id = p.process_id
JOIN main.host AS h ON p.host_id = h.host_id
GROUP BY l.node, h.hostname, p.name, p.pid, e.executor_id, e.kind
ORDER BY h.hostname, p.pid, e.executor_id, l.node
