-- name: check.identity_is_unique
-- description: Publications, takes and runs of callbacks have an identity of their own.
-- grain: one row per identity used twice
-- severity: error
-- needs: store.publication, store.take, store.callback_instance
SELECT 'publication' AS kind, publication_id AS id
FROM store.publication
GROUP BY publication_id
HAVING count(*) > 1
UNION ALL
SELECT 'take', take_id FROM store.take GROUP BY take_id HAVING count(*) > 1
UNION ALL
SELECT 'callback_instance', callback_instance_id
FROM store.callback_instance
GROUP BY callback_instance_id
HAVING count(*) > 1
