-- description: Between which moments the input of a callback became ready in its executor. Not
--     before its release, nor before the subscription was made. In an executor of one thread also
--     not before it last went to sleep, nor before the last polling point but one, which would have
--     found it (unless that callback ran in between: then more of its input may have waited). At
--     the latest when the executor last learned what is ready, before it picked this callback. In
--     an events executor, which serves what came first first, also not after what its own thread
--     published and it ran then or later. With the begin of that wait of the executor, the end
--     of the wait before it, and the moment at which its thread began to look for work and picked
--     it (the start, with one thread or where that does not show).
-- grain: one row per callback instance that is not nested in another
-- param: executors VARCHAR  Name of rows of executor_id, until_ns: those to look at. Callback
--     instances that began after the last of these moments are left out (where all are NULL: none)
-- param: has_calls, has_teams
CREATE OR REPLACE MACRO derive.callback_ready(
    executors, has_calls := true, has_teams := true
) AS TABLE
WITH sized AS (
    SELECT
        e.executor_id, e.until_ns, s.thread_count,
        x.kind = 'events' AS is_in_order
    FROM query_table(executors) AS e
    JOIN derive.executor_size AS s ON e.executor_id = s.executor_id
    JOIN store.executor AS x ON e.executor_id = x.executor_id
),
release AS (
    SELECT
        r.* REPLACE (
            least(r.latest_ns, min(CASE WHEN s.is_in_order THEN r.returned_ns END) OVER (
                PARTITION BY r.thread_id ORDER BY r.start_ns, r.callback_instance_id
                ROWS BETWEEN CURRENT ROW AND UNBOUNDED FOLLOWING
            )) AS latest_ns
        ),
        s.thread_count
    FROM derive.callback_release('sized', has_calls) AS r
    JOIN sized AS s ON r.executor_id = s.executor_id
),
-- A thread among several picks what it will run when it begins to look, not when it runs it:
-- another thread may have gone to wait in the meantime.
picked AS (
    SELECT
        r.*,
        CASE WHEN r.thread_count = 1 THEN r.start_ns ELSE s.start_ns END AS picked_ns
    FROM release AS r
    ASOF LEFT JOIN (
        SELECT e.thread_id, e.start_ns
        FROM store.executor_state AS e
        JOIN store.executor_thread AS x ON e.thread_id = x.thread_id
        JOIN sized AS z ON x.executor_id = z.executor_id
        WHERE has_teams AND e.state = 'process' AND z.thread_count > 1
    ) AS s ON r.thread_id = s.thread_id AND r.start_ns >= s.start_ns
),
polled AS (
    SELECT
        p.*,
        w.start_ns AS wait_start_ns,
        w.end_ns AS wait_end_ns,
        w.previous_end_ns AS previous_wait_end_ns,
        w.asleep_ns
    FROM picked AS p
    ASOF LEFT JOIN derive.executor_poll('sized') AS w
        ON p.executor_id = w.executor_id AND p.picked_ns >= w.end_ns
),
broken AS (
    SELECT x.executor_id, b.resumed_ns
    FROM store.thread_break AS b
    JOIN store.executor_thread AS x ON b.thread_id = x.thread_id
),
known AS (
    SELECT
        p.*, b.resumed_ns,
        least(p.latest_ns, CASE WHEN p.wait_end_ns < b.resumed_ns THEN NULL ELSE p.wait_end_ns END)
            AS polled_ns,
        greatest(
            CASE
                WHEN p.previous_wait_end_ns < b.resumed_ns THEN NULL
                WHEN p.previous_wait_end_ns <= p.previous_start_ns THEN NULL
                WHEN p.thread_count = 1 THEN p.previous_wait_end_ns
            END,
            CASE WHEN p.thread_count = 1 AND coalesce(p.asleep_ns >= b.resumed_ns, true)
                THEN p.asleep_ns END
        ) AS not_ready_ns
    FROM polled AS p
    ASOF LEFT JOIN broken AS b ON p.executor_id = b.executor_id AND p.start_ns >= b.resumed_ns
),
bounded AS (
    SELECT
        * REPLACE (
            CASE WHEN since = 'timer' THEN greatest(origin_ns, not_ready_ns) ELSE origin_ns END
                AS origin_ns
        ),
        CASE WHEN origin_ns IS NOT NULL OR not_ready_ns IS NOT NULL
            THEN least(greatest(origin_ns, subscribed_ns, not_ready_ns), start_ns)
        END AS earliest_ns
    FROM known
)
SELECT
    run_id, executor_id, thread_id, callback_id, callback_instance_id, since, origin_ns,
    earliest_ns,
    -- Published after the polling point: the queue was full, and this message took the place of an
    -- older one.
    greatest(CASE WHEN polled_ns < earliest_ns THEN latest_ns ELSE polled_ns END, earliest_ns)
        AS latest_ns,
    start_ns, thread_count,
    coalesce(picked_ns, start_ns) AS picked_ns,
    wait_start_ns, previous_wait_end_ns,
    coalesce(resumed_ns > coalesce(earliest_ns, polled_ns), false) AS is_loss_affected
FROM bounded
