-- description: Attempts to take a message that had expired: the reader was woken for it and found
--     none. Attempts inside of callbacks do not count, since a callback may take by hand to look
--     whether there is a message. Nor do those behind a callback that was never seen to end, since
--     they may be inside of it.
-- grain: one row per attempt outside of callbacks
SELECT f.run_id, f.subscription_id, f.thread_id, f.failed_ns
FROM store.failed_take AS f
ASOF LEFT JOIN store.callback_instance AS c
    ON f.run_id = c.run_id AND f.thread_id = c.thread_id AND f.failed_ns >= c.start_ns
WHERE c.thread_id IS NULL OR c.end_ns < f.failed_ns
