-- description: Stretches of time in which enough callbacks of a group ran at once.
--     `before_ns` is the sum of the earlier stretches of the group.
-- grain: one row per stretch in which their number does not change
-- param: callbacks VARCHAR  Name of rows of executor_id, callback_id (NULL: of all), start_ns,
--     end_ns, enough: how many have to run at once
CREATE OR REPLACE MACRO derive.concurrency(callbacks) AS TABLE
WITH edge AS (
    SELECT
        executor_id, callback_id, enough,
        unnest([start_ns, end_ns]) AS at_ns,
        unnest([1, -1]) AS step
    FROM query_table(callbacks)
),
level AS (
    SELECT
        executor_id, callback_id, enough,
        at_ns AS start_ns,
        lead(at_ns) OVER in_time AS end_ns,
        sum(step) OVER (in_time ROWS UNBOUNDED PRECEDING) AS running
    FROM edge
    WINDOW in_time AS (PARTITION BY executor_id, callback_id ORDER BY at_ns, step)
)
SELECT
    executor_id, callback_id, enough, start_ns, end_ns,
    coalesce(sum(end_ns - start_ns) OVER (
        PARTITION BY executor_id, callback_id ORDER BY start_ns
        ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
    ), 0)::BIGINT AS before_ns
FROM level
WHERE running >= enough AND end_ns > start_ns
