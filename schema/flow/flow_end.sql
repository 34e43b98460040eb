-- description: Where flows end because the other side of a message is missing, and why: messages
--     that a subscription of their topic did not take, and takes whose publication is not known.
-- grain: one row per publication and subscription of its topic that did not take it, and one per
--     take without a publication
SELECT
    run_id,
    'publication' AS kind,
    publication_id AS id,
    subscription_id, reason
FROM store.undelivered
UNION ALL
SELECT run_id, 'take', take_id, subscription_id, reason FROM store.orphan_take
