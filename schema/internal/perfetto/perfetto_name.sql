-- kind: inline
-- description: Names of slices. A slice refers to its name by code and id; id 0 is what is not
--     known. Calls that a callback waited for have the name of their service; where the trace has
--     no such service, each client has its own.
-- grain: one row per name
SELECT 0 AS code, callback_id AS id, node || ' ' || label AS name
FROM main.callback_label
WHERE run_id = $run_id
UNION ALL
SELECT 1, publisher_id, 'publish ' || coalesce(topic_name, '?')
FROM main.publisher
WHERE run_id = $run_id
UNION ALL
SELECT 2, subscription_id, 'take ' || coalesce(topic_name, '?')
FROM main.subscription
WHERE run_id = $run_id
UNION ALL
SELECT 3, 3 * client_id, 'request ' || coalesce(service_name, '?')
FROM main.client
WHERE run_id = $run_id
UNION ALL
SELECT
    3, coalesce(3 * w.service_id + 1, 3 * coalesce(q.client_id, 0) + 2) AS called_id,
    min(printf('service %s (%s)', w.service_name, coalesce(w.server, '?')))
FROM main.waited_call AS w
JOIN main.request AS q ON w.request_id = q.request_id
WHERE w.run_id = $run_id
GROUP BY called_id
UNION ALL
SELECT 4, service_id, 'take request ' || coalesce(service_name, '?')
FROM main.service
WHERE run_id = $run_id
UNION ALL
SELECT 5, service_id, 'respond ' || coalesce(service_name, '?')
FROM main.service
WHERE run_id = $run_id
UNION ALL
SELECT 6, client_id, 'take response ' || coalesce(service_name, '?')
FROM main.client
WHERE run_id = $run_id
UNION ALL
SELECT code, 0, name
FROM (VALUES (0, 'callback'), (1, 'publish ?'), (2, 'take ?'), (3, 'request ?'),
    (4, 'take request ?'), (5, 'respond ?'), (6, 'take response ?')) AS unknown (code, name)
UNION ALL
SELECT 7, id, name
FROM (VALUES (1, 'wait'), (2, 'select'), (3, 'take'), (4, 'callback'), (5, 'service'),
    (6, 'blocked')) AS activity (id, name)
ORDER BY code, id
