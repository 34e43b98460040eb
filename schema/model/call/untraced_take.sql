-- name: staging.untraced_take
-- description: Processes with callbacks that only elimination could tell to be timers, and which
--     show that messages reach callbacks although no take is traced, as loaned messages do: a
--     subscription ran so, or what would have to be a timer ran after a message or a request of
--     the same round. An executor runs all timers that were ready at the end of its wait first, if
--     it has one thread.
-- grain: one row per such process
-- when: staging.callback_announced
WITH candidate AS (
    SELECT t.start_event_id, t.process_id, t.thread_id
    FROM staging.callback_trigger AS t
    JOIN staging.callback_announced AS a
        ON t.process_id = a.process_id
        AND t.callback_handle = a.callback_handle
        AND t.callback_event_id IS NOT DISTINCT FROM a.callback_event_id
    WHERE a.handle IS NOT NULL AND a.kind IS NULL
),
-- Runs of the processes concerned.
run AS (
    SELECT
        r.start_event_id, r.process_id, r.thread_id, r.callback_handle, r.depth,
        r.previous_event_id, r.executor_event_id, r.is_intra_process, b.kind, b.take_event_id
    FROM staging.callback_run AS r
    JOIN staging.callback_binding AS b ON r.start_event_id = b.start_event_id
    WHERE r.process_id IN (SELECT process_id FROM candidate)
),
subscription_without_take AS (
    SELECT r.process_id
    FROM run AS r
    JOIN raw.ros2_rclcpp_executor_execute AS x ON r.executor_event_id = x.event_id
    WHERE r.kind = 'subscription'
        AND r.take_event_id IS NULL
        AND NOT r.is_intra_process
        AND coalesce(r.previous_event_id < r.executor_event_id, true)
    UNION ALL
    SELECT process_id FROM staging.callback_announced WHERE kind = 'subscription'
),
several_threads AS (
    SELECT DISTINCT r.thread_id
    FROM run AS r
    JOIN (
        SELECT process_id, callback_handle
        FROM run
        GROUP BY process_id, callback_handle
        HAVING count(DISTINCT thread_id) > 1
    ) AS s ON r.process_id = s.process_id AND r.callback_handle = s.callback_handle
),
served AS (
    SELECT thread_id, start_event_id
    FROM run
    WHERE depth = 1
        AND (take_event_id IS NOT NULL OR kind = 'service')
        AND thread_id IN (SELECT thread_id FROM candidate)
        AND thread_id NOT IN (SELECT thread_id FROM several_threads)
),
behind AS (
    SELECT c.start_event_id, c.process_id, c.thread_id, s.start_event_id AS served_event_id
    FROM candidate AS c
    ASOF JOIN served AS s
        ON c.thread_id = s.thread_id AND c.start_event_id > s.start_event_id
),
waited AS (
    SELECT thread_id, event_id
    FROM staging.located('ros2_rclcpp_executor_wait_for_work')
    WHERE thread_id IN (SELECT thread_id FROM behind)
),
-- A gap may hide that the thread waited in between.
interrupted AS (
    SELECT b.start_event_id
    FROM behind AS b
    ASOF JOIN staging.callback_gap AS g
        ON b.thread_id = g.thread_id AND b.start_event_id >= g.event_id
    WHERE g.event_id > b.served_event_id
),
same_round AS (
    SELECT b.process_id
    FROM behind AS b
    ANTI JOIN interrupted AS i ON b.start_event_id = i.start_event_id
    ASOF LEFT JOIN waited AS w
        ON b.thread_id = w.thread_id AND b.start_event_id > w.event_id
    -- No wait at all was seen before, or only earlier ones.
    WHERE w.thread_id IS NULL OR w.event_id < b.served_event_id
)
SELECT process_id FROM subscription_without_take
UNION
SELECT process_id FROM same_round
