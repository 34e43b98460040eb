-- What is true of a recording of real ROS 2, from its truth.jsonl.gz (the view real): the nodes wrote
-- when they published and when a callback began. Their times are of CLOCK_MONOTONIC and lie around
-- or behind the events of the trace. So a publication is the one that begins in that interval, a
-- callback the one that runs at that moment, a take the latest of its subscription before it.

CREATE OR REPLACE TEMP TABLE truth_row AS
SELECT r.* REPLACE (
    r.t0 + m.clock_offset_ns AS t0, r.t1 + m.clock_offset_ns AS t1
)
FROM real AS r
CROSS JOIN (FROM real WHERE k = 'meta') AS m
WHERE r.k <> 'meta';

CREATE OR REPLACE TEMP TABLE place AS
SELECT t.thread_id, h.hostname AS host, p.pid, t.tid
FROM analysed.store.thread AS t
JOIN analysed.store.process AS p ON t.process_id = p.process_id
JOIN analysed.store.host AS h ON p.host_id = h.host_id;

-- Runs of callbacks: number `n` of its node, and the message, request or response that it got.
-- `is_run`: it has events of its own. Of a response, it is known by its taking, or before Kilted by
-- the callback of Python; rclcpp had no event for it.
CREATE OR REPLACE TEMP TABLE truth_callback AS
SELECT
    node || ' ' || n AS callback, kind, name, id, node, pid, tid, t0, accepted,
    kind <> 'client' OR (
        NOT EXISTS (FROM analysed.store.response)
        AND pid IN (SELECT pid FROM analysed.store.process WHERE python_version IS NOT NULL)
    ) AS is_run
FROM truth_row
WHERE k = 'callback';

CREATE OR REPLACE TEMP TABLE truth_sent AS
SELECT
    k, topic, id, id::VARCHAR AS message, pid, tid, t0, t1, causes, goal,
    -- A task goes on for another callback, if callbacks are traced.
    node || ' ' || CASE
        WHEN pid IN (
            SELECT p.pid
            FROM analysed.store.callback_instance AS i
            JOIN place AS p ON i.thread_id = p.thread_id
        ) THEN coalesce(call, cb)
        ELSE cb
    END AS callback,
    topic || ' ' || id AS sent
FROM truth_row
WHERE k IN ('publication', 'request', 'response')
    -- What a filter of messages publishes has no callback, and its causes are no triggers.
    AND NOT (cb = 0 AND coalesce(json_array_length(causes), 0) > 0);

-- What threads sent and took.
CREATE OR REPLACE TEMP TABLE sent AS
SELECT 'publication' AS k, u.topic_name AS name, b.thread_id, b.start_ns AS ts_ns
FROM analysed.store.publication AS b
JOIN analysed.store.publisher AS u ON b.publisher_id = u.publisher_id
UNION ALL
SELECT 'request', c.service_name, q.sender_thread_id, q.sent_ns
FROM analysed.store.request AS q
JOIN analysed.store.client AS c ON q.client_id = c.client_id
UNION ALL
SELECT 'response', v.service_name, s.sender_thread_id, s.sent_ns
FROM analysed.store.response AS s
JOIN analysed.store.service AS v ON s.service_id = v.service_id;

CREATE OR REPLACE TEMP TABLE taken AS
SELECT
    'sub' AS kind, 'take' AS kind_found, s.topic_name AS name, t.thread_id, t.taken_ns AS ts_ns
FROM analysed.store.take AS t
JOIN analysed.store.subscription AS s ON t.subscription_id = s.subscription_id
UNION ALL
SELECT 'service', 'request_taken', v.service_name, q.receiver_thread_id, q.taken_ns
FROM analysed.store.request AS q
JOIN analysed.store.service AS v ON q.service_id = v.service_id
UNION ALL
SELECT 'client', 'response_taken', c.service_name, s.receiver_thread_id, s.taken_ns
FROM analysed.store.response AS s
JOIN analysed.store.client AS c ON s.client_id = c.client_id;

CREATE OR REPLACE TEMP TABLE truth_time AS
WITH placed_taken AS (
    SELECT t.*, p.host, p.pid, p.tid FROM taken AS t JOIN place AS p ON t.thread_id = p.thread_id
),
placed_run AS (
    SELECT i.start_ns, i.end_ns, p.host, p.pid, p.tid
    FROM analysed.store.callback_instance AS i
    JOIN place AS p ON i.thread_id = p.thread_id
)
SELECT
    CASE r.k WHEN 'publication' THEN 'publication' ELSE r.k || '_sent' END AS kind,
    r.sent AS id, p.host, p.pid, p.tid, s.ts_ns
FROM truth_sent AS r
JOIN place AS p ON r.pid = p.pid AND r.tid = p.tid
JOIN sent AS s
    ON p.thread_id = s.thread_id AND r.k = s.k AND r.topic = s.name
    AND s.ts_ns BETWEEN r.t0 AND r.t1
UNION ALL
SELECT t.kind_found, c.callback, t.host, t.pid, t.tid, t.ts_ns
FROM truth_callback AS c
ASOF JOIN placed_taken AS t
    ON c.kind = t.kind AND c.name = t.name AND c.pid = t.pid AND c.tid = t.tid AND c.t0 >= t.ts_ns
UNION ALL
SELECT 'callback_instance', c.callback, i.host, i.pid, i.tid, i.start_ns
FROM truth_callback AS c
ASOF JOIN placed_run AS i ON c.pid = i.pid AND c.tid = i.tid AND c.t0 >= i.start_ns
WHERE coalesce(c.t0 <= i.end_ns, true) AND c.is_run;

-- Nothing says what of these recordings is missing or was torn.
CREATE OR REPLACE TEMP TABLE truth_torn (kind VARCHAR, id VARCHAR);
CREATE OR REPLACE TEMP TABLE truth_hole (host VARCHAR);

CREATE OR REPLACE TEMP TABLE truth_link AS
WITH recording AS (
    -- Where events are missing, or initialisation is, only precision is judged.
    SELECT
        NOT EXISTS (FROM analysed.store.gap)
        AND NOT EXISTS (FROM analysed.store.finding WHERE name = 'started_late') AS is_whole
),
-- rclpy has no events of callbacks: there, a message causes what its thread publishes next.
traced AS (
    SELECT DISTINCT p.pid
    FROM analysed.store.callback_instance AS i
    JOIN place AS p ON i.thread_id = p.thread_id
),
link AS (
    SELECT
        'transport' AS kind, 'publication' AS from_kind, c.name || ' ' || c.id AS from_id,
        'take' AS to_kind, c.callback AS to_id
    FROM truth_callback AS c
    JOIN truth_sent AS s ON s.k = 'publication' AND c.name || ' ' || c.id = s.sent
    WHERE c.kind = 'sub'
    UNION ALL
    SELECT 'called_with', 'take', c.callback, 'callback_instance', c.callback
    FROM truth_callback AS c
    SEMI JOIN (FROM analysed.store.process WHERE python_version IS NOT NULL) AS p ON c.pid = p.pid
    -- Without its topic, which take it was is not known.
    SEMI JOIN (FROM truth_time WHERE kind = 'take') AS k ON c.callback = k.id
    WHERE c.kind = 'sub'
    UNION ALL
    SELECT s.k, s.k || '_sent', s.sent, s.k || '_taken', c.callback
    FROM truth_callback AS c
    JOIN truth_sent AS s
        ON CASE c.kind WHEN 'service' THEN 'request' WHEN 'client' THEN 'response' END = s.k
        AND c.name || ' ' || c.id = s.sent
    UNION ALL
    SELECT
        CASE s.k WHEN 'publication' THEN 'direct' ELSE 'link_' || s.k END, 'callback_instance',
        s.callback, CASE s.k WHEN 'publication' THEN s.k ELSE s.k || '_sent' END, s.sent
    FROM truth_sent AS s
    JOIN truth_callback AS c ON s.callback = c.callback
    JOIN traced AS t ON s.pid = t.pid
    WHERE c.is_run
    UNION ALL
    SELECT
        'link_call', 'response_taken', s.callback,
        CASE s.k WHEN 'publication' THEN s.k ELSE s.k || '_sent' END, s.sent
    FROM truth_sent AS s
    JOIN truth_callback AS c ON s.callback = c.callback
    JOIN traced AS t ON s.pid = t.pid
    WHERE c.kind = 'client'
    UNION ALL
    -- In rclpy, what clients do with a response shows as nothing.
    SELECT 'link_call', 'request_taken', s.callback, 'publication', s.sent
    FROM truth_sent AS s
    JOIN truth_callback AS c ON s.callback = c.callback
    ANTI JOIN traced AS t ON s.pid = t.pid
    WHERE s.k = 'publication' AND c.kind = 'service'
    UNION ALL
    SELECT
        CASE WHEN accepted THEN 'goal_accepted' ELSE 'goal_rejected' END, 'request_sent',
        name || ' ' || id, 'request_taken', callback
    FROM truth_callback
    WHERE accepted IS NOT NULL
    UNION ALL
    SELECT
        'goal_result', 'request_sent', replace(topic, 'get_result', 'send_goal') || ' ' || id,
        'request_sent', sent
    FROM truth_sent
    WHERE topic LIKE '%/\_action/get_result' ESCAPE '\'
    UNION ALL
    SELECT
        'goal_message', 'request_sent', replace(topic, 'feedback', 'send_goal') || ' ' || goal,
        'publication', sent
    FROM truth_sent
    WHERE goal IS NOT NULL
    UNION ALL
    SELECT 'take_adjacent', 'take', s.callback, 'publication', s.sent
    FROM truth_sent AS s
    JOIN truth_callback AS c ON s.callback = c.callback
    ANTI JOIN traced AS t ON s.pid = t.pid
    WHERE s.k = 'publication' AND c.kind = 'sub'
),
-- A goal of an action from its acceptance to its result.
goal AS (
    SELECT
        a.name, a.name || ' ' || a.id AS sent, a.id, a.t0 AS accepted_ns, min(r.t0) AS finished_ns
    FROM truth_callback AS a
    LEFT JOIN truth_callback AS r
        ON r.kind = 'client' AND a.name = replace(r.name, 'get_result', 'send_goal')
        AND a.name <> r.name AND a.id = r.id
    WHERE a.accepted
    GROUP BY ALL
),
-- Rejected goals that look like accepted ones: in rclpy, the thread publishes the status of another
-- goal next, or does nothing more. Any later result may be of such a goal.
deed AS (
    SELECT k, name, thread_id, ts_ns FROM sent
    UNION ALL
    SELECT kind, name, thread_id, ts_ns FROM taken
),
followed AS (
    SELECT *, lead((k, name)) OVER (PARTITION BY thread_id ORDER BY ts_ns, k, name) AS next_deed
    FROM deed
),
unclear AS (
    SELECT a.name, a.callback, a.t0
    FROM truth_callback AS a
    JOIN place AS p ON a.pid = p.pid AND a.tid = p.tid
    ASOF JOIN (FROM followed WHERE k = 'response') AS f
        ON p.thread_id = f.thread_id AND a.name = f.name AND a.t0 < f.ts_ns
    ANTI JOIN traced AS t ON a.pid = t.pid
    WHERE NOT a.accepted
        AND coalesce(f.next_deed = ('publication', replace(a.name, 'send_goal', 'status')), true)
),
-- Whose feedback it is, is said of the first and last message, if no other goal was accepted
-- meanwhile.
first_and_last AS (
    SELECT unnest([arg_min(s.sent, s.t0), arg_max(s.sent, s.t0)]) AS sent
    FROM goal AS g
    JOIN truth_sent AS s
        ON g.name = replace(s.topic, 'feedback', 'send_goal') AND g.id = s.goal
    ANTI JOIN goal AS o
        ON g.name = o.name AND g.id <> o.id
        AND o.accepted_ns < coalesce(g.finished_ns, o.accepted_ns + 1)
        AND coalesce(o.finished_ns > g.accepted_ns, true)
    ANTI JOIN unclear AS u ON g.name = u.name AND coalesce(g.finished_ns > u.t0, true)
    GROUP BY g.sent
),
obscured AS (
    SELECT l.from_id
    FROM link AS l
    JOIN truth_sent AS s ON l.to_id = s.sent
    JOIN unclear AS u ON replace(s.topic, 'get_result', 'send_goal') = u.name AND s.t0 > u.t0
    WHERE l.kind = 'goal_result'
)
-- Before Kilted, services have no events but those of callbacks.
SELECT
    l.*,
    r.is_whole AND (
        l.kind IN ('transport', 'called_with', 'direct', 'take_adjacent')
        OR EXISTS (FROM analysed.store.request)
    ) AND (
        l.kind <> 'goal_message' OR l.to_id IN (FROM first_and_last)
    -- In rclpy, it may take the client to know.
    ) AND (
        l.kind <> 'goal_accepted'
        OR l.from_id IN (SELECT from_id FROM link WHERE kind = 'goal_result')
    ) AND (
        l.kind NOT IN ('goal_accepted', 'goal_result')
        OR l.from_id NOT IN (FROM obscured)
    ) AND (
        l.kind <> 'goal_rejected' OR l.to_id NOT IN (SELECT callback FROM unclear)
    ) AS is_decided
FROM link AS l
CROSS JOIN recording AS r;
