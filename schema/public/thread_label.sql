-- description: What people call a thread: the nodes of its process, and its own name where it
--     differs from that of the process, as for threads of the middleware.
-- grain: one row per thread
-- column: run_id, thread_id
-- column: label VARCHAR     Nodes of its process (main.process_label), and its name; without nodes
--     its name
SELECT
    t.run_id, t.thread_id,
    CASE
        WHEN l.nodes LIKE '/%' THEN l.nodes || coalesce(' ' || nullif(t.name, p.name), '')
        ELSE coalesce(t.name, '?')
    END AS label
FROM main.thread AS t
JOIN main.process AS p ON t.process_id = p.process_id
JOIN main.process_label AS l ON t.process_id = l.process_id
