-- description: Callback instances, with their callback object, and the take or the request that
--     they were called with. The object is known by the event that made it, else by its first
--     instance.
--     The callback_start directly follows the take's last layer, or the
--     rmw_take_request, on its thread, with no event of the executor between the two. Neither an
--     rmw take nor a request is for an intra-process call, nor is a dequeue for another one. The
--     subscriptions, or services, agree where both are known. What goes on for something earlier
--     has that, too: a call or a response.
-- grain: one row per callback_start
-- when: staging.callback_run

-- Instances of Python that go on for something earlier: later steps of a coroutine, tasks, jobs on
-- threads of no executor, what is done with a response. Each with what it follows from: the
-- instance on whose thread, and inside of which, the tracer said so (`step`); else what the thread
-- took in that turn of its executor, before any callback, a response or a request. Of several that
-- go on for one request, the first is its callback. What goes on by itself has one mark of the
-- tracer, as a job that starts others (`step_event_id`).
-- when: staging.python_mark WHERE kind IN ('resume', 'job')
-- columns: start_event_id BIGINT, step_event_id BIGINT, call_event_id BIGINT, response_event_id
--     BIGINT, request_event_id BIGINT
CREATE OR REPLACE TEMP TABLE callback_step AS
WITH begun AS (
    SELECT thread_id, process_id, start_event_id, end_event_id FROM staging.callback_run
),
resumed AS (
    SELECT m.number, m.process_id, b.start_event_id
    FROM staging.python_mark AS m
    ASOF JOIN begun AS b ON m.thread_id = b.thread_id AND m.event_id < b.start_event_id
    WHERE m.kind IN ('resume', 'job')
    QUALIFY row_number() OVER (PARTITION BY b.start_event_id ORDER BY m.event_id DESC) = 1
),
origin AS (
    SELECT
        r.start_event_id, m.event_id, m.thread_id,
        greatest(m.previous_callback_event_id, m.previous_executor_event_id) AS turn_event_id
    FROM resumed AS r
    ASOF JOIN (FROM staging.python_mark WHERE kind = 'step') AS m
        ON r.process_id = m.process_id AND r.number = m.number AND r.start_event_id > m.event_id
),
inside AS (
    SELECT
        o.start_event_id,
        o.event_id AS step_event_id,
        b.start_event_id AS call_event_id
    FROM origin AS o
    ASOF JOIN begun AS b ON o.thread_id = b.thread_id AND o.event_id > b.start_event_id
    WHERE coalesce(b.end_event_id > o.event_id, true)
),
taken AS (
    SELECT event_id, thread_id, is_request FROM staging.service_event WHERE is_request
    UNION ALL
    SELECT event_id, thread_id, is_request FROM staging.client_event WHERE NOT is_request
),
behind AS (
    SELECT
        o.start_event_id,
        o.event_id AS step_event_id,
        t.event_id, t.is_request
    FROM origin AS o
    ANTI JOIN inside AS i ON o.start_event_id = i.start_event_id
    ASOF JOIN taken AS t ON o.thread_id = t.thread_id AND o.event_id > t.event_id
    WHERE coalesce(t.event_id > o.turn_event_id, true)
)
SELECT
    start_event_id, step_event_id, call_event_id,
    NULL::BIGINT AS response_event_id,
    NULL::BIGINT AS request_event_id
FROM inside
UNION ALL
SELECT start_event_id, step_event_id, NULL, event_id, NULL FROM behind WHERE NOT is_request
UNION ALL
SELECT
    start_event_id, step_event_id,
    CASE WHEN start_event_id > min(start_event_id) OVER same THEN min(start_event_id) OVER same END,
    NULL,
    CASE WHEN start_event_id = min(start_event_id) OVER same THEN event_id END
FROM behind
WHERE is_request
WINDOW same AS (PARTITION BY event_id);

-- Functions of Python that begin right after a client of an action took the states of goals. What
-- it takes at once it takes in this order, and only feedback has a callback that is called then
-- (NULL: there was none, or the function goes on for something earlier).
-- when: staging.python_mark WHERE kind = 'python'
-- columns: start_event_id BIGINT, called_by_event_id BIGINT
CREATE OR REPLACE TEMP TABLE callback_feedback AS
WITH message AS (
    SELECT t.start_event_id, t.end_event_id, t.thread_id, s.topic_name
    FROM staging.take_chain AS t
    JOIN staging.subscription_known AS s ON t.subscription_event_id = s.event_id
    WHERE s.topic_name LIKE '%/\_action/%' ESCAPE '\'
)
SELECT
    r.start_event_id,
    CASE
        WHEN m.event_id IS NULL AND f.start_event_id > coalesce(r.previous_callback_event_id, 0)
            THEN f.end_event_id
    END AS called_by_event_id
FROM staging.callback_run AS r
JOIN message AS s ON r.previous_event_id = s.end_event_id AND s.topic_name LIKE '%/status'
LEFT JOIN (FROM staging.python_mark WHERE kind = 'resume') AS m
    ON r.thread_id = m.thread_id
    AND r.previous_callback_event_id IS NOT DISTINCT FROM m.previous_callback_event_id
ASOF LEFT JOIN message AS f
    ON r.thread_id = f.thread_id
    AND replace(s.topic_name, '/status', '/feedback') = f.topic_name
    AND s.start_event_id > f.start_event_id;

WITH begun AS NOT MATERIALIZED (
    SELECT
        start_event_id AS event_id,
        process_id,
        callback_handle AS handle,
        is_intra_process, previous_event_id, previous_executor_event_id
    FROM staging.callback_run
),
known AS (
    SELECT
        event_id, process_id,
        callback_handle AS handle
    FROM staging.callback_known
),
first_run AS (
    SELECT
        process_id, handle,
        min(event_id) AS event_id
    FROM begun
    GROUP BY process_id, handle
),
run AS (
    SELECT
        b.event_id AS start_event_id,
        b.process_id,
        b.handle AS callback_handle,
        b.is_intra_process,
        coalesce(b.object_event_id, f.event_id) AS callback_event_id,
        coalesce(k.kind, 'unknown') AS kind,
        k.subscription_event_id, k.service_event_id,
        -- As recorded: what the executor said after the take stands, whatever else was lost. It is
        -- NULL only where the thread had no executor event at all.
        CASE
            WHEN k.kind = 'function' AND a.start_event_id IS NOT NULL THEN a.called_by_event_id
            WHEN coalesce(b.previous_executor_event_id < b.previous_event_id, true)
                THEN b.previous_event_id
        END AS called_by_event_id
    FROM staging.with_latest('begun', 'known') AS b
    LEFT JOIN callback_feedback AS a ON b.event_id = a.start_event_id
    LEFT JOIN staging.callback_known AS k ON b.object_event_id = k.event_id
    LEFT JOIN first_run AS f
        ON b.object_event_id IS NULL AND b.process_id = f.process_id AND b.handle = f.handle
)
SELECT
    r.start_event_id, r.process_id, r.callback_handle, r.is_intra_process, r.callback_event_id,
    r.kind,
    t.start_event_id AS take_event_id,
    coalesce(r.subscription_event_id, t.subscription_event_id) AS subscription_event_id,
    coalesce(q.event_id, p.request_event_id) AS request_event_id,
    coalesce(e.call_event_id, p.call_event_id) AS call_event_id,
    p.response_event_id, p.step_event_id
FROM run AS r
LEFT JOIN staging.take_chain AS t
    ON r.called_by_event_id = t.end_event_id
    AND r.kind IN ('subscription', 'unknown', 'function')
    AND r.is_intra_process = (t.method = 'ring_buffer')
    AND coalesce(r.subscription_event_id = t.subscription_event_id, true)
LEFT JOIN (SELECT * FROM staging.service_event WHERE is_request) AS q
    ON r.called_by_event_id = q.event_id
    AND r.kind IN ('service', 'unknown', 'function')
    AND NOT r.is_intra_process
    AND coalesce(r.service_event_id = q.service_event_id, true)
LEFT JOIN callback_step AS p ON r.start_event_id = p.start_event_id
-- A later step may start a job: that goes on for the first.
LEFT JOIN callback_step AS e ON p.call_event_id = e.start_event_id
