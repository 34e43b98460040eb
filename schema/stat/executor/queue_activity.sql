-- description: What the threads of events executors did between callbacks. A kernel trace shows
--     when they slept: there they waited for work, else they looked for it. Without one, such a
--     thread waited for certain until the next callback became due: its message was published, or
--     its timer had run for a whole number of periods (a punctual one: late by a millisecond at
--     most, or a tenth of its period if that is less). The rest is not known. What has no events
--     may have run in the meantime, such as the callback of a client.
-- grain: one row per interval of such a thread outside of callbacks and takes
-- param: runs BIGINT[]  Runs to look at; NULL: all
CREATE OR REPLACE MACRO derive.queue_activity(runs) AS TABLE
WITH member AS MATERIALIZED (
    SELECT x.run_id, x.executor_id, x.thread_id, p.host_id
    FROM store.executor AS e
    JOIN store.executor_thread AS x ON e.executor_id = x.executor_id
    JOIN store.thread AS t ON x.thread_id = t.thread_id
    JOIN store.process AS p ON t.process_id = p.process_id
    WHERE e.kind = 'events' AND (runs IS NULL OR list_contains(runs, e.run_id))
),
thread_state AS MATERIALIZED (
    SELECT thread_id, state, start_ns, end_ns
    FROM store.thread_state
    WHERE thread_id IN (SELECT thread_id FROM member)
),
-- What is known of a thread outside of nested callbacks. After a gap of the trace, nothing is.
seen AS (
    SELECT
        i.thread_id,
        coalesce(t.taken_ns, i.start_ns) AS start_ns,
        i.end_ns,
        CASE
            WHEN p.host_id = m.host_id THEN b.end_ns
            WHEN (i.start_ns - r.created_ns) % r.period_ns
                <= least(r.period_ns // 10, 1_000_000)
                THEN i.start_ns - (i.start_ns - r.created_ns) % r.period_ns
        END AS due_ns
    FROM store.callback_instance AS i
    JOIN member AS m ON i.thread_id = m.thread_id
    JOIN store.callback AS c ON i.callback_id = c.callback_id
    LEFT JOIN store.timer AS r ON c.timer_id = r.timer_id AND r.period_ns > 0
    LEFT JOIN store.take AS t ON i.take_id = t.take_id AND t.thread_id = i.thread_id
    LEFT JOIN store.link_transport AS l ON t.take_id = l.take_id
    LEFT JOIN store.publication AS b ON l.publication_id = b.publication_id
    LEFT JOIN store.process AS p ON b.process_id = p.process_id
    WHERE i.depth = 1
    UNION ALL
    SELECT t.thread_id, t.taken_ns, t.taken_ns, NULL
    FROM store.take AS t
    JOIN member AS m ON t.thread_id = m.thread_id
    ANTI JOIN store.callback_instance AS i ON t.take_id = i.take_id
    UNION ALL
    SELECT thread_id, failed_ns, failed_ns, NULL
    FROM store.failed_take
    WHERE thread_id IN (SELECT thread_id FROM member)
    UNION ALL
    SELECT thread_id, resumed_ns, NULL, NULL
    FROM store.thread_break
    WHERE thread_id IN (SELECT thread_id FROM member)
),
pause AS MATERIALIZED (
    SELECT
        thread_id,
        end_ns AS start_ns,
        lead(start_ns) OVER on_thread AS end_ns,
        lead(due_ns) OVER on_thread AS due_ns
    FROM seen
    WINDOW on_thread AS (PARTITION BY thread_id ORDER BY start_ns, end_ns NULLS LAST)
    QUALIFY lead(start_ns) OVER on_thread > seen.end_ns
),
slept AS MATERIALIZED (
    SELECT
        p.thread_id,
        p.start_ns AS pause_ns,
        s.start_ns, s.end_ns
    FROM (SELECT * FROM thread_state WHERE state = 'sleeping') AS s
    ASOF JOIN pause AS p ON s.thread_id = p.thread_id AND s.start_ns >= p.start_ns
    WHERE s.end_ns <= p.end_ns
),
-- It is awake from the begin of a pause, or the end of a sleep, to the next sleep.
awake AS (
    SELECT
        thread_id,
        from_ns AS start_ns,
        coalesce(lead(until_ns) OVER (PARTITION BY thread_id, pause_ns ORDER BY from_ns), end_ns)
            AS end_ns
    FROM (
        SELECT
            thread_id,
            start_ns AS pause_ns,
            start_ns AS from_ns,
            NULL AS until_ns,
            end_ns
        FROM pause
        WHERE thread_id IN (SELECT thread_id FROM thread_state)
        UNION ALL
        SELECT s.thread_id, s.pause_ns, s.end_ns, s.start_ns, p.end_ns
        FROM slept AS s
        JOIN pause AS p ON s.thread_id = p.thread_id AND s.pause_ns = p.start_ns
    )
),
activity AS (
    SELECT
        thread_id,
        'wait' AS activity,
        start_ns, end_ns
    FROM slept
    UNION ALL
    SELECT a.thread_id, 'select', a.start_ns, a.end_ns
    FROM awake AS a
    ASOF JOIN thread_state AS s ON a.thread_id = s.thread_id AND a.start_ns >= s.start_ns
    WHERE s.end_ns > a.start_ns AND s.state <> 'unknown'
    UNION ALL
    SELECT
        thread_id, 'wait', start_ns,
        least(due_ns, end_ns)
    FROM pause
    WHERE due_ns > start_ns AND thread_id NOT IN (SELECT thread_id FROM thread_state)
)
SELECT m.run_id, m.executor_id, a.thread_id, a.activity, a.start_ns, a.end_ns
FROM activity AS a
JOIN member AS m ON a.thread_id = m.thread_id
WHERE a.end_ns > a.start_ns
