-- title: Publishers and subscriptions that a file of links can name
-- description: Those whose topic the trace does not name, with what messages tell about it.
-- grain: one row per publisher or subscription
-- column: kind VARCHAR  'publisher' or 'subscription'
-- column: id BIGINT  Its identity
-- column: handle UBIGINT  Its handle
-- column: topic_name VARCHAR  Topic that messages tell; NULL: they tell none
-- column: group_id BIGINT  Messages join all of a group
-- column: process VARCHAR  Name of its process
-- column: pid INTEGER  Id of its process
-- column: host VARCHAR  Its host
SELECT
    e.kind, e.id, e.handle, e.topic_name, coalesce(g.group_id, e.vertex) AS group_id,
    e.process_name AS process, e.pid, e.hostname AS host
FROM derive.unnamed_endpoint($run_id) AS e
LEFT JOIN derive.topic_group($run_id) AS g ON e.kind = g.kind AND e.id = g.id
ORDER BY e.kind, e.id
