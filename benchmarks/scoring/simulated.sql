-- What is true of a simulation, from its truth tables (the views simulated_…): which events each
-- instance has, which links there are, and which of them the recorded trace decides.

-- On which CPU what happened.
CREATE OR REPLACE TEMP TABLE truth_emitted AS
SELECT host, pid, tid, ts_ns, any_value(cpu) AS cpu FROM simulated_emitted GROUP BY ALL;

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
    UNION ALL
    SELECT 'user_event', user_event_id, host, pid, tid, name, at_ns
    FROM simulated_user_event
),
declared AS (
    SELECT DISTINCT event FROM simulated_declared
)
SELECT
    h.kind, h.id::VARCHAR AS id, h.host, h.pid, h.tid, e.cpu, h.event, h.ts_ns,
    d.event IS NOT NULL AS is_declared,
    d.event IS NOT NULL AND u.ts_ns IS NULL AS is_recorded
FROM happened AS h
LEFT JOIN declared AS d ON h.event = d.event
LEFT JOIN truth_emitted AS e
    ON h.host = e.host AND h.pid = e.pid AND h.tid = e.tid AND h.ts_ns = e.ts_ns
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
    -- In containers with one hostname and equal ids, one may end when another one starts.
    SELECT kind, id, host, pid, tid, ts_ns
    FROM truth_event
    QUALIFY event <> 'ros2:callback_end'
        OR count(*) OVER (PARTITION BY kind, host, pid, tid, ts_ns) = 1
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
-- What lay in a ring buffer while events were missing: others may have gone through its place.
doubtful_buffer AS (
    SELECT DISTINCT t.take_id
    FROM simulated_transport AS t
    JOIN truth_hole AS h
        ON t.take_host = h.host
        AND t.publication_intra_ns < h.end_ns AND t.take_dequeue_ns > h.begin_ns
    WHERE t.method = 'ring_buffer' AND coalesce(t.take_pid = h.pid, true)
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
-- When each message was stamped after it was written, and whether events of the host were missing
-- until its thread went on, as far as the trace shows: it may have written another message meanwhile.
stamped AS (
    SELECT
        p.publication_id, p.host, p.pid, p.publisher_handle, p.delay_ns, e.ts_ns AS next_ns,
        count(h.host) > 0 AS is_torn
    FROM (
        SELECT
            publication_id, host, pid, tid, publisher_handle, rmw_ns,
            source_timestamp_ns - rmw_ns - min(source_timestamp_ns - rmw_ns) OVER (
                PARTITION BY host
            ) AS delay_ns
        FROM simulated_publication
        WHERE publication_id IN (SELECT publication_id FROM simulated_transport)
    ) AS p
    ASOF LEFT JOIN truth_recorded AS e
        ON p.host = e.host AND p.pid = e.pid AND p.tid = e.tid AND p.rmw_ns < e.ts_ns
    LEFT JOIN (FROM truth_hole ANTI JOIN truth_unseen_cpu USING (host, cpu)) AS h
        ON p.host = h.host AND coalesce(p.pid = h.pid, true)
        AND p.rmw_ns < h.end_ns AND greatest(e.ts_ns, p.rmw_ns + p.delay_ns) > h.begin_ns
    GROUP BY ALL
),
-- Then only what is usual tells which one a message is of: of the publisher where that is known, else
-- of the host.
torn_stamp AS (
    SELECT publication_id
    FROM (
        SELECT
            publication_id, delay_ns, is_torn,
            quantile_disc(delay_ns, 0.99) FILTER (next_ns IS NOT NULL AND NOT is_torn) OVER (
                PARTITION BY host, pid, publisher_handle
            ) AS own_ns,
            quantile_disc(delay_ns, 0.99) FILTER (next_ns IS NOT NULL AND NOT is_torn) OVER (
                PARTITION BY host
            ) AS usual_ns
        FROM stamped
    )
    WHERE is_torn AND delay_ns > coalesce(own_ns, usual_ns, 5_000_000)
),
-- Messages that another one of the topic resembles: by an equal stamp, or from another publisher or
-- thread at nearly the same time.
twin AS (
    SELECT a.publication_id, bool_or(a.source_timestamp_ns = b.source_timestamp_ns) AS is_equal
    FROM simulated_publication AS a
    JOIN simulated_publication AS b
        ON a.topic_name = b.topic_name
        AND a.publication_id <> b.publication_id
        AND b.source_timestamp_ns BETWEEN a.source_timestamp_ns - 5_000_000
            AND a.source_timestamp_ns + 5_000_000
    WHERE a.source_timestamp_ns = b.source_timestamp_ns
        OR (a.publisher_handle, a.host, a.pid, a.tid)
            IS DISTINCT FROM (b.publisher_handle, b.host, b.pid, b.tid)
    GROUP BY a.publication_id
),
-- Or it was stamped while another thread wrote as well, as far as the trace shows: threads of rclpy
-- have no event until they look for the next message. Of a look in vain the truth knows nothing:
-- the last publication of a thread may go on for as long as its process.
rivalled AS (
    SELECT DISTINCT a.publication_id
    FROM simulated_publication AS a
    JOIN (
        SELECT p.topic_name, p.host, p.pid, p.tid, p.rmw_ns, e.ts_ns AS next_ns
        FROM simulated_publication AS p
        ASOF LEFT JOIN (FROM truth_event WHERE is_recorded) AS e
            ON p.host = e.host AND p.pid = e.pid AND p.tid = e.tid AND p.rmw_ns < e.ts_ns
    ) AS b
        ON a.topic_name = b.topic_name
        AND a.host = b.host
        AND (a.pid, a.tid) IS DISTINCT FROM (b.pid, b.tid)
        AND a.rmw_ns >= b.rmw_ns
        AND coalesce(a.rmw_ns <= b.next_ns, a.pid = b.pid)
),
asked AS (
    SELECT
        t.publication_id, t.take_id, t.publication_host,
        CASE
            WHEN t.method = 'ring_buffer' THEN 'derive.link_transport_ring_buffer'
            WHEN u.is_stamped THEN 'derive.link_transport_exact'
            ELSE 'derive.link_transport_nearest'
        END AS needs,
        CASE
            -- A message that was kept for late subscriptions has no other event on its way there.
            WHEN t.method = 'ring_buffer' THEN p.is_intra AND r.is_dequeue AND NOT t.is_replay
            WHEN u.is_stamped AND is_rmw_stamped THEN p.is_rmw_publish AND r.is_rmw_take
            WHEN u.is_stamped THEN p.is_dds_write AND r.is_rmw_take
            ELSE p.is_whole AND r.is_rmw_take
        END
        AND (
            CASE
                WHEN t.method = 'ring_buffer' THEN
                    t.take_id NOT IN (SELECT take_id FROM doubtful_buffer)
                WHEN u.is_stamped THEN
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
                    AND t.publication_id NOT IN (FROM rivalled)
                    AND (t.publication_host, t.publication_pid)
                        NOT IN (SELECT (host, pid) FROM unknown_process)
                    AND (t.take_host, t.take_pid)
                        NOT IN (SELECT (host, pid) FROM unknown_process)
                    AND t.publication_host NOT IN (FROM far_host)
                    AND t.publication_id NOT IN (FROM torn_stamp)
            END
        ) AS is_decided
    FROM simulated_transport AS t
    CROSS JOIN layout
    JOIN recorded AS p ON p.kind = 'publication' AND t.publication_id::VARCHAR = p.id
    JOIN recorded AS r ON r.kind = 'take' AND t.take_id::VARCHAR = r.id
    JOIN simulated_publication AS s ON t.publication_id = s.publication_id
    -- A message that was written to channels has no rmw_publish, and no stamp in the trace.
    CROSS JOIN LATERAL (
        SELECT
            (is_rmw_stamped OR is_dds_stamped) AND (s.rmw_ns IS NOT NULL OR s.rcl_ns IS NULL)
                AS is_stamped
    ) AS u
),
-- Time alone joins messages in groups: fewer messages of a host than these may agree by chance.
message AS (
    SELECT
        publication_id, take_id, needs,
        is_decided AND (
            needs <> 'derive.link_transport_nearest'
            OR count(*) FILTER (is_decided) OVER (PARTITION BY publication_host, needs) >= 8
        ) AS is_decided
    FROM asked
),
-- Nothing pairs across a gap: no hole of the CPUs on which the thread was seen while a callback
-- ran, or of its process, lies within it; nor any behind its start, where it is not seen to end.
visited AS (
    SELECT DISTINCT c.callback_instance_id, c.host, c.pid, c.start_ns, c.end_ns, e.cpu
    FROM simulated_callback_instance AS c
    JOIN truth_recorded AS e
        ON c.host = e.host AND c.pid = e.pid AND c.tid = e.tid
        AND e.ts_ns BETWEEN c.start_ns AND coalesce(c.end_ns, c.start_ns)
),
torn_callback AS (
    SELECT DISTINCT c.callback_instance_id
    FROM visited AS c
    JOIN truth_hole AS h
        ON c.host = h.host AND coalesce(c.pid = h.pid, true)
        AND (c.end_ns IS NULL OR coalesce(c.cpu = h.cpu, true))
        AND c.start_ns < h.end_ns AND coalesce(c.end_ns, 9223372036854775807) > h.begin_ns
),
whole_callback AS (
    SELECT c.callback_instance_id::VARCHAR AS id
    FROM simulated_callback_instance AS c
    JOIN recorded AS r ON r.kind = 'callback_instance' AND c.callback_instance_id::VARCHAR = r.id
    WHERE r.is_whole
        AND c.callback_instance_id NOT IN (FROM torn_callback)
        AND (c.host, c.pid) NOT IN (SELECT (host, pid) FROM mixed_process)
),
-- What else may have happened between cause and publication.
doubtful_cause AS (
    SELECT DISTINCT c.callback_instance_id, c.take_id, c.publication_id
    FROM simulated_causal AS c
    JOIN truth_hole AS h
        ON c.host = h.host AND coalesce(c.pid = h.pid, true)
        AND coalesce(c.callback_start_ns, c.take_rmw_ns) < h.end_ns
        AND coalesce(c.publication_rmw_ns, c.publication_rcl_ns) > h.begin_ns
    WHERE c.kind <> 'direct'
),
-- Which of several callback instances filled a cache is not in the trace, nor when it was read. It
-- is decided where the one that did ended before the publishing one began, and no other of its
-- callback ran from its start to the publication.
doubtful AS (
    SELECT DISTINCT c.callback_instance_id, c.publication_id
    FROM simulated_causal AS c
    JOIN simulated_callback_instance AS i ON c.callback_instance_id = i.callback_instance_id
    JOIN simulated_publication AS b ON c.publication_id = b.publication_id
    JOIN simulated_callback_instance AS r ON b.callback_instance_id = r.callback_instance_id
    LEFT JOIN simulated_callback_instance AS o
        ON i.host = o.host AND i.pid = o.pid AND i.callback_handle = o.callback_handle
        AND i.callback_instance_id <> o.callback_instance_id
        AND coalesce(o.end_ns > i.start_ns, true) AND o.start_ns < b.rcl_ns
    WHERE c.kind IN ('periodic_async', 'partial_sync')
        AND (o.callback_instance_id IS NOT NULL OR coalesce(i.end_ns > r.start_ns, true))
    UNION
    -- What came while another run emptied the caches may have been used by that one.
    SELECT c.callback_instance_id, c.publication_id
    FROM simulated_causal AS c
    JOIN simulated_callback_instance AS i ON c.callback_instance_id = i.callback_instance_id
    JOIN simulated_publication AS b ON c.publication_id = b.publication_id
    JOIN simulated_publication AS e
        ON b.host = e.host AND b.pid = e.pid AND b.topic_name = e.topic_name
        AND b.callback_instance_id <> e.callback_instance_id
        AND e.rcl_ns BETWEEN i.start_ns AND b.rcl_ns
    JOIN simulated_callback_instance AS r ON e.callback_instance_id = r.callback_instance_id
    WHERE c.kind = 'partial_sync' AND r.start_ns < i.end_ns
),
-- A message that is missing may change a set, and the set after it.
doubtful_set AS (
    SELECT DISTINCT c.publication_id
    FROM (
        SELECT
            host, pid, publication_id,
            max(coalesce(publication_rmw_ns, publication_rcl_ns)) AS end_ns,
            lag(min(callback_start_ns), 4) OVER (
                PARTITION BY host, pid, topic_name ORDER BY publication_id
            ) AS start_ns
        FROM simulated_causal
        WHERE kind = 'approximate_sync'
        GROUP BY host, pid, topic_name, publication_id
    ) AS c
    JOIN truth_hole AS h
        ON c.host = h.host AND coalesce(c.pid = h.pid, true)
        AND coalesce(c.start_ns < h.end_ns, true) AND c.end_ns > h.begin_ns
),
-- What threads sent after they took a request or response, in no callback.
call AS (
    SELECT
        row_number() OVER () AS id,
        CASE WHEN is_response THEN 'response_taken' ELSE 'request_taken' END AS taken_kind,
        request_id::VARCHAR AS taken_id,
        CASE
            WHEN publication_id IS NOT NULL THEN 'publication'
            WHEN sent_request_id IS NOT NULL THEN 'request_sent'
            ELSE 'response_sent'
        END AS sent_kind,
        coalesce(publication_id, sent_request_id, answered_request_id)::VARCHAR AS sent_id
    FROM simulated_link_call
),
doubtful_call AS (
    SELECT DISTINCT c.id
    FROM call AS c
    JOIN truth_event AS t ON c.taken_kind = t.kind AND c.taken_id = t.id
    JOIN truth_event AS e ON c.sent_kind = e.kind AND c.sent_id = e.id
    JOIN truth_hole AS h
        ON e.host = h.host AND coalesce(e.pid = h.pid, true)
        AND t.ts_ns < h.end_ns AND e.ts_ns > h.begin_ns
),
-- Goals of actions, from the answer to the request for the result on the side of the client, and to
-- the result at the server.
goal AS (
    SELECT
        g.*, q.service_name, q.client_handle, q.client_pid, q.client_host,
        q.service_host, q.service_pid, a.taken_ns AS answer_taken_ns, a.sent_ns AS answered_ns,
        k.sent_ns AS asked_ns, r.sent_ns AS result_sent_ns
    FROM simulated_goal AS g
    JOIN simulated_request AS q ON g.goal_id = q.request_id
    LEFT JOIN simulated_response AS a ON g.goal_id = a.request_id
    LEFT JOIN simulated_request AS k ON g.result_request_id = k.request_id
    LEFT JOIN simulated_response AS r ON g.result_request_id = r.request_id
),
-- What is said of goals needs all of the trace. Others of the client, which had not asked, or of the
-- server are in doubt.
doubtful_goal AS (
    SELECT
        g.goal_id,
        bool_or(
            g.client_handle = o.client_handle AND g.client_host = o.client_host
            AND g.client_pid = o.client_pid AND o.answer_taken_ns < coalesce(g.asked_ns, 0)
            AND coalesce(o.asked_ns > g.answer_taken_ns, true)
            AND g.result_request_id NOT IN (
                SELECT sent_request_id FROM simulated_link_call WHERE sent_request_id IS NOT NULL
            )
        ) AS is_result_doubtful,
        bool_or(
            coalesce(o.answered_ns < g.result_sent_ns, true)
            AND coalesce(o.result_sent_ns > g.answered_ns, true)
        ) AS is_message_doubtful
    FROM goal AS g
    JOIN goal AS o
        ON g.goal_id <> o.goal_id AND g.service_name = o.service_name AND o.is_accepted
    GROUP BY g.goal_id
),
-- The first and the last message of feedback, and the status where it is cancelled.
goal_message AS (
    SELECT
        m.goal_id, m.publication_id,
        m.publication_id IN (
            min(m.publication_id) OVER (PARTITION BY m.goal_id, b.topic_name),
            max(m.publication_id) OVER (PARTITION BY m.goal_id, b.topic_name)
        ) AS is_outer,
        b.topic_name LIKE '%/feedback' AS is_feedback
    FROM simulated_goal_message AS m
    JOIN simulated_publication AS b ON m.publication_id = b.publication_id
),
-- Ends of states, with the CPU.
ended_state AS (
    SELECT s.host, s.pid, s.tid, s.start_ns, s.end_ns, e.cpu
    FROM simulated_executor_state AS s
    JOIN truth_emitted AS e
        ON s.host = e.host AND s.pid = e.pid AND s.tid = e.tid AND s.end_ns = e.ts_ns
),
moved_state AS (
    FROM ended_state
    QUALIFY cpu IS DISTINCT FROM lag(cpu) OVER (PARTITION BY host, pid, tid ORDER BY start_ns)
),
-- Who is annotated says so once, by handles.
untold_process AS (
    FROM unknown_process
    UNION
    SELECT host, pid FROM simulated_unrecorded WHERE event LIKE 'ros2:message_link_%'
)
SELECT
    'publication' AS kind, kind AS from_kind, id AS from_id, kind AS to_kind, id AS to_id,
    is_any AS is_decided, NULL::VARCHAR AS needs
FROM recorded
WHERE kind = 'publication'
UNION ALL
SELECT 'take', kind, id, kind, id, is_rmw_take OR is_dequeue, NULL
FROM recorded
WHERE kind = 'take'
UNION ALL
SELECT 'callback_instance', kind, id, kind, id, is_start, NULL
FROM recorded
WHERE kind = 'callback_instance'
UNION ALL
SELECT
    'callback_run', 'callback_instance', c.callback_instance_id::VARCHAR, 'callback_end',
    c.callback_instance_id::VARCHAR, w.id IS NOT NULL, NULL
FROM simulated_callback_instance AS c
LEFT JOIN whole_callback AS w ON c.callback_instance_id::VARCHAR = w.id
WHERE c.end_ns IS NOT NULL
UNION ALL
SELECT
    'kind', 'callback_instance', c.callback_instance_id::VARCHAR, 'is_' || c.kind,
    c.callback_instance_id::VARCHAR,
    r.is_start AND (c.host, c.pid) NOT IN (SELECT (host, pid) FROM unknown_process),
    NULL
FROM simulated_callback_instance AS c
JOIN recorded AS r ON r.kind = 'callback_instance' AND c.callback_instance_id::VARCHAR = r.id
UNION ALL
SELECT
    'called_with', 'take', t.take_id::VARCHAR, 'callback_instance',
    c.callback_instance_id::VARCHAR, w.id IS NOT NULL AND t.is_whole, NULL
FROM simulated_callback_instance AS c
JOIN (SELECT id AS take_id, is_whole FROM recorded WHERE kind = 'take') AS t
    ON c.take_id::VARCHAR = t.take_id
LEFT JOIN whole_callback AS w ON c.callback_instance_id::VARCHAR = w.id
UNION ALL
-- Those that end; whether they must be found is not judged.
SELECT
    'executor_state', 'state_start', concat_ws('/', host, pid, tid, start_ns), 'state_end',
    concat_ws('/', host, pid, tid, start_ns), false, NULL
FROM simulated_executor_state
WHERE end_ns IS NOT NULL
UNION ALL
-- A state on a CPU that the trace does not show lasts until the thread is seen elsewhere.
SELECT
    'executor_state', 'state_start', concat_ws('/', s.host, s.pid, s.tid, s.start_ns), 'state_end',
    concat_ws('/', m.host, m.pid, m.tid, m.start_ns), false, NULL
FROM ended_state AS s
SEMI JOIN truth_unseen_cpu AS u ON s.host = u.host AND s.cpu = u.cpu
ASOF JOIN moved_state AS m
    ON s.host = m.host AND s.pid = m.pid AND s.tid = m.tid AND s.end_ns < m.end_ns
UNION ALL
SELECT
    'transport', 'publication', publication_id::VARCHAR, 'take', take_id::VARCHAR, is_decided, needs
FROM message
UNION ALL
-- Where it is known that a filter published the message, its trigger is no cause.
SELECT
    CASE c.kind WHEN 'triggered' THEN 'direct' ELSE c.kind END, 'callback_instance',
    c.callback_instance_id::VARCHAR, 'publication', c.publication_id::VARCHAR,
    w.id IS NOT NULL
    AND p.is_whole
    AND (
        c.kind <> 'triggered'
        OR 'ros2:message_link_approximate_sync' NOT IN (SELECT event FROM simulated_declared)
    )
    AND (
        c.kind NOT IN ('periodic_async', 'partial_sync', 'approximate_sync')
        OR 'ros2:message_link_' || c.kind IN (SELECT event FROM simulated_declared)
        AND (c.host, c.pid) NOT IN (SELECT (host, pid) FROM untold_process)
        AND (c.callback_instance_id, c.publication_id) NOT IN (
            SELECT (callback_instance_id, publication_id) FROM doubtful
        )
        AND NOT (
            c.kind = 'approximate_sync'
            AND c.publication_id IN (SELECT publication_id FROM doubtful_set)
        )
        AND (c.callback_instance_id, c.publication_id) NOT IN (
            SELECT (callback_instance_id, publication_id)
            FROM doubtful_cause
            WHERE callback_instance_id IS NOT NULL
        )
    ),
    NULL
FROM simulated_causal AS c
JOIN recorded AS p ON p.kind = 'publication' AND c.publication_id::VARCHAR = p.id
LEFT JOIN whole_callback AS w ON c.callback_instance_id::VARCHAR = w.id
WHERE c.callback_instance_id IS NOT NULL
UNION ALL
SELECT
    c.kind, 'take', c.take_id::VARCHAR, 'publication', c.publication_id::VARCHAR,
    -- That nothing came in between is sure only where nothing of the host is missing meanwhile.
    t.is_whole AND p.is_whole AND (c.take_id, c.publication_id) NOT IN (
        SELECT (take_id, publication_id) FROM doubtful_cause WHERE callback_instance_id IS NULL
    ),
    NULL
FROM simulated_causal AS c
JOIN recorded AS p ON p.kind = 'publication' AND c.publication_id::VARCHAR = p.id
JOIN recorded AS t ON t.kind = 'take' AND c.take_id::VARCHAR = t.id
WHERE c.callback_instance_id IS NULL
UNION ALL
SELECT 'user_event', kind, id, kind, id, is_any, NULL
FROM recorded
WHERE kind = 'user_event'
UNION ALL
SELECT
    'recorded_in', 'callback_instance', u.callback_instance_id::VARCHAR, 'user_event',
    u.user_event_id::VARCHAR, r.is_any AND w.id IS NOT NULL, NULL
FROM simulated_user_event AS u
JOIN recorded AS r ON r.kind = 'user_event' AND u.user_event_id::VARCHAR = r.id
LEFT JOIN whole_callback AS w ON u.callback_instance_id::VARCHAR = w.id
WHERE u.callback_instance_id IS NOT NULL
UNION ALL
-- What a thread turned to before or meanwhile may be missing.
SELECT
    'link_call', t.kind, t.id, e.kind, e.id,
    t.is_whole AND e.is_whole AND c.id NOT IN (SELECT id FROM doubtful_call), NULL
FROM call AS c
JOIN recorded AS t ON c.taken_kind = t.kind AND c.taken_id = t.id
JOIN recorded AS e ON c.sent_kind = e.kind AND c.sent_id = e.id
UNION ALL
SELECT
    CASE WHEN g.is_accepted THEN 'goal_accepted' ELSE 'goal_rejected' END, s.kind, s.id, t.kind,
    t.id, s.is_any AND t.is_any AND NOT EXISTS (FROM truth_hole), NULL
FROM goal AS g
JOIN recorded AS s ON s.kind = 'request_sent' AND g.goal_id::VARCHAR = s.id
JOIN recorded AS t ON t.kind = 'request_taken' AND g.goal_id::VARCHAR = t.id
WHERE g.is_accepted IS NOT NULL
UNION ALL
SELECT
    'goal_result', s.kind, s.id, t.kind, t.id,
    s.is_any AND t.is_any AND NOT EXISTS (FROM truth_hole)
    AND NOT coalesce(d.is_result_doubtful, false),
    NULL
FROM goal AS g
JOIN recorded AS s ON s.kind = 'request_sent' AND g.goal_id::VARCHAR = s.id
JOIN recorded AS t ON t.kind = 'request_sent' AND g.result_request_id::VARCHAR = t.id
LEFT JOIN doubtful_goal AS d ON g.goal_id = d.goal_id
UNION ALL
SELECT
    'goal_message', s.kind, s.id, t.kind, t.id,
    s.is_any AND t.is_any AND m.is_feedback AND m.is_outer AND NOT EXISTS (FROM truth_hole)
    AND NOT coalesce(d.is_message_doubtful, false),
    NULL
FROM goal_message AS m
JOIN recorded AS s ON s.kind = 'request_sent' AND m.goal_id::VARCHAR = s.id
JOIN recorded AS t ON t.kind = 'publication' AND m.publication_id::VARCHAR = t.id
LEFT JOIN doubtful_goal AS d ON m.goal_id = d.goal_id
UNION ALL
SELECT
    split_part(s.kind, '_', 1), s.kind, s.id, t.kind, t.id, s.is_any AND t.is_any,
    NULL
FROM recorded AS s
JOIN recorded AS t
    ON s.kind IN ('request_sent', 'response_sent') AND t.kind = replace(s.kind, 'sent', 'taken')
    AND s.id = t.id
UNION ALL
SELECT
    'link_request', 'callback_instance', q.sender_callback_instance_id::VARCHAR, 'request_sent',
    s.id, s.is_any AND w.id IS NOT NULL, NULL
FROM simulated_request AS q
JOIN recorded AS s ON s.kind = 'request_sent' AND q.request_id::VARCHAR = s.id
LEFT JOIN whole_callback AS w ON q.sender_callback_instance_id::VARCHAR = w.id
WHERE q.sender_callback_instance_id IS NOT NULL
UNION ALL
SELECT
    'link_response', 'callback_instance', q.callback_instance_id::VARCHAR, 'response_sent', s.id,
    s.is_any AND t.is_any AND w.id IS NOT NULL, NULL
FROM simulated_request AS q
JOIN recorded AS s ON s.kind = 'response_sent' AND q.request_id::VARCHAR = s.id
JOIN recorded AS t ON t.kind = 'request_taken' AND q.request_id::VARCHAR = t.id
LEFT JOIN whole_callback AS w ON q.callback_instance_id::VARCHAR = w.id
WHERE q.callback_instance_id IS NOT NULL;

-- Instances that a loss may have torn in two.
CREATE OR REPLACE TEMP TABLE truth_torn AS
SELECT e.kind, e.id
FROM (
    SELECT
        kind, id, any_value(host) AS host, any_value(pid) AS pid, min(ts_ns) AS start_ns,
        max(ts_ns) AS end_ns, bool_and(is_recorded OR NOT is_declared) AS is_whole
    FROM truth_event
    GROUP BY kind, id
) AS e
LEFT JOIN truth_hole AS h
    ON e.host = h.host AND coalesce(e.pid = h.pid, true)
    AND e.start_ns < h.end_ns AND e.end_ns > h.begin_ns
GROUP BY e.kind, e.id
HAVING count(h.host) > 0 OR NOT bool_and(e.is_whole);
