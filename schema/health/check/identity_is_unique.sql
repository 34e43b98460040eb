-- name: check.identity_is_unique
-- description: Publications, takes, callback instances, requests and responses have an identity of
--     their own.
-- grain: one row per identity used twice
-- severity: error
SELECT run_id, 'publication' AS kind, publication_id AS id
FROM store.publication
GROUP BY run_id, publication_id
HAVING count(*) > 1
UNION ALL
SELECT run_id, 'take', take_id
FROM store.take
GROUP BY run_id, take_id
HAVING count(*) > 1
UNION ALL
SELECT run_id, 'callback_instance', callback_instance_id
FROM store.callback_instance
GROUP BY run_id, callback_instance_id
HAVING count(*) > 1
UNION ALL
SELECT run_id, 'request', request_id
FROM store.request
GROUP BY run_id, request_id
HAVING count(*) > 1
UNION ALL
SELECT run_id, 'response', response_id
FROM store.response
GROUP BY run_id, response_id
HAVING count(*) > 1
