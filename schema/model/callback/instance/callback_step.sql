-- description: Callback instances of Python that go on for something earlier: later steps of a
--     coroutine, tasks, what is done with a response. Each with what it follows from: the instance
--     on whose thread, and inside of which, the tracer said so (`step`); else what the thread took
--     in that turn of its executor, before any callback, a response or a request. Of several that
--     go on for one request, the first is its callback.
-- grain: one row per callback_start that goes on for something known
-- when: staging.python_mark WHERE kind = 'resume'
WITH begun AS (
    SELECT thread_id, process_id, start_event_id, end_event_id FROM staging.callback_pair
),
resumed AS (
    SELECT m.number, m.process_id, b.start_event_id
    FROM staging.python_mark AS m
    ASOF JOIN begun AS b ON m.thread_id = b.thread_id AND m.event_id < b.start_event_id
    WHERE m.kind = 'resume'
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
    SELECT o.start_event_id, b.start_event_id AS call_event_id
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
    SELECT o.start_event_id, t.event_id, t.is_request
    FROM origin AS o
    ANTI JOIN inside AS i ON o.start_event_id = i.start_event_id
    ASOF JOIN taken AS t ON o.thread_id = t.thread_id AND o.event_id > t.event_id
    WHERE coalesce(t.event_id > o.turn_event_id, true)
)
SELECT
    start_event_id, call_event_id, NULL::BIGINT AS response_event_id,
    NULL::BIGINT AS request_event_id
FROM inside
UNION ALL
SELECT start_event_id, NULL, event_id, NULL FROM behind WHERE NOT is_request
UNION ALL
SELECT
    start_event_id,
    CASE WHEN start_event_id > min(start_event_id) OVER same THEN min(start_event_id) OVER same END,
    NULL,
    CASE WHEN start_event_id = min(start_event_id) OVER same THEN event_id END
FROM behind
WHERE is_request
WINDOW same AS (PARTITION BY event_id)
