-- What msgflow has found (the database `analysed`): every link by the places and times of its ends.
-- Times are those of the trace, which the tables of the store have.
CREATE OR REPLACE TEMP TABLE found_link AS
WITH seen AS (
    SELECT process_id, trace_id FROM analysed.store.publication
    UNION
    SELECT process_id, trace_id FROM analysed.store.take
),
-- Recordings have a folder for each host, also for containers with one hostname.
folder AS (
    SELECT s.process_id, nullif(regexp_extract(any_value(t.path), '/trace-([^/]+)/', 1), '') AS host
    FROM seen AS s
    JOIN analysed.store.trace AS t ON s.trace_id = t.trace_id
    GROUP BY s.process_id
),
place AS (
    SELECT t.thread_id, coalesce(f.host, h.hostname) AS host, p.pid, t.tid
    FROM analysed.store.thread AS t
    JOIN analysed.store.process AS p ON t.process_id = p.process_id
    JOIN analysed.store.host AS h ON p.host_id = h.host_id
    LEFT JOIN folder AS f ON p.process_id = f.process_id
),
instance AS (
    SELECT 'publication' AS kind, publication_id AS id, thread_id, start_ns AS ts_ns
    FROM analysed.store.publication
    UNION ALL
    SELECT 'take', take_id, thread_id, taken_ns
    FROM analysed.store.take
    UNION ALL
    SELECT 'callback_instance', callback_instance_id, thread_id, start_ns
    FROM analysed.store.callback_instance
    UNION ALL
    SELECT 'is_' || c.kind, i.callback_instance_id, i.thread_id, i.start_ns
    FROM analysed.store.callback_instance AS i
    JOIN analysed.store.callback AS c ON i.callback_id = c.callback_id
    UNION ALL
    SELECT 'callback_end', callback_instance_id, thread_id, end_ns
    FROM analysed.store.callback_instance
    WHERE end_event_id IS NOT NULL
    UNION ALL
    SELECT 'state_start', start_event_id, thread_id, start_ns
    FROM analysed.store.executor_state
    UNION ALL
    SELECT 'state_end', start_event_id, thread_id, end_ns
    FROM analysed.derive.executor_interval
    WHERE end_ns IS NOT NULL
    UNION ALL
    SELECT 'request_sent', request_id, sender_thread_id, sent_ns
    FROM analysed.store.request
    UNION ALL
    SELECT 'request_taken', request_id, receiver_thread_id, taken_ns
    FROM analysed.store.request
    UNION ALL
    SELECT 'response_sent', response_id, sender_thread_id, sent_ns
    FROM analysed.store.response
    UNION ALL
    SELECT 'response_taken', response_id, receiver_thread_id, taken_ns
    FROM analysed.store.response
    UNION ALL
    SELECT 'user_event', user_event_id, thread_id, at_ns FROM analysed.store.user_event
),
link AS (
    SELECT
        kind, kind AS label, kind AS from_kind, id AS from_id, kind AS to_kind, id AS to_id,
        false AS is_guess
    FROM instance
    WHERE kind IN ('publication', 'callback_instance', 'user_event')
    UNION ALL
    SELECT
        'recorded_in', name, 'callback_instance', callback_instance_id, 'user_event',
        user_event_id, false
    FROM analysed.store.user_event
    WHERE callback_instance_id IS NOT NULL
    UNION ALL
    -- What a loss on other CPUs may have made of two says so.
    SELECT 'callback_run', 'callback_run', 'callback_instance', callback_instance_id,
        'callback_end', callback_instance_id, is_loss_affected
    FROM analysed.store.callback_instance
    WHERE end_ns IS NOT NULL
    UNION ALL
    SELECT 'executor_state', state, 'state_start', start_event_id, 'state_end', start_event_id,
        false
    FROM analysed.derive.executor_interval
    WHERE end_ns IS NOT NULL
    UNION ALL
    SELECT
        'kind', c.kind, 'callback_instance', i.callback_instance_id, 'is_' || c.kind,
        i.callback_instance_id, false
    FROM analysed.store.callback_instance AS i
    JOIN analysed.store.callback AS c ON i.callback_id = c.callback_id
    WHERE c.kind <> 'unknown'
    UNION ALL
    SELECT
        'called_with', t.method, 'take', t.take_id, 'callback_instance', i.callback_instance_id,
        false
    FROM analysed.store.callback_instance AS i
    JOIN analysed.store.take AS t ON i.take_id = t.take_id
    WHERE t.method <> 'callback_only'
    UNION ALL
    -- The middleware's own takes carry no stamp, and have no subscription.
    SELECT 'take', method, 'take', take_id, 'take', take_id, false
    FROM analysed.store.take
    WHERE method = 'ring_buffer'
        OR method <> 'callback_only' AND coalesce(source_timestamp_ns, 0) <> 0
    UNION ALL
    -- One of several publications with the same topic and stamp.
    SELECT 'transport', method, 'publication', publication_id, 'take', take_id,
        method = 'exact' AND candidate_count > 1
    FROM analysed.store.link_transport
    UNION ALL
    SELECT kind, kind, 'callback_instance', callback_instance_id, 'publication', publication_id,
        candidate_count > 1
    FROM analysed.store.link_causal
    WHERE callback_instance_id IS NOT NULL
    UNION ALL
    -- What a timer may have published is marked.
    SELECT kind, kind, 'take', take_id, 'publication', publication_id, candidate_count > 1
    FROM analysed.store.link_causal
    WHERE callback_instance_id IS NULL
    UNION ALL
    -- Several services may take one request.
    SELECT 'link_request', 'request', 'callback_instance', l.callback_instance_id, 'request_sent',
        min(l.request_id), false
    FROM analysed.store.link_request AS l
    JOIN analysed.store.request AS q ON l.request_id = q.request_id
    WHERE l.callback_instance_id IS NOT NULL
    GROUP BY l.callback_instance_id, q.sender_thread_id, q.sent_ns
    UNION ALL
    SELECT 'link_response', 'response', 'callback_instance', callback_instance_id,
        'response_sent', response_id, false
    FROM analysed.store.link_response
    WHERE callback_instance_id IS NOT NULL
    UNION ALL
    SELECT
        'link_call', CASE WHEN taken_request_id IS NULL THEN 'response' ELSE 'request' END,
        CASE WHEN taken_request_id IS NULL THEN 'response_taken' ELSE 'request_taken' END,
        coalesce(taken_request_id, taken_response_id),
        CASE
            WHEN publication_id IS NOT NULL THEN 'publication'
            WHEN request_id IS NOT NULL THEN 'request_sent'
            ELSE 'response_sent'
        END,
        coalesce(publication_id, request_id, response_id),
        candidate_count > 1
    FROM analysed.store.link_call
    UNION ALL
    SELECT
        CASE WHEN is_accepted THEN 'goal_accepted' ELSE 'goal_rejected' END, 'goal',
        'request_sent', goal_id, 'request_taken', goal_id, false
    FROM analysed.main.goal
    WHERE is_accepted IS NOT NULL
    UNION ALL
    SELECT
        'goal_result', 'result', 'request_sent', goal_id, 'request_sent', result_request_id,
        is_loss_affected
    FROM analysed.main.goal
    WHERE result_request_id IS NOT NULL
    UNION ALL
    SELECT
        'goal_message', m.label, 'request_sent', g.goal_id, 'publication', b.publication_id,
        g.is_loss_affected
    FROM (
        SELECT goal_id, action_server_id, 'feedback' AS label, first_feedback_ns AS at_ns
        FROM analysed.main.goal
        UNION
        SELECT goal_id, action_server_id, 'feedback', last_feedback_ns FROM analysed.main.goal
        UNION
        SELECT goal_id, action_server_id, 'cancel', cancel_accepted_ns FROM analysed.main.goal
    ) AS m
    JOIN analysed.main.goal AS g ON m.goal_id = g.goal_id
    JOIN analysed.main.action_server AS s ON g.action_server_id = s.action_server_id
    JOIN analysed.main.publication AS b
        ON m.at_ns = b.start_ns
        AND CASE m.label WHEN 'cancel' THEN s.status_publisher_id ELSE s.feedback_publisher_id END
        = b.publisher_id
    UNION ALL
    SELECT 'request', 'request', 'request_sent', request_id, 'request_taken', request_id, false
    FROM analysed.store.request
    WHERE sent_ns IS NOT NULL AND taken_ns IS NOT NULL
    UNION ALL
    SELECT 'response', 'response', 'response_sent', response_id, 'response_taken', response_id,
        false
    FROM analysed.store.response
    WHERE sent_ns IS NOT NULL AND taken_ns IS NOT NULL
)
SELECT
    row_number() OVER () AS number, l.kind, l.label, l.from_id, l.to_id, l.is_guess,
    l.from_kind, fp.host AS from_host, fp.pid AS from_pid, fp.tid AS from_tid, f.ts_ns AS from_ns,
    l.to_kind, tp.host AS to_host, tp.pid AS to_pid, tp.tid AS to_tid, t.ts_ns AS to_ns
FROM link AS l
JOIN instance AS f ON l.from_kind = f.kind AND l.from_id = f.id
JOIN place AS fp ON f.thread_id = fp.thread_id
JOIN instance AS t ON l.to_kind = t.kind AND l.to_id = t.id
JOIN place AS tp ON t.thread_id = tp.thread_id;

CREATE OR REPLACE TEMP TABLE judged AS SELECT DISTINCT kind FROM truth_link;
