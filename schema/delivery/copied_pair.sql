-- description: Placeholders that get copies of what a publisher passes on through ring buffers.
--     Each is one subscription with the reader of the buffer, but nothing in the trace joins the
--     two. So it is not known what the placeholder should have taken.
-- grain: one row per publisher and placeholder of a subscription
SELECT DISTINCT l.run_id, l.publisher_id, l.subscription_id
FROM store.link_transport AS l
JOIN store.subscription AS s ON l.subscription_id = s.subscription_id
WHERE l.is_copy AND s.is_inferred
