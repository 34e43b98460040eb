-- name: derive.clock_set_back
-- kind: macro
-- description: When a subscription may have noticed that the clock which stamps its messages was
--     set back. It takes the messages of a publisher in the order in which they were published. If
--     several in a row are older than the one before (is_lasting), they were stamped after the
--     clock was set back, by set_back_ns at least. A few in the wrong order may be those of threads
--     that were held up, or the clock was set back by little. If both messages waited equally
--     long, it was set by step_ns, which is negative. Topics of several publishers say nothing,
--     since each has an order of its own. clock_id is the clock of the take and of the publication;
--     NULL where these are two.
-- grain: one row per take of a message that is older than the one taken before it, unless the next
--     one is later than both
-- param: only_run BIGINT  Run to look at
CREATE OR REPLACE MACRO derive.clock_set_back(only_run) AS TABLE
WITH on_clock AS (
    SELECT o.process_id, h.clock_id
    FROM store.process AS o
    JOIN store.host AS h ON o.host_id = h.host_id
    WHERE o.run_id = only_run
),
sole AS (
    SELECT p.topic_name, any_value(c.clock_id) AS clock_id
    FROM store.publisher AS p
    LEFT JOIN on_clock AS c ON p.process_id = c.process_id
    WHERE p.run_id = only_run
    GROUP BY p.topic_name
    HAVING count(*) = 1
),
received AS (
    SELECT
        t.subscription_id, t.take_id, t.taken_ns, t.source_timestamp_ns,
        CASE WHEN c.clock_id = p.clock_id THEN c.clock_id END AS clock_id,
        t.taken_ns - lag(t.taken_ns) OVER in_order AS passed_ns,
        lag(t.source_timestamp_ns) OVER in_order AS previous_stamp_ns,
        lead(t.source_timestamp_ns) OVER in_order AS next_stamp_ns,
        max(t.source_timestamp_ns) OVER (
            in_order ROWS BETWEEN CURRENT ROW AND derive.clock_limit().quorum - 1 FOLLOWING
        ) AS latest_stamp_ns
    FROM store.take AS t
    JOIN store.subscription AS s ON t.subscription_id = s.subscription_id
    JOIN sole AS p ON s.topic_name = p.topic_name
    LEFT JOIN on_clock AS c ON t.process_id = c.process_id
    WHERE t.run_id = only_run
        AND t.source_timestamp_ns <> 0
        AND s.topic_name IN (SELECT topic_name FROM derive.unstamped_publication(only_run))
    WINDOW in_order AS (PARTITION BY t.subscription_id ORDER BY t.taken_ns, t.take_id)
)
SELECT
    subscription_id,
    clock_id,
    take_id,
    taken_ns,
    previous_stamp_ns - source_timestamp_ns AS set_back_ns,
    source_timestamp_ns - previous_stamp_ns - passed_ns AS step_ns,
    latest_stamp_ns < previous_stamp_ns - derive.clock_limit().write_ns AS is_lasting
FROM received
WHERE source_timestamp_ns < previous_stamp_ns - derive.clock_limit().write_ns
    -- Where two threads took two messages in the wrong order, the next one is the latest of all.
    AND coalesce(next_stamp_ns <= previous_stamp_ns + derive.clock_limit().write_ns, true)
