-- name: staging.callback_handed
-- description: Callback instances that were handed a message without a traced take, where nothing
--     tells the subscription of the callback.
-- grain: one row per such callback instance
-- when: staging.callback_binding
SELECT start_event_id, process_id, callback_handle, callback_event_id
FROM staging.callback_binding
WHERE take_event_id IS NULL
    AND subscription_event_id IS NULL
    AND (kind = 'subscription' OR (is_intra_process AND coalesce(kind = 'unknown', true)))
