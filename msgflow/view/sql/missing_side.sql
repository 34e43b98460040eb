-- description: Messages that a subscription did not take, and takes whose publication is not known.
-- grain: one row per publication and subscription without a take, or take without a publication
-- kind: inline
-- column: run_id, at_ns
-- column: kind VARCHAR  'publication' or 'take': the side that is known
-- column: id BIGINT  Identity of the publication or take
-- column: subscription_id
-- column: process_id BIGINT  Process that should have taken, or took
-- column: status VARCHAR  As in stat_delivery; 'orphan': a take without a publication
-- column: reason
SELECT
    d.run_id,
    b.start_ns AS at_ns,
    'publication' AS kind,
    d.publication_id AS id,
    d.subscription_id, s.process_id, d.status, d.reason
FROM main.stat_delivery AS d
JOIN main.publication AS b ON d.publication_id = b.publication_id
JOIN main.subscription AS s ON d.subscription_id = s.subscription_id
WHERE d.status <> 'delivered'
UNION ALL
SELECT o.run_id, t.taken_ns, 'take', o.take_id, o.subscription_id, t.process_id, 'orphan', o.reason
FROM main.stat_orphan AS o
JOIN main.take AS t ON o.take_id = t.take_id
