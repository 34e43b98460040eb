-- name: check.link_stays_in_run
-- description: Nothing is linked across runs.
-- grain: one row per link between two runs
-- severity: error
-- needs: store.link_transport, store.link_causal, store.publication, store.take,
--     store.callback_instance
SELECT l.run_id, 'transport' AS kind, l.publication_id
FROM store.link_transport AS l
JOIN store.publication AS b ON l.publication_id = b.publication_id
JOIN store.take AS t ON l.take_id = t.take_id
WHERE b.run_id <> l.run_id OR t.run_id <> l.run_id
UNION ALL
SELECT l.run_id, 'causal', l.publication_id
FROM store.link_causal AS l
JOIN store.publication AS b ON l.publication_id = b.publication_id
JOIN store.callback_instance AS i ON l.callback_instance_id = i.callback_instance_id
WHERE b.run_id <> l.run_id OR i.run_id <> l.run_id
