-- description: Attempts to take a message that had expired: the reader was woken for it and found
--     none. Attempts inside of callbacks do not count, since a callback may take by hand to look
--     whether there is a message. Nor do those behind a callback that was never seen to end, since
--     they may be inside of it.
-- grain: one row per attempt outside of callbacks
WITH tried AS (
    SELECT DISTINCT
        thread_id,
        derive.tenth_of_second(failed_ns) AS tenth
    FROM store.failed_take
),
-- The last one tells all of a tenth of a second without an attempt.
begun AS (
    SELECT
        c.run_id, c.thread_id,
        max(c.start_ns) AS start_ns,
        arg_max_null(c.end_ns, c.start_ns) AS end_ns
    FROM store.callback_instance AS c
    LEFT JOIN tried AS t
        ON c.thread_id = t.thread_id AND derive.tenth_of_second(c.start_ns) = t.tenth
    GROUP BY
        c.run_id, c.thread_id, derive.tenth_of_second(c.start_ns),
        CASE WHEN t.tenth IS NOT NULL THEN c.callback_instance_id END
)
SELECT f.run_id, f.subscription_id, f.thread_id, f.failed_ns
FROM store.failed_take AS f
ASOF LEFT JOIN begun AS c
    ON f.run_id = c.run_id AND f.thread_id = c.thread_id AND f.failed_ns >= c.start_ns
WHERE c.thread_id IS NULL OR c.end_ns < f.failed_ns
