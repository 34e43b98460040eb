-- What is true of a simulation, from its truth tables (the views simulated_…): which events each
-- instance has, which links there are, and which of them the recorded trace decides.

-- Events of instances, with what became of them.
CREATE OR REPLACE TEMP TABLE truth_event AS
WITH happened AS (
    SELECT 'publication' AS kind, publication_id AS id, host, pid, tid,
        unnest([
            {event: 'ros2:rclcpp_intra_publish', ts_ns: intra_ns},
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
            {event: 'ros2:rclcpp_take', ts_ns: rclcpp_ns},
            {event: 'ros2:rclcpp_ring_buffer_dequeue', ts_ns: dequeue_ns}
        ], recursive := true)
    FROM simulated_take
    UNION ALL
    SELECT 'callback_instance', callback_instance_id, host, pid, tid,
        unnest([
            {event: 'ros2:callback_start', ts_ns: start_ns},
            {event: 'ros2:callback_end', ts_ns: end_ns}
        ], recursive := true)
    FROM simulated_callback_instance
    UNION ALL
    SELECT 'request_sent', request_id, client_host, client_pid, client_tid,
        'ros2:rmw_send_request', sent_ns
    FROM simulated_request
    UNION ALL
    SELECT 'request_taken', request_id, service_host, service_pid, service_tid,
        'ros2:rmw_take_request', taken_ns
    FROM simulated_request
    UNION ALL
    SELECT 'response_sent', request_id, service_host, service_pid, service_tid,
        'ros2:rmw_send_response', sent_ns
    FROM simulated_response
    UNION ALL
    SELECT 'response_taken', request_id, client_host, client_pid, client_tid,
        'ros2:rmw_take_response', taken_ns
    FROM simulated_response
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
-- All traces of a host are on the clock of the first one, but for errors of measuring.
WITH clock_error AS (
    SELECT
        host, pid,
        CASE
            WHEN abs(clock_error_ns - first_error_ns) <= 1000 THEN clock_error_ns
            ELSE first_error_ns
        END AS error_ns
    FROM (
        SELECT
            host, pid, clock_error_ns,
            first(clock_error_ns) OVER (PARTITION BY host ORDER BY path) AS first_error_ns
        FROM simulated_trace
    )
),
state AS (
    SELECT s.*, concat_ws('/', host, pid, tid, start_ns) AS id FROM simulated_executor_state AS s
),
named AS (
    SELECT kind, id, host, pid, tid, ts_ns FROM truth_event
    UNION ALL
    SELECT 'callback_end', callback_instance_id::VARCHAR, host, pid, tid, end_ns
    FROM simulated_callback_instance
    UNION ALL
    SELECT 'is_' || kind, callback_instance_id::VARCHAR, host, pid, tid, start_ns
    FROM simulated_callback_instance
    UNION ALL
    SELECT 'state_start', id, host, pid, tid, start_ns FROM state
    UNION ALL
    SELECT 'state_end', id, host, pid, tid, end_ns FROM state
    UNION ALL
    SELECT 'take', take_id::VARCHAR, host, pid, tid, start_ns
    FROM simulated_callback_instance
    WHERE take_id IS NOT NULL
)
SELECT n.kind, n.id, n.host, n.pid, n.tid, n.ts_ns + c.error_ns AS ts_ns
FROM named AS n
JOIN clock_error AS c ON n.host = c.host AND n.pid = coalesce(c.pid, n.pid);

CREATE OR REPLACE TEMP TABLE truth_link AS
WITH recorded AS (
    SELECT
        kind, id,
        bool_or(is_recorded) AS is_any,
        bool_and(is_recorded OR NOT is_declared) AND bool_or(is_recorded) AS is_whole,
        coalesce(bool_or(is_recorded) FILTER (event = 'ros2:rclcpp_intra_publish'), false)
            AS is_intra,
        coalesce(bool_or(is_recorded) FILTER (event = 'ros2:rclcpp_ring_buffer_dequeue'), false)
            AS is_dequeue,
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
-- Those among them whose pid and handles were used again: which life an event is of cannot be told.
mixed_process AS (
    SELECT DISTINCT host, pid
    FROM simulated_subscription
    SEMI JOIN unknown_process USING (host, pid)
    GROUP BY host, pid, subscription_handle
    HAVING count(*) > 1
),
-- Stamps that messages of several topics may share: only the topic tells them apart.
shared_stamp AS (
    SELECT source_timestamp_ns
    FROM simulated_publication
    GROUP BY source_timestamp_ns
    HAVING count(*) > 1
),
-- Processes of which a ring buffer event is missing.
unknown_buffer AS (
    SELECT DISTINCT host, pid
    FROM simulated_unrecorded
    WHERE event LIKE 'ros2:rclcpp%buffer%' OR event LIKE '%\_ipb%' ESCAPE '\'
),
-- Hosts whose clocks are too far apart from the start to tell messages by time, or too coarse.
far_host AS (
    SELECT host
    FROM simulated_publication
    WHERE rmw_ns IS NOT NULL
    GROUP BY host
    HAVING abs(min_by(source_timestamp_ns - rmw_ns, rmw_ns)) > 5_000_000
        OR count(DISTINCT source_timestamp_ns) < 0.99 * count(*)
),
-- Messages that another one of the topic resembles: by an equal stamp, or from another publisher at
-- nearly the same time.
twin AS (
    SELECT a.publication_id, bool_or(a.source_timestamp_ns = b.source_timestamp_ns) AS is_equal
    FROM simulated_publication AS a
    JOIN simulated_publication AS b
        ON a.topic_name = b.topic_name
        AND a.publication_id <> b.publication_id
        AND b.source_timestamp_ns BETWEEN a.source_timestamp_ns - 5_000_000
            AND a.source_timestamp_ns + 5_000_000
    WHERE a.source_timestamp_ns = b.source_timestamp_ns
        OR (a.publisher_handle, a.host, a.pid)
            IS DISTINCT FROM (b.publisher_handle, b.host, b.pid)
    GROUP BY a.publication_id
),
message AS (
    SELECT
        t.publication_id, t.take_id,
        CASE
            WHEN t.method = 'ring_buffer' THEN 'derive.link_transport_ring_buffer'
            WHEN is_rmw_stamped OR is_dds_stamped THEN 'derive.link_transport_exact'
            ELSE 'derive.link_transport_nearest'
        END AS needs,
        CASE
            -- A message that was kept for late subscriptions has no other event on its way there.
            WHEN t.method = 'ring_buffer' THEN p.is_intra AND r.is_dequeue AND NOT t.is_replay
            WHEN is_rmw_stamped THEN p.is_rmw_publish AND r.is_rmw_take
            WHEN is_dds_stamped THEN p.is_dds_write AND r.is_rmw_take
            ELSE p.is_rmw_publish AND r.is_rmw_take
        END
        AND (
            CASE
                WHEN t.method = 'ring_buffer' THEN
                    (t.take_host, t.take_pid) NOT IN (SELECT (host, pid) FROM unknown_buffer)
                WHEN is_rmw_stamped OR is_dds_stamped THEN
                    t.publication_id NOT IN (SELECT publication_id FROM twin WHERE is_equal)
                    AND (t.publication_host, t.publication_pid)
                        NOT IN (SELECT (host, pid) FROM mixed_process)
                    AND (t.take_host, t.take_pid) NOT IN (SELECT (host, pid) FROM mixed_process)
                    AND (
                        s.source_timestamp_ns NOT IN (FROM shared_stamp)
                        OR (
                            (t.publication_host, t.publication_pid)
                                NOT IN (SELECT (host, pid) FROM unknown_process)
                            AND (t.take_host, t.take_pid)
                                NOT IN (SELECT (host, pid) FROM unknown_process)
                        )
                    )
                ELSE t.publication_id NOT IN (SELECT publication_id FROM twin)
                    AND (t.publication_host, t.publication_pid)
                        NOT IN (SELECT (host, pid) FROM unknown_process)
                    AND (t.take_host, t.take_pid)
                        NOT IN (SELECT (host, pid) FROM unknown_process)
                    AND t.publication_host NOT IN (FROM far_host)
                    AND p.is_whole
            END
        ) AS is_decided
    FROM simulated_transport AS t
    CROSS JOIN layout
    JOIN recorded AS p ON p.kind = 'publication' AND t.publication_id::VARCHAR = p.id
    JOIN recorded AS r ON r.kind = 'take' AND t.take_id::VARCHAR = r.id
    JOIN simulated_publication AS s ON t.publication_id = s.publication_id
),
-- Nothing pairs across a gap: the next event that is missing on the host lies behind the callback,
-- and there is none where a callback does not end.
whole_callback AS (
    SELECT c.callback_instance_id::VARCHAR AS id
    FROM simulated_callback_instance AS c
    JOIN recorded AS r ON r.kind = 'callback_instance' AND c.callback_instance_id::VARCHAR = r.id
    ASOF LEFT JOIN (
        SELECT host, ts_ns FROM simulated_unrecorded WHERE cause <> 'late start'
    ) AS u ON c.host = u.host AND c.start_ns <= u.ts_ns
    WHERE r.is_whole
        AND (u.ts_ns IS NULL OR coalesce(u.ts_ns > c.end_ns, false))
        AND (c.host, c.pid) NOT IN (SELECT (host, pid) FROM mixed_process)
),
-- Which of several runs filled a cache is not in the trace. It is decided where the run that did
-- ended before the publishing one began, and (partial_sync) no other of its callback ran from its
-- start to the publication, or (periodic_async) ended after it and before the publishing one began.
doubtful AS (
    SELECT DISTINCT c.callback_instance_id, c.publication_id
    FROM simulated_causal AS c
    JOIN simulated_callback_instance AS i ON c.callback_instance_id = i.callback_instance_id
    JOIN simulated_publication AS b ON c.publication_id = b.publication_id
    JOIN simulated_callback_instance AS r ON b.callback_instance_id = r.callback_instance_id
    LEFT JOIN simulated_callback_instance AS o
        ON i.host = o.host AND i.pid = o.pid AND i.callback_handle = o.callback_handle
        AND i.callback_instance_id <> o.callback_instance_id
        AND CASE c.kind
            WHEN 'partial_sync' THEN
                coalesce(o.end_ns > i.start_ns, true) AND o.start_ns < b.rcl_ns
            ELSE o.end_ns > i.end_ns AND o.end_ns <= r.start_ns
        END
    WHERE c.kind IN ('periodic_async', 'partial_sync')
        AND (o.callback_instance_id IS NOT NULL OR coalesce(i.end_ns > r.start_ns, true))
),
-- Who is annotated says so once, and an input that is missing leaves an older one in its cache.
told AS (
    SELECT t.host, d.event
    FROM (SELECT DISTINCT host FROM simulated_trace) AS t
    CROSS JOIN (SELECT DISTINCT event FROM simulated_declared) AS d
    WHERE d.event LIKE 'ros2:message_link_%'
        AND t.host NOT IN (SELECT host FROM simulated_unrecorded)
)
SELECT
    'publication' AS kind, kind AS from_kind, id AS from_id, kind AS to_kind, id AS to_id,
    is_any AS is_decided, 'derive.link_transport' AS needs
FROM recorded
WHERE kind = 'publication'
UNION ALL
SELECT 'take', kind, id, kind, id, is_rmw_take OR is_dequeue, 'derive.link_transport'
FROM recorded
WHERE kind = 'take'
UNION ALL
SELECT 'callback_instance', kind, id, kind, id, is_start, 'derive.link_transport'
FROM recorded
WHERE kind = 'callback_instance'
UNION ALL
SELECT
    'callback_run', 'callback_instance', c.callback_instance_id::VARCHAR, 'callback_end',
    c.callback_instance_id::VARCHAR, w.id IS NOT NULL, 'derive.link_transport'
FROM simulated_callback_instance AS c
LEFT JOIN whole_callback AS w ON c.callback_instance_id::VARCHAR = w.id
WHERE c.end_ns IS NOT NULL
UNION ALL
SELECT
    'kind', 'callback_instance', c.callback_instance_id::VARCHAR, 'is_' || c.kind,
    c.callback_instance_id::VARCHAR,
    r.is_start AND (c.host, c.pid) NOT IN (SELECT (host, pid) FROM unknown_process),
    'derive.link_transport'
FROM simulated_callback_instance AS c
JOIN recorded AS r ON r.kind = 'callback_instance' AND c.callback_instance_id::VARCHAR = r.id
UNION ALL
SELECT
    'called_with', 'take', t.take_id::VARCHAR, 'callback_instance',
    c.callback_instance_id::VARCHAR, w.id IS NOT NULL AND t.is_whole, 'derive.link_transport'
FROM simulated_callback_instance AS c
JOIN (SELECT id AS take_id, is_whole FROM recorded WHERE kind = 'take') AS t
    ON c.take_id::VARCHAR = t.take_id
LEFT JOIN whole_callback AS w ON c.callback_instance_id::VARCHAR = w.id
UNION ALL
-- Those that end; whether they must be found is not judged.
SELECT
    'executor_state', 'state_start', concat_ws('/', host, pid, tid, start_ns), 'state_end',
    concat_ws('/', host, pid, tid, start_ns), false, 'derive.link_transport'
FROM simulated_executor_state
WHERE end_ns IS NOT NULL
UNION ALL
SELECT
    'transport', 'publication', publication_id::VARCHAR, 'take', take_id::VARCHAR, is_decided, needs
FROM message
UNION ALL
SELECT
    c.kind, 'callback_instance', c.callback_instance_id::VARCHAR, 'publication',
    c.publication_id::VARCHAR,
    w.id IS NOT NULL
    AND p.is_whole
    AND (
        c.kind NOT IN ('periodic_async', 'partial_sync')
        OR (c.host, 'ros2:message_link_' || c.kind) IN (SELECT (host, event) FROM told)
        AND (c.callback_instance_id, c.publication_id) NOT IN (
            SELECT (callback_instance_id, publication_id) FROM doubtful
        )
    ),
    'derive.link_causal_' || c.kind
FROM simulated_causal AS c
JOIN recorded AS p ON p.kind = 'publication' AND c.publication_id::VARCHAR = p.id
LEFT JOIN whole_callback AS w ON c.callback_instance_id::VARCHAR = w.id
WHERE c.callback_instance_id IS NOT NULL
UNION ALL
SELECT
    c.kind, 'take', c.take_id::VARCHAR, 'publication', c.publication_id::VARCHAR,
    -- That nothing came in between is sure only where nothing of the host is missing.
    t.is_whole AND p.is_whole AND c.host NOT IN (
        SELECT host FROM simulated_unrecorded WHERE cause <> 'late start'
    ),
    'derive.link_causal_' || c.kind
FROM simulated_causal AS c
JOIN recorded AS p ON p.kind = 'publication' AND c.publication_id::VARCHAR = p.id
JOIN recorded AS t ON t.kind = 'take' AND c.take_id::VARCHAR = t.id
WHERE c.callback_instance_id IS NULL
UNION ALL
SELECT
    split_part(s.kind, '_', 1), s.kind, s.id, t.kind, t.id, s.is_any AND t.is_any,
    'derive.' || split_part(s.kind, '_', 1)
FROM recorded AS s
JOIN recorded AS t
    ON s.kind IN ('request_sent', 'response_sent') AND t.kind = replace(s.kind, 'sent', 'taken')
    AND s.id = t.id
UNION ALL
SELECT
    'link_request', 'callback_instance', q.sender_callback_instance_id::VARCHAR, 'request_sent',
    s.id, s.is_any AND w.id IS NOT NULL, 'derive.link_request'
FROM simulated_request AS q
JOIN recorded AS s ON s.kind = 'request_sent' AND q.request_id::VARCHAR = s.id
LEFT JOIN whole_callback AS w ON q.sender_callback_instance_id::VARCHAR = w.id
WHERE q.sender_callback_instance_id IS NOT NULL
UNION ALL
SELECT
    'link_response', 'callback_instance', q.callback_instance_id::VARCHAR, 'response_sent', s.id,
    s.is_any AND t.is_any AND w.id IS NOT NULL, 'derive.link_response'
FROM simulated_request AS q
JOIN recorded AS s ON s.kind = 'response_sent' AND q.request_id::VARCHAR = s.id
JOIN recorded AS t ON t.kind = 'request_taken' AND q.request_id::VARCHAR = t.id
LEFT JOIN whole_callback AS w ON q.callback_instance_id::VARCHAR = w.id;

-- Messages that a subscription did not take, where the publication is in the trace. An address may
-- have been that of several subscriptions: `life` says the how manieth had it. `undecided` says why
-- the trace does not decide the reason, NULL where it does. A trace shows what was taken, and of
-- everything else only what follows from that: when the two were connected shows by the first
-- message that was taken, that a message is not merely late by one after it.
CREATE OR REPLACE TEMP TABLE truth_drop AS
WITH life AS (
    SELECT
        subscription_id, host, pid, subscription_handle, created_ns,
        row_number() OVER (
            PARTITION BY host, pid, subscription_handle ORDER BY created_ns
        ) AS life
    FROM simulated_subscription
),
-- Subscriptions that ended before others of their process.
outlived AS (
    SELECT DISTINCT s.subscription_id
    FROM simulated_subscription AS s
    JOIN simulated_subscription AS o
        ON s.host = o.host AND s.pid = o.pid AND o.created_ns <= s.ended_ns
        AND (o.ended_ns IS NULL OR o.ended_ns > s.ended_ns)
),
-- What was taken, as far as the trace tells which message it was.
taken AS (
    SELECT
        t.subscription_id, p.host, p.pid, p.publisher_handle,
        min(p.source_timestamp_ns) AS first_stamp_ns,
        max(p.source_timestamp_ns) AS last_stamp_ns
    FROM truth_link AS l
    JOIN simulated_take AS t ON l.to_id = t.take_id::VARCHAR
    JOIN simulated_publication AS p ON l.from_id = p.publication_id::VARCHAR
    WHERE l.kind = 'transport' AND l.is_decided
    GROUP BY ALL
),
of_publisher AS (
    SELECT
        subscription_id, host, pid, publisher_handle,
        min(first_stamp_ns) AS first_stamp_ns, max(last_stamp_ns) AS last_stamp_ns
    FROM taken
    GROUP BY ALL
),
of_any AS (
    SELECT subscription_id, max(last_stamp_ns) AS last_stamp_ns FROM taken GROUP BY ALL
),
equal_stamp AS (
    SELECT topic_name, source_timestamp_ns
    FROM simulated_publication
    GROUP BY ALL
    HAVING count(*) > 1
),
-- How the clocks of two hosts are apart, and how long messages are on their way, where the trace
-- tells it.
way AS (
    SELECT
        t.publication_host, t.take_host,
        median(t.take_rmw_ns - t.publication_rmw_ns - t.latency_ns) AS apart_ns,
        max(t.latency_ns) AS longest_ns
    FROM truth_link AS l
    JOIN simulated_transport AS t
        ON l.from_id = t.publication_id::VARCHAR AND l.to_id = t.take_id::VARCHAR
    WHERE l.kind = 'transport' AND l.is_decided
    GROUP BY ALL
),
lost AS (
    SELECT DISTINCT host FROM simulated_unrecorded WHERE cause <> 'late start'
),
unnamed AS (
    SELECT DISTINCT host, pid FROM simulated_unrecorded WHERE event LIKE '%\_init' ESCAPE '\'
)
SELECT
    u.publication_id::VARCHAR AS publication_id, s.host, s.pid, s.subscription_handle, s.life,
    u.reason, u.is_internal,
    p.host IN (FROM lost) OR s.host IN (FROM lost) AS is_spoilt,
    CASE
        WHEN (p.host, p.pid) IN (SELECT (host, pid) FROM unnamed)
            OR (s.host, s.pid) IN (SELECT (host, pid) FROM unnamed)
            THEN 'initialisation is missing'
        WHEN q.topic_name IS NOT NULL THEN 'another message has its stamp'
        WHEN u.reason = 'before_subscription' THEN CASE
            WHEN p.host <> s.host AND w.apart_ns IS NULL THEN 'clocks are apart'
            WHEN p.host <> s.host
                AND coalesce(p.rmw_ns, p.rcl_ns) + w.apart_ns + w.longest_ns >= s.created_ns
                THEN 'clocks are apart'
        END
        WHEN u.reason = 'overwritten' THEN CASE
            WHEN a.last_stamp_ns > p.source_timestamp_ns IS NOT TRUE THEN 'nothing later taken'
            WHEN b.first_stamp_ns < p.source_timestamp_ns IS NOT TRUE THEN 'nothing earlier taken'
        END
        WHEN u.reason IN ('lost_in_transport', 'take_failed') THEN CASE
            WHEN b.last_stamp_ns > p.source_timestamp_ns IS NOT TRUE THEN 'nothing later taken'
            WHEN b.first_stamp_ns < p.source_timestamp_ns IS NOT TRUE THEN 'nothing earlier taken'
        END
        WHEN u.reason = 'before_discovery' THEN CASE
            WHEN b.last_stamp_ns > p.source_timestamp_ns IS NOT TRUE THEN 'nothing later taken'
        END
        WHEN u.reason = 'expired' THEN 'no event of expiry'
        -- That its process ends shows.
        WHEN u.reason = 'subscription_ended' THEN CASE
            WHEN s.subscription_id IN (FROM outlived)
                THEN 'no event of destruction'
        END
        ELSE 'trace ends'
    END AS undecided
FROM simulated_undelivered AS u
JOIN simulated_publication AS p ON u.publication_id = p.publication_id
JOIN life AS s ON u.subscription_id = s.subscription_id
JOIN truth_link AS l ON l.kind = 'publication' AND u.publication_id::VARCHAR = l.from_id
LEFT JOIN of_publisher AS b
    ON u.subscription_id = b.subscription_id AND p.host = b.host AND p.pid = b.pid
    AND p.publisher_handle IS NOT DISTINCT FROM b.publisher_handle
LEFT JOIN of_any AS a ON u.subscription_id = a.subscription_id
LEFT JOIN way AS w ON p.host = w.publication_host AND s.host = w.take_host
LEFT JOIN equal_stamp AS q
    ON p.topic_name = q.topic_name AND p.source_timestamp_ns = q.source_timestamp_ns
WHERE l.is_decided;

-- Processes of which it cannot be told which of their subscriptions had a handle.
CREATE OR REPLACE TEMP TABLE truth_mixed AS
SELECT DISTINCT host, pid
FROM simulated_subscription
SEMI JOIN (
    SELECT host, pid FROM simulated_unrecorded WHERE event LIKE '%\_init' ESCAPE '\'
) AS u USING (host, pid)
GROUP BY host, pid, subscription_handle
HAVING count(*) > 1;

-- Messages that a subscription did take, and why the event of that is not in the trace, if it is
-- not. Copies of messages that come through a ring buffer as well are no deliveries.
CREATE OR REPLACE TEMP TABLE truth_delivery AS
WITH life AS (
    SELECT
        subscription_id, host, pid, subscription_handle,
        row_number() OVER (
            PARTITION BY host, pid, subscription_handle ORDER BY created_ns
        ) AS life
    FROM simulated_subscription
)
SELECT
    t.publication_id::VARCHAR AS publication_id, s.host, s.pid, s.subscription_handle, s.life,
    coalesce(any_value(u.cause), 'recorded') AS cause
FROM simulated_take AS t
JOIN life AS s ON t.subscription_id = s.subscription_id
LEFT JOIN simulated_unrecorded AS u
    ON t.host = u.host AND t.pid = u.pid AND t.tid = u.tid
    AND u.ts_ns = coalesce(t.dequeue_ns, t.rmw_ns)
WHERE t.method <> 'rmw'
    OR (t.publication_id, t.subscription_id) NOT IN (
        SELECT (publication_id, subscription_id) FROM simulated_take WHERE method = 'ring_buffer'
    )
GROUP BY ALL;

-- What became of the events that would tell each take its publication.
CREATE OR REPLACE TEMP TABLE truth_origin AS
WITH layout AS (
    SELECT
        coalesce(bool_or(event = 'dds:write' AND field = 'timestamp'), false)
        AND NOT coalesce(bool_or(event = 'ros2:rmw_publish' AND field = 'timestamp'), false)
            AS is_dds_stamped
    FROM simulated_declared
),
written AS (
    SELECT publication_id, max(ts_ns) AS ts_ns
    FROM simulated_dds_event
    WHERE event = 'dds:write'
    GROUP BY publication_id
),
sent AS (
    SELECT
        p.publication_id, p.host, p.pid, p.tid, p.intra_ns,
        CASE WHEN l.is_dds_stamped THEN w.ts_ns ELSE p.rmw_ns END AS stamped_ns
    FROM simulated_publication AS p
    CROSS JOIN layout AS l
    LEFT JOIN written AS w ON p.publication_id = w.publication_id
),
decided AS (
    SELECT to_id, bool_or(is_decided) AS is_decided
    FROM truth_link
    WHERE kind = 'transport'
    GROUP BY to_id
)
SELECT
    t.take_id::VARCHAR AS take_id,
    CASE
        WHEN t.method = 'callback_only' THEN 'no event'
        WHEN x.is_replay AND t.method = 'ring_buffer' THEN 'kept'
        WHEN k.cause IS NOT NULL THEN concat('taken, ', k.cause)
        WHEN u.cause IS NOT NULL THEN concat('sent, ', u.cause)
        ELSE 'recorded'
    END AS truth,
    CASE
        WHEN k.cause IS NULL AND u.cause IS NULL AND t.method <> 'callback_only'
            AND NOT d.is_decided
            THEN 'the link is not decided'
    END AS undecided
FROM simulated_take AS t
JOIN simulated_transport AS x ON t.take_id = x.take_id
JOIN sent AS s ON t.publication_id = s.publication_id
LEFT JOIN decided AS d ON t.take_id::VARCHAR = d.to_id
LEFT JOIN simulated_unrecorded AS k
    ON t.host = k.host AND t.pid = k.pid AND t.tid = k.tid AND t.rmw_ns = k.ts_ns
    AND k.event = 'ros2:rmw_take'
LEFT JOIN simulated_unrecorded AS u
    ON s.host = u.host AND s.pid = u.pid AND s.tid = u.tid
    AND u.ts_ns = CASE WHEN t.method = 'ring_buffer' THEN s.intra_ns ELSE s.stamped_ns END
    AND u.event IN ('ros2:rmw_publish', 'dds:write', 'ros2:rclcpp_intra_publish');
