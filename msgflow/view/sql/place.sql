-- description: The run that a publication, take, callback instance, request or response is in.
-- grain: one row, none for an identity that nothing has
-- param: kind, id
-- column: run_id
SELECT run_id FROM main.publication WHERE $kind = 'publication' AND publication_id = $id
UNION ALL
SELECT run_id FROM main.take WHERE $kind = 'take' AND take_id = $id
UNION ALL
SELECT run_id
FROM main.callback_instance
WHERE $kind = 'callback_instance' AND callback_instance_id = $id
UNION ALL
SELECT run_id FROM main.request WHERE $kind = 'request' AND request_id = $id
UNION ALL
SELECT run_id FROM main.response WHERE $kind = 'response' AND response_id = $id ORDER BY run_id
