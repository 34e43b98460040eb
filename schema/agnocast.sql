-- What Agnocast's events say, said by events of ROS 2: an ingest runs this before the model, if a
-- recording has any. Each new row has the id of the event that it is made of, whose tracepoint is
-- `is_translated`. So nodes, objects, callbacks, groups and publications of Agnocast are those of
-- the model, by its rules. What is taken, and the numbers of messages, are in
-- `staging.agnocast_take` and `staging.agnocast_entry`.
--
-- A callback is known by its number in the process (`pid_callback_info_id`), a timer's by the
-- timer. What is not of the middleware has 0 in place of its handle there.

CREATE TEMP TABLE agnocast_process AS
SELECT
    thread_index,
    dense_rank() OVER (ORDER BY trace_index, pid_ns, vpid) AS process
FROM raw.thread;

INSERT INTO raw.ros2_rcl_init BY NAME
SELECT event_id, ts_ns, trace_index, cpu_id, thread_index, context_handle
FROM raw.agnocast_agnocast_init
-- What CARET reports again begins no new life of the process.
WHERE init_timestamp IS NULL;

INSERT INTO raw.ros2_rcl_node_init BY NAME
SELECT event_id, ts_ns, trace_index, cpu_id, thread_index, node_handle, node_name, namespace
FROM raw.agnocast_agnocast_node_init;

INSERT INTO raw.ros2_rcl_publisher_init BY NAME
SELECT
    event_id, ts_ns, trace_index, cpu_id, thread_index, publisher_handle, node_handle,
    0 AS rmw_publisher_handle, topic_name, queue_depth
FROM raw.agnocast_agnocast_publisher_init;

INSERT INTO raw.ros2_rclcpp_publish BY NAME
SELECT
    event_id, ts_ns, trace_index, cpu_id, thread_index, previous_call_event_id,
    previous_callback_event_id, publisher_handle
FROM raw.agnocast_agnocast_publish;

INSERT INTO raw.ros2_rcl_subscription_init BY NAME
SELECT
    event_id, ts_ns, trace_index, cpu_id, thread_index, subscription_handle, node_handle,
    0 AS rmw_subscription_handle, topic_name, queue_depth
FROM raw.agnocast_agnocast_subscription_init;

-- A subscription that is polled has no callback.
CREATE TEMP TABLE agnocast_callback AS
SELECT
    event_id, ts_ns, trace_index, cpu_id, thread_index, subscription_handle,
    subscription_handle AS subscription,
    pid_callback_info_id AS callback,
    symbol,
    callback_group AS callback_group_addr
FROM raw.agnocast_agnocast_subscription_init
WHERE pid_callback_info_id <> 0;

INSERT INTO raw.ros2_rclcpp_subscription_init BY NAME
SELECT * EXCLUDE (callback, symbol, callback_group_addr) FROM agnocast_callback;

INSERT INTO raw.ros2_rclcpp_subscription_callback_added BY NAME
SELECT * EXCLUDE (subscription_handle, symbol, callback_group_addr) FROM agnocast_callback;

INSERT INTO raw.ros2_caret_callback_group_add_subscription BY NAME
SELECT * EXCLUDE (subscription, callback, symbol) FROM agnocast_callback;

-- Before 2.3 the period of a timer is in a unit that is not recorded. It is that one of 1, 1,000,
-- 1,000,000 and 1,000,000,000 ns with which it comes closest to how often the timer was due.
CREATE TEMP TABLE agnocast_timer AS
WITH due AS (
    SELECT
        p.process, c.timer_handle,
        c.ts_ns - lag(c.ts_ns) OVER (
            PARTITION BY p.process, c.timer_handle ORDER BY c.event_id
        ) AS distance_ns
    FROM raw.agnocast_agnocast_create_timer_callable AS c
    JOIN agnocast_process AS p ON c.thread_index = p.thread_index
),
usual AS (
    SELECT
        process, timer_handle,
        quantile_disc(distance_ns, 0.5) AS distance_ns
    FROM due
    WHERE distance_ns > 0
    GROUP BY process, timer_handle
),
made AS (
    SELECT
        i.*,
        round(ln(u.distance_ns / i.period) / ln(1000))::INTEGER AS power,
        i.trace_index IN (
            SELECT trace_index
            FROM staging.declared
            WHERE name = 'agnocast:agnocast_add_callback_group'
        ) AS is_in_ns
    FROM raw.agnocast_agnocast_timer_init AS i
    JOIN agnocast_process AS p ON i.thread_index = p.thread_index
    LEFT JOIN usual AS u
        ON p.process = u.process AND i.timer_handle = u.timer_handle AND i.period > 0
)
SELECT
    event_id, ts_ns, trace_index, cpu_id, thread_index, timer_handle, node_handle,
    timer_handle AS callback,
    symbol,
    callback_group AS callback_group_addr,
    CASE
        WHEN is_in_ns THEN period
        WHEN power BETWEEN 0 AND 3 THEN period * [1, 1_000, 1_000_000, 1_000_000_000][power + 1]
    END AS period
FROM made;

INSERT INTO raw.ros2_rcl_timer_init BY NAME
SELECT * EXCLUDE (node_handle, callback, symbol, callback_group_addr) FROM agnocast_timer;

INSERT INTO raw.ros2_rclcpp_timer_link_node BY NAME
SELECT * EXCLUDE (callback, symbol, callback_group_addr, period) FROM agnocast_timer;

INSERT INTO raw.ros2_rclcpp_timer_callback_added BY NAME
SELECT * EXCLUDE (node_handle, symbol, callback_group_addr, period) FROM agnocast_timer;

INSERT INTO raw.ros2_caret_callback_group_add_timer BY NAME
SELECT * EXCLUDE (node_handle, callback, symbol, period) FROM agnocast_timer;

INSERT INTO raw.ros2_rclcpp_callback_register BY NAME
SELECT event_id, ts_ns, trace_index, cpu_id, thread_index, callback, symbol FROM agnocast_callback
UNION ALL
SELECT event_id, ts_ns, trace_index, cpu_id, thread_index, callback, symbol FROM agnocast_timer;

-- A callable is at an address that is used again: the latest one made there is what begins, once.
-- It directly follows that event in the call, whatever thread made it, and however long before.
-- One whose making was not recorded is a callback of its own, by its address.
CREATE TEMP TABLE agnocast_run AS
WITH made AS (
    SELECT
        c.event_id, p.process, c.callable,
        c.pid_callback_info_id AS callback
    FROM raw.agnocast_agnocast_create_callable AS c
    JOIN agnocast_process AS p ON c.thread_index = p.thread_index
    UNION ALL
    SELECT c.event_id, p.process, c.callable, c.timer_handle
    FROM raw.agnocast_agnocast_create_timer_callable AS c
    JOIN agnocast_process AS p ON c.thread_index = p.thread_index
),
begun AS (
    SELECT s.*, p.process
    FROM raw.agnocast_agnocast_callable_start AS s
    JOIN agnocast_process AS p ON s.thread_index = p.thread_index
),
latest AS (
    SELECT
        b.*,
        m.event_id AS made_event_id,
        m.callback,
        row_number() OVER (PARTITION BY m.event_id ORDER BY b.event_id) = 1 AS is_first
    FROM begun AS b
    ASOF LEFT JOIN made AS m
        ON b.process = m.process AND b.callable = m.callable AND b.event_id > m.event_id
)
SELECT
    event_id, ts_ns, trace_index, cpu_id, thread_index, previous_callback_event_id,
    CASE WHEN is_first THEN made_event_id END AS previous_call_event_id,
    callable,
    CASE WHEN is_first AND made_event_id IS NOT NULL THEN callback ELSE callable END AS callback
FROM latest;

INSERT INTO raw.ros2_callback_start BY NAME
SELECT
    * EXCLUDE (callable),
    0 AS is_intra_process
FROM agnocast_run;

INSERT INTO raw.ros2_callback_end BY NAME
SELECT
    e.event_id, e.ts_ns, e.trace_index, e.cpu_id, e.thread_index, e.previous_call_event_id,
    e.previous_callback_event_id,
    coalesce(r.callback, e.callable) AS callback
FROM raw.agnocast_agnocast_callable_end AS e
ASOF LEFT JOIN agnocast_run AS r
    ON e.thread_index = r.thread_index AND e.callable = r.callable AND e.event_id > r.event_id;

INSERT INTO raw.ros2_caret_construct_executor BY NAME
SELECT * FROM raw.agnocast_agnocast_construct_executor;

INSERT INTO raw.ros2_caret_add_callback_group BY NAME
SELECT * FROM raw.agnocast_agnocast_add_callback_group;

DROP TABLE agnocast_process;
DROP TABLE agnocast_callback;
DROP TABLE agnocast_timer;
DROP TABLE agnocast_run
