-- name: derive.clock_set_back
-- kind: macro
-- description: When a subscription noticed that the clock which stamps its messages was set back,
--     and by how much at least.
--     It takes the messages of a publisher in the order in which they were published. If several
--     in a row are older than the one before, they were stamped after the clock was set back.
--     A few in the wrong order are those of threads that were held up. Topics of several publishers
--     say nothing, since each has an order of its own.
-- grain: one row per first take of a subscription after its clock was set back
-- param: only_run BIGINT  Run to look at
CREATE OR REPLACE MACRO derive.clock_set_back(only_run) AS TABLE
WITH sole AS (
    SELECT topic_name
    FROM store.publisher
    WHERE run_id = only_run
    GROUP BY topic_name
    HAVING count(*) = 1
),
received AS (
    SELECT
        t.subscription_id, t.take_id, t.taken_ns, t.source_timestamp_ns,
        lag(t.source_timestamp_ns) OVER in_order AS previous_stamp_ns,
        max(t.source_timestamp_ns) OVER (
            in_order ROWS BETWEEN CURRENT ROW AND derive.clock_limit().quorum - 1 FOLLOWING
        ) AS latest_stamp_ns
    FROM store.take AS t
    JOIN store.subscription AS s ON t.subscription_id = s.subscription_id
    WHERE t.run_id = only_run
        AND t.source_timestamp_ns <> 0
        AND s.topic_name IN (SELECT topic_name FROM derive.unstamped_publication(only_run))
        AND s.topic_name IN (FROM sole)
    WINDOW in_order AS (PARTITION BY t.subscription_id ORDER BY t.taken_ns, t.take_id)
)
SELECT
    subscription_id, take_id, taken_ns, previous_stamp_ns - source_timestamp_ns AS set_back_ns
FROM received
WHERE latest_stamp_ns < previous_stamp_ns - derive.clock_limit().write_ns
