-- name: derive.vain_take
-- description: Attempts of readers that were told of a message and found none: it had expired. An
--     attempt says nothing if a callback takes by hand, only to look whether there is a message;
--     nor behind a callback that was never seen to end, as the attempt may be inside of it.
-- grain: one row per attempt outside of callbacks
-- needs: store.failed_take, store.callback_instance
SELECT f.run_id, f.subscription_id, f.thread_id, f.failed_ns
FROM store.failed_take AS f
ASOF LEFT JOIN store.callback_instance AS c
    ON f.thread_id = c.thread_id AND f.failed_ns >= c.start_ns
WHERE c.thread_id IS NULL OR c.end_ns < f.failed_ns
