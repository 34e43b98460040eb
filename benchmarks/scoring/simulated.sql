-- What is true of a simulation, from its truth tables (the views simulated_…): which events each
-- instance has, which links there are, and which of them the recorded trace decides.

-- Events of instances, with what became of them.
CREATE OR REPLACE TEMP TABLE truth_event AS
WITH happened AS (
    SELECT 'publication' AS kind, publication_id AS id, host, pid, tid,
        unnest([
            {event: 'ros2:rclcpp_publish', ts_ns: rclcpp_ns},
            {event: 'ros2:rcl_publish', ts_ns: rcl_ns},
            {event: 'ros2:rmw_publish', ts_ns: rmw_ns}
        ], recursive := true)
    FROM simulated_publication
    UNION ALL
    SELECT 'publication', publication_id, host, pid, tid, event, ts_ns
    FROM simulated_dds_event
    UNION ALL
    SELECT 'take', take_id, host, pid, tid,
        unnest([
            {event: 'ros2:rmw_take', ts_ns: rmw_ns},
            {event: 'ros2:rcl_take', ts_ns: rcl_ns},
            {event: 'ros2:rclcpp_take', ts_ns: rclcpp_ns}
        ], recursive := true)
    FROM simulated_take
    UNION ALL
    SELECT 'callback_instance', callback_instance_id, host, pid, tid,
        unnest([
            {event: 'ros2:callback_start', ts_ns: start_ns},
            {event: 'ros2:callback_end', ts_ns: end_ns}
        ], recursive := true)
    FROM simulated_callback_instance
),
declared AS (
    SELECT DISTINCT event FROM simulated_declared
)
SELECT
    h.kind, h.id::VARCHAR AS id, h.host, h.pid, h.tid, h.event, h.ts_ns,
    d.event IS NOT NULL AS is_declared,
    d.event IS NOT NULL AND u.ts_ns IS NULL AS is_recorded
FROM happened AS h
LEFT JOIN declared AS d ON h.event = d.event
LEFT JOIN simulated_unrecorded AS u
    ON h.host = u.host AND h.pid = u.pid AND h.tid = u.tid AND h.event = u.event
    AND h.ts_ns = u.ts_ns
WHERE h.ts_ns IS NOT NULL;

-- Times in the trace by which a row may name an instance; a take also by its callback's start.
CREATE OR REPLACE TEMP TABLE truth_time AS
WITH clock_error AS (
    SELECT p.host, p.pid, coalesce(any_value(own.clock_error_ns), any_value(t.clock_error_ns), 0)
            AS error_ns
    FROM (SELECT DISTINCT host, pid FROM truth_event) AS p
    LEFT JOIN simulated_trace AS own ON p.host = own.host AND p.pid = own.pid
    LEFT JOIN simulated_trace AS t ON p.host = t.host AND t.pid IS NULL
    GROUP BY p.host, p.pid
),
named AS (
    SELECT kind, id, host, pid, tid, ts_ns FROM truth_event
    UNION ALL
    SELECT 'take', take_id::VARCHAR, host, pid, tid, start_ns
    FROM simulated_callback_instance
    WHERE take_id IS NOT NULL
)
SELECT n.kind, n.id, n.host, n.pid, n.tid, n.ts_ns + c.error_ns AS ts_ns
FROM named AS n
JOIN clock_error AS c ON n.host = c.host AND n.pid = c.pid;

CREATE OR REPLACE TEMP TABLE truth_link AS
WITH recorded AS (
    SELECT
        kind, id,
        bool_or(is_recorded) AS is_any,
        bool_and(is_recorded OR NOT is_declared) AND bool_or(is_recorded) AS is_whole,
        coalesce(bool_or(is_recorded) FILTER (event = 'ros2:rmw_publish'), false)
            AS is_rmw_publish,
        coalesce(bool_or(is_recorded) FILTER (event = 'dds:write'), false) AS is_dds_write,
        coalesce(bool_or(is_recorded) FILTER (event = 'ros2:rmw_take'), false) AS is_rmw_take,
        coalesce(bool_or(is_recorded) FILTER (event = 'ros2:callback_start'), false) AS is_start
    FROM truth_event
    GROUP BY kind, id
),
layout AS (
    SELECT
        coalesce(bool_or(event = 'ros2:rmw_publish' AND field = 'timestamp'), false)
            AS is_rmw_stamped,
        coalesce(bool_or(event = 'dds:write' AND field = 'timestamp'), false) AS is_dds_stamped
    FROM simulated_declared
),
-- Processes of whose objects not all initialisation events were recorded.
unknown_process AS (
    SELECT DISTINCT host, pid
    FROM simulated_unrecorded
    WHERE event LIKE '%\_init' ESCAPE '\'
),
-- Messages that another one of the topic resembles: by the stamp, or nearly by the time.
twin AS (
    SELECT DISTINCT a.publication_id, a.source_timestamp_ns = b.source_timestamp_ns AS is_equal
    FROM simulated_publication AS a
    JOIN simulated_publication AS b
        ON a.topic_name = b.topic_name
        AND a.publication_id <> b.publication_id
        AND (a.publisher_handle, a.host, a.pid)
            IS DISTINCT FROM (b.publisher_handle, b.host, b.pid)
        AND b.source_timestamp_ns BETWEEN a.source_timestamp_ns - 5_000_000
            AND a.source_timestamp_ns + 5_000_000
),
message AS (
    SELECT
        t.publication_id, t.take_id,
        is_rmw_stamped OR is_dds_stamped AS is_stamped,
        CASE
            WHEN is_rmw_stamped THEN p.is_rmw_publish AND r.is_rmw_take
            WHEN is_dds_stamped THEN p.is_dds_write AND r.is_rmw_take
            ELSE p.is_rmw_publish AND r.is_rmw_take
        END
        AND (
            CASE
                WHEN is_rmw_stamped OR is_dds_stamped THEN
                    t.publication_id NOT IN (SELECT publication_id FROM twin WHERE is_equal)
                ELSE t.publication_id NOT IN (SELECT publication_id FROM twin)
                    AND (t.publication_host, t.publication_pid)
                        NOT IN (SELECT (host, pid) FROM unknown_process)
                    AND (t.take_host, t.take_pid)
                        NOT IN (SELECT (host, pid) FROM unknown_process)
                    AND p.is_whole
            END
        ) AS is_decided
    FROM simulated_transport AS t
    CROSS JOIN layout
    JOIN recorded AS p ON p.kind = 'publication' AND t.publication_id::VARCHAR = p.id
    JOIN recorded AS r ON r.kind = 'take' AND t.take_id::VARCHAR = r.id
),
-- Nothing pairs across a gap: the next event that is missing on the host lies behind the callback.
whole_callback AS (
    SELECT c.callback_instance_id::VARCHAR AS id
    FROM simulated_callback_instance AS c
    JOIN recorded AS r ON r.kind = 'callback_instance' AND c.callback_instance_id::VARCHAR = r.id
    ASOF LEFT JOIN (
        SELECT host, ts_ns FROM simulated_unrecorded WHERE cause <> 'late start'
    ) AS u ON c.host = u.host AND c.start_ns <= u.ts_ns
    WHERE r.is_whole AND coalesce(u.ts_ns > c.end_ns, true)
)
SELECT
    'publication' AS kind, kind AS from_kind, id AS from_id, kind AS to_kind, id AS to_id,
    is_any AS is_decided, 'derive.link_transport' AS needs
FROM recorded
WHERE kind = 'publication'
UNION ALL
SELECT 'take', kind, id, kind, id, is_rmw_take, 'derive.link_transport'
FROM recorded
WHERE kind = 'take'
UNION ALL
SELECT 'callback_instance', kind, id, kind, id, is_start, 'derive.link_transport'
FROM recorded
WHERE kind = 'callback_instance'
UNION ALL
SELECT
    'transport', 'publication', publication_id::VARCHAR, 'take', take_id::VARCHAR, is_decided,
    CASE WHEN is_stamped THEN 'derive.link_transport_exact' ELSE 'derive.link_transport_nearest' END
FROM message
UNION ALL
SELECT
    c.kind, 'callback_instance', c.callback_instance_id::VARCHAR, 'publication',
    c.publication_id::VARCHAR, w.id IS NOT NULL AND p.is_whole,
    'derive.link_causal_' || c.kind
FROM simulated_causal AS c
JOIN recorded AS p ON p.kind = 'publication' AND c.publication_id::VARCHAR = p.id
LEFT JOIN whole_callback AS w ON c.callback_instance_id::VARCHAR = w.id;

-- Messages that a subscription did not take, where the publication is in the trace.
CREATE OR REPLACE TEMP TABLE truth_drop AS
SELECT
    u.publication_id::VARCHAR AS publication_id, u.subscription_host AS host,
    u.subscription_pid AS pid, u.subscription_handle, u.reason, u.is_internal
FROM simulated_undelivered AS u
JOIN truth_link AS l ON l.kind = 'publication' AND u.publication_id::VARCHAR = l.from_id
WHERE l.is_decided;
