-- title: Callback instances to replay
-- description: What executors ran, with the moment at which the thread looked for it (looked_ns),
--     begin and end of the wait that found it ready (wait_ns, round_ns: what is ready is decided
--     then), the end of the wait before that one (before_ns), when the thread looked for more
--     (next_ns), and the message that it was called with (a
--     request or response has a negative number). Executors without events of their own
--     have only that.
-- grain: one row per callback instance that ended and is not nested in another
-- param: begin_ns BIGINT  What begins earlier is left out
-- param: until_ns BIGINT  What begins later is left out
WITH state AS (
    SELECT
        s.executor_id, s.thread_id, s.state, s.start_ns,
        lag(s.state) OVER of_thread AS previous_state,
        lag(s.start_ns) OVER of_thread AS previous_ns
    FROM main.executor_state AS s
    WHERE s.run_id = $run_id
    WINDOW of_thread AS (PARTITION BY s.thread_id ORDER BY s.start_ns)
),
look AS (SELECT * FROM state WHERE state <> 'execute'),
round AS (
    SELECT
        executor_id,
        start_ns AS round_ns,
        previous_ns AS wait_ns,
        lag(start_ns) OVER (PARTITION BY executor_id ORDER BY start_ns) AS before_ns
    FROM state
    WHERE state = 'process' AND previous_state = 'wait'
),
message AS (
    SELECT
        take_id,
        min(publication_id) AS publication_id
    FROM main.link_transport
    WHERE run_id = $run_id
    GROUP BY take_id
),
instance AS (
    SELECT
        i.callback_instance_id, i.callback_id, x.executor_id, i.thread_id, i.start_ns, i.end_ns,
        coalesce(
            m.publication_id, -2 * i.request_id, -2 * i.response_id - 1
        ) AS publication_id
    FROM main.callback_instance AS i
    JOIN main.executor_thread AS x ON i.thread_id = x.thread_id
    LEFT JOIN message AS m ON i.take_id = m.take_id
    WHERE i.run_id = $run_id AND i.depth = 1 AND i.end_ns IS NOT NULL
        AND i.start_ns BETWEEN $begin_ns AND $until_ns
)
SELECT
    i.callback_instance_id, i.callback_id, i.executor_id, i.thread_id, i.start_ns, i.end_ns,
    l.start_ns AS looked_ns,
    r.wait_ns, r.round_ns, r.before_ns,
    n.start_ns AS next_ns,
    i.publication_id
FROM instance AS i
ASOF LEFT JOIN look AS l ON i.thread_id = l.thread_id AND i.start_ns >= l.start_ns
ASOF LEFT JOIN look AS n ON i.thread_id = n.thread_id AND i.end_ns <= n.start_ns
ASOF LEFT JOIN round AS r ON i.executor_id = r.executor_id AND l.start_ns >= r.round_ns
ORDER BY i.start_ns, i.callback_instance_id
