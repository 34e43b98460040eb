-- description: What callbacks belong to whose creation was not traced, and that no message or
--     request was seen to be for. The executor tells, as far as it can. It may name a handle that
--     is known. Else, what it names is a timer or a subscription: where takes were enabled, what
--     runs without one is a timer. What runs without being named belongs to a service, where the
--     requests that services take were not enabled. The owner is a placeholder where this was
--     decided by elimination, or where the service was not seen to be initialised.
-- grain: one row per callback whose owner is decided
-- when: staging.callback_binding WHERE kind = 'unknown',
--     staging.callback_known WHERE kind = 'service' AND service_event_id IS NULL

-- Executor events directly before instances of such callbacks. The executor names the handle that
-- it executes, if that is a timer or a subscription. Else it only looks for what is ready. Where
-- another event comes in between, it is neither.
CREATE OR REPLACE TEMP TABLE callback_trigger AS
WITH unowned AS (
    SELECT
        start_event_id, process_id, callback_event_id, is_intra_process, take_event_id,
        request_event_id
    FROM staging.callback_binding
    WHERE kind = 'unknown'
),
explained AS (
    SELECT DISTINCT callback_event_id
    FROM unowned
    WHERE is_intra_process OR take_event_id IS NOT NULL OR request_event_id IS NOT NULL
),
run AS (
    SELECT
        u.start_event_id, u.process_id, u.callback_event_id, p.trace_index, p.thread_id,
        p.executor_event_id,
        coalesce(p.previous_event_id < p.executor_event_id, true) AS is_direct
    FROM unowned AS u
    ANTI JOIN explained AS e ON u.callback_event_id = e.callback_event_id
    JOIN staging.callback_run AS p ON u.start_event_id = p.start_event_id
    WHERE p.executor_event_id IS NOT NULL
),
announced AS (
    SELECT
        event_id, handle,
        false AS is_ready
    FROM raw.ros2_rclcpp_executor_execute
    UNION ALL
    SELECT event_id, NULL, true
    FROM raw.ros2_rclcpp_executor_get_next_ready
)
SELECT
    r.start_event_id, r.process_id, r.callback_event_id, r.trace_index, r.thread_id, a.handle,
    coalesce(a.is_ready, false) AS is_ready
FROM run AS r
LEFT JOIN announced AS a ON r.is_direct AND r.executor_event_id = a.event_id;

-- If the executor said the same before each instance of a callback: the handle that it named (NULL
-- if it named none), the timer or subscription of that handle if the trace has it, and which
-- tracepoints were enabled meanwhile.
CREATE OR REPLACE TEMP TABLE callback_announced AS
WITH enabled AS (
    SELECT
        trace_index,
        bool_or(name IN ('ros2:rmw_take', 'ros2:rcl_take')) AS has_takes,
        bool_or(name = 'ros2:rclcpp_executor_execute') AS has_executions,
        bool_or(name = 'ros2:rmw_take_request') AS has_requests
    FROM staging.declared
    GROUP BY trace_index
),
agreed AS (
    SELECT
        t.process_id, t.callback_event_id,
        any_value(t.handle) AS handle,
        min(t.start_event_id) AS start_event_id,
        bool_and(e.has_takes) AS has_takes,
        bool_and(e.has_executions) AS has_executions,
        bool_or(e.has_requests) AS has_requests
    FROM callback_trigger AS t
    LEFT JOIN enabled AS e ON t.trace_index = e.trace_index
    GROUP BY t.process_id, t.callback_event_id
    HAVING sum(t.is_ready::INTEGER) = count(*)
        OR (count(t.handle) = count(*) AND count(DISTINCT t.handle) = 1)
),
owner AS (
    SELECT
        event_id, process_id,
        timer_handle AS handle,
        'timer' AS kind,
        event_id AS owner_event_id
    FROM staging.located('raw.ros2_rcl_timer_init')
    UNION ALL
    SELECT event_id, process_id, subscription_handle, 'subscription', event_id
    FROM staging.subscription_known
    UNION ALL
    SELECT
        0, process_id,
        any_value(timer_handle),
        'timer', timer_event_id
    FROM staging.timer_use
    WHERE is_inferred
    GROUP BY process_id, timer_event_id
)
SELECT
    a.process_id, a.callback_event_id, a.handle, a.start_event_id, a.has_takes, a.has_executions,
    a.has_requests, o.kind, o.owner_event_id,
    a.handle IS NOT NULL
    AND count(*) OVER (PARTITION BY a.process_id, a.handle, o.owner_event_id) > 1 AS is_disputed
FROM agreed AS a
ASOF LEFT JOIN owner AS o
    ON a.process_id = o.process_id AND a.handle = o.handle AND a.start_event_id >= o.event_id;

-- Messages may reach callbacks although no take is traced, as loaned messages do. Processes show
-- that (`untraced_take`) if a subscription ran so, or if what would have to be a timer ran after a
-- message or a request of the same round. An executor runs all timers that were ready at the end of
-- its wait first, if it has one thread.
WITH candidate AS (
    SELECT t.start_event_id, t.process_id, t.thread_id
    FROM callback_trigger AS t
    JOIN callback_announced AS a ON t.callback_event_id = a.callback_event_id
    WHERE a.handle IS NOT NULL AND a.kind IS NULL
),
-- Runs of the processes concerned.
run AS (
    SELECT
        r.start_event_id, r.process_id, r.thread_id, r.depth, r.previous_event_id,
        r.executor_event_id, r.is_intra_process, b.kind, b.take_event_id,
        count(DISTINCT r.thread_id) OVER (PARTITION BY r.process_id, r.callback_handle) > 1
            AS has_several_threads
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
    SELECT process_id FROM callback_announced WHERE kind = 'subscription'
),
served AS (
    SELECT thread_id, start_event_id
    FROM run
    WHERE depth = 1
        AND (take_event_id IS NOT NULL OR kind = 'service')
        AND thread_id IN (SELECT thread_id FROM candidate)
        AND thread_id NOT IN (SELECT thread_id FROM run WHERE has_several_threads)
),
behind AS (
    SELECT
        c.start_event_id, c.process_id, c.thread_id,
        s.start_event_id AS served_event_id
    FROM candidate AS c
    ASOF JOIN served AS s ON c.thread_id = s.thread_id AND c.start_event_id > s.start_event_id
),
waited AS (
    SELECT thread_id, event_id
    FROM staging.located('raw.ros2_rclcpp_executor_wait_for_work')
    WHERE thread_id IN (SELECT thread_id FROM behind)
),
-- A gap may hide that the thread waited in between.
interrupted AS (
    SELECT b.start_event_id
    FROM behind AS b
    ASOF JOIN (SELECT * FROM staging.near_gap WHERE sequence = 'call') AS g
        ON b.thread_id = g.thread_id AND b.start_event_id >= g.event_id
    WHERE g.event_id > b.served_event_id
),
same_round AS (
    SELECT b.process_id
    FROM behind AS b
    ANTI JOIN interrupted AS i ON b.start_event_id = i.start_event_id
    ASOF LEFT JOIN waited AS w ON b.thread_id = w.thread_id AND b.start_event_id > w.event_id
    -- No wait at all was seen before, or only earlier ones.
    WHERE w.thread_id IS NULL OR w.event_id < b.served_event_id
),
untraced_take AS (
    SELECT process_id FROM subscription_without_take
    UNION
    SELECT process_id FROM same_round
),
decided AS (
    SELECT
        a.process_id, a.callback_event_id, a.start_event_id, a.handle, a.owner_event_id,
        CASE
            WHEN a.is_disputed THEN NULL
            WHEN a.kind IS NOT NULL THEN a.kind
            WHEN a.handle IS NULL AND a.has_executions AND NOT a.has_requests THEN 'service'
            WHEN a.handle IS NOT NULL AND a.has_takes AND u.process_id IS NULL THEN 'timer'
        END AS kind
    FROM callback_announced AS a
    LEFT JOIN untraced_take AS u ON a.process_id = u.process_id
),
asked AS (
    SELECT DISTINCT callback_event_id
    FROM staging.callback_binding
    WHERE request_event_id IS NOT NULL
),
service AS (
    SELECT
        process_id, service_handle,
        min(event_id) AS event_id
    FROM staging.callback_known
    WHERE kind = 'service' AND service_event_id IS NULL
    GROUP BY process_id, service_handle
)
SELECT
    process_id, callback_event_id, kind, handle,
    coalesce(owner_event_id, start_event_id) AS owner_event_id,
    owner_event_id IS NULL AS is_inferred,
    owner_event_id IS NULL AS is_eliminated
FROM decided
WHERE kind IS NOT NULL
UNION ALL
SELECT
    k.process_id, k.event_id, 'service', k.service_handle, s.event_id, true, false
FROM staging.callback_known AS k
JOIN service AS s ON k.process_id = s.process_id AND k.service_handle = s.service_handle
ANTI JOIN asked AS q ON k.event_id = q.callback_event_id
WHERE k.kind = 'service' AND k.service_event_id IS NULL
