-- description: Layers of one take stitched together, as for publications, and the subscription that
--     took. A take whose rmw layer failed does not count, although upper layers may report it.
--     Nor does a take of the middleware itself. It has no rcl layer, although rcl takes are traced.
--     Its reader belongs to no rcl subscription, and never had an rcl layer. The subscription is
--     the one of the rmw handle or ring buffer that was initialised last before the take; NULL
--     where that was not traced. Of a ring buffer it may be known to which subscription object it
--     belongs (`is_known`), but not to which subscription. The buffer that a transient-local
--     publisher keeps belongs to none.
-- grain: one row per successful take, or dequeue
-- when: raw.ros2_rmw_take, raw.ros2_rcl_take, raw.ros2_rclcpp_take,
--     raw.ros2_dispatch_subscription_callback, raw.ros2_rclcpp_ring_buffer_dequeue,
--     raw.agnocast_agnocast_create_callable, raw.agnocast_agnocast_take

-- What is taken out of ring buffers. The buffer that a transient-local publisher keeps belongs to
-- no subscription.
-- when: raw.ros2_rclcpp_ring_buffer_dequeue
-- columns: start_event_id BIGINT, end_event_id BIGINT, trace_index INTEGER, thread_id BIGINT,
--     process_id BIGINT, taken_ns BIGINT, method VARCHAR, buffer_handle UBIGINT,
--     subscription_event_id BIGINT, is_known BOOLEAN
CREATE OR REPLACE TEMP TABLE ring_buffer_take AS
WITH buffer AS (
    SELECT b.event_id, b.process_id, b.buffer, o.subscription_event_id
    FROM staging.located('raw.ros2_rclcpp_buffer_to_ipb') AS b
    ASOF JOIN staging.located('raw.ros2_rclcpp_ipb_to_subscription') AS i
        ON b.process_id = i.process_id AND b.ipb = i.ipb AND b.event_id <= i.event_id
    JOIN staging.subscription_object AS o ON i.event_id = o.event_id
)
SELECT
    d.event_id AS start_event_id,
    d.event_id AS end_event_id,
    d.trace_index, d.thread_id, d.process_id,
    d.ts_ns AS taken_ns,
    'ring_buffer' AS method,
    d.buffer AS buffer_handle,
    b.subscription_event_id,
    b.event_id IS NOT NULL AS is_known
FROM staging.located('raw.ros2_rclcpp_ring_buffer_dequeue') AS d
ASOF LEFT JOIN buffer AS b
    ON d.process_id = b.process_id AND d.buffer = b.buffer AND d.event_id >= b.event_id;

-- Messages that Agnocast handed over, to a callback or to a poll. A poll without a message got
-- nothing. `handle` tells subscriptions apart: the number of the callback, or the handle of the
-- subscription that was polled.
-- when: raw.agnocast_agnocast_create_callable, raw.agnocast_agnocast_take
-- columns: event_id BIGINT, ts_ns BIGINT, trace_index INTEGER, thread_id BIGINT, process_id BIGINT,
--     handle UBIGINT, subscription_event_id BIGINT
CREATE OR REPLACE TEMP TABLE agnocast_take AS
WITH called AS (
    SELECT
        event_id, ts_ns, trace_index, thread_id, process_id,
        pid_callback_info_id AS handle
    FROM staging.located('raw.agnocast_agnocast_create_callable')
),
callback AS (
    SELECT
        subscription_event_id AS event_id,
        process_id,
        callback_handle AS handle
    FROM staging.callback_known
    WHERE kind = 'subscription'
),
polled AS (
    SELECT
        event_id, ts_ns, trace_index, thread_id, process_id,
        subscription_handle AS handle
    FROM staging.located('raw.agnocast_agnocast_take')
    WHERE message <> 0
),
subscription AS (
    SELECT
        event_id, process_id,
        subscription_handle AS handle
    FROM staging.subscription_known
)
SELECT * RENAME (object_event_id AS subscription_event_id)
FROM staging.with_latest('called', 'callback')
UNION ALL
SELECT * FROM staging.with_latest('polled', 'subscription');

WITH middleware AS (
    SELECT
        coalesce(d.event_id, m.event_id) AS event_id,
        m.event_id AS end_event_id,
        m.trace_index, m.thread_index, m.message, m.taken,
        m.ts_ns AS rmw_ns,
        m.rmw_subscription_handle AS rmw_handle,
        nullif(m.source_timestamp, 0) AS stamp
    FROM staging.call('ros2_rmw_take') AS m
    LEFT JOIN raw.dds_read AS d ON m.previous_event_id = d.event_id AND m.message = d.buffer
),
rcl AS (
    SELECT
        coalesce(m.event_id, r.event_id) AS event_id,
        coalesce(r.event_id, m.end_event_id) AS end_event_id,
        coalesce(m.trace_index, r.trace_index) AS trace_index,
        coalesce(m.thread_index, r.thread_index) AS thread_index,
        coalesce(m.message, r.message) AS message,
        m.taken, m.rmw_ns,
        r.ts_ns AS rcl_ns,
        m.rmw_handle, m.stamp
    FROM middleware AS m
    FULL JOIN staging.call('ros2_rcl_take') AS r
        ON m.end_event_id = r.previous_event_id AND m.message = r.message
),
rclcpp AS (
    SELECT
        r.* REPLACE (
            coalesce(r.event_id, u.event_id) AS event_id,
            coalesce(u.event_id, r.end_event_id) AS end_event_id,
            coalesce(r.trace_index, u.trace_index) AS trace_index,
            coalesce(r.thread_index, u.thread_index) AS thread_index,
            coalesce(r.message, u.message) AS message
        )
    FROM rcl AS r
    FULL JOIN staging.call('ros2_rclcpp_take') AS u
        ON r.end_event_id = u.previous_event_id AND r.message = u.message
),
chain AS (
    SELECT
        coalesce(r.event_id, c.event_id) AS event_id,
        coalesce(c.event_id, r.end_event_id) AS end_event_id,
        coalesce(r.trace_index, c.trace_index) AS trace_index,
        coalesce(r.thread_index, c.thread_index) AS thread_index,
        r.rmw_ns, r.rcl_ns,
        c.ts_ns AS caret_ns,
        r.rmw_handle,
        coalesce(r.stamp, nullif(c.source_stamp, 0)::BIGINT) AS stamp
    FROM rclcpp AS r
    FULL JOIN staging.call('ros2_dispatch_subscription_callback') AS c
        ON r.end_event_id = c.previous_event_id AND r.message = c.message
    WHERE r.taken IS DISTINCT FROM 0
),
located AS (FROM staging.located('chain')),
rcl_reader AS (SELECT DISTINCT process_id, rmw_handle FROM located WHERE rcl_ns IS NOT NULL),
known_reader AS (
    SELECT process_id, rmw_handle FROM staging.subscription_known
    UNION
    SELECT process_id, rmw_handle FROM rcl_reader
),
rcl_traced AS (SELECT DISTINCT process_id FROM rcl_reader),
taken AS (
    SELECT
        t.event_id, t.end_event_id, t.trace_index, t.thread_id, t.process_id,
        coalesce(t.rmw_ns, t.rcl_ns, t.caret_ns) AS taken_ns,
        CASE WHEN t.rmw_ns IS NULL AND t.rcl_ns IS NULL THEN 'caret' ELSE 'rmw' END AS method,
        t.rmw_handle AS handle,
        t.stamp
    FROM located AS t
    LEFT JOIN rcl_traced AS r ON t.process_id = r.process_id
    LEFT JOIN known_reader AS k ON t.process_id = k.process_id AND t.rmw_handle = k.rmw_handle
    WHERE t.rcl_ns IS NOT NULL
        OR t.caret_ns IS NOT NULL
        OR (
            t.rmw_ns IS NOT NULL
            AND t.stamp IS NOT NULL
            AND (k.process_id IS NOT NULL OR r.process_id IS NULL)
        )
),
subscription AS (
    SELECT
        event_id, process_id,
        rmw_handle AS handle
    FROM staging.subscription_known
)
SELECT
    event_id AS start_event_id,
    end_event_id, trace_index, thread_id, process_id, taken_ns, method,
    handle AS rmw_handle,
    stamp AS source_timestamp_ns,
    object_event_id AS subscription_event_id,
    object_event_id IS NOT NULL AS is_known
FROM staging.with_latest('taken', 'subscription')
UNION ALL BY NAME
FROM ring_buffer_take
UNION ALL BY NAME
SELECT
    event_id AS start_event_id,
    event_id AS end_event_id,
    trace_index, thread_id, process_id,
    ts_ns AS taken_ns,
    'agnocast' AS method,
    handle AS rmw_handle,
    subscription_event_id,
    subscription_event_id IS NOT NULL AS is_known
FROM agnocast_take
