-- name: derive.copied_pair
-- description: Placeholders that get copies of what a publisher passes on through ring buffers.
--     They are one subscription with the reader of the buffer, which nothing joins them with: what
--     they should have taken is not known.
-- grain: one row per publisher and placeholder of a subscription
-- needs: store.link_transport, store.subscription
SELECT DISTINCT l.run_id, l.publisher_id, l.subscription_id
FROM store.link_transport AS l
JOIN store.subscription AS s ON l.subscription_id = s.subscription_id
WHERE l.is_copy AND s.is_inferred
