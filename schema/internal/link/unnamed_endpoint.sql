-- description: Those whose topic the trace does not name, with what messages tell about it.
-- grain: one row per publisher or subscription
SELECT
    e.kind, e.id, e.handle, e.topic_name,
    coalesce(g.group_id, e.vertex) AS group_id,
    e.process_name AS process,
    e.pid,
    e.hostname AS host
FROM derive.unnamed_endpoint($run_id) AS e
LEFT JOIN derive.topic_group($run_id) AS g ON e.kind = g.kind AND e.id = g.id
ORDER BY e.kind, e.id
