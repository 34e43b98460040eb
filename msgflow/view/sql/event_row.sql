-- description: Rows of the timeline for events of the user's own tracepoints: one for each name, of
--     the node in whose callbacks they happened, else of the process.
-- grain: one row per row of the timeline
-- kind: inline
-- column: run_id
-- column: row_key BIGINT  Identity of the row: -4 times that of its first event, as in row
-- column: process_id BIGINT  Identity of the process
-- column: node_id BIGINT  Identity of the node; NULL: none, or not known
-- column: name VARCHAR  Provider and event
SELECT
    u.run_id,
    -4 * min(u.user_event_id) AS row_key,
    u.process_id, c.node_id, u.name
FROM main.user_event AS u
LEFT JOIN main.callback_instance AS i ON u.callback_instance_id = i.callback_instance_id
LEFT JOIN main.callback AS c ON i.callback_id = c.callback_id
GROUP BY u.run_id, u.process_id, c.node_id, u.name
