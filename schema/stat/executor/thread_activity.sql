-- description: What executor threads did, in detail (main.executor_activity), by the clock of their
--     executor: all activities that reach into a window. A few around it may be there as well, and
--     all of events executors; the end of those behind it is not known.
-- grain: one row per interval of a thread in which nothing changed
-- param: runs BIGINT[]  Runs to look at; NULL: all
-- param: window_start_ns BIGINT  Begin of the window, epoch ns; NULL: from the first event
-- param: window_end_ns BIGINT  End of the window, epoch ns
CREATE OR REPLACE MACRO derive.thread_activity(runs, window_start_ns, window_end_ns) AS TABLE
WITH instance AS (
    SELECT
        i.run_id, i.thread_id, i.callback_instance_id, i.parent_id, i.start_ns, i.end_ns,
        i.start_event_id, i.end_event_id, i.effective_end_event_id, i.take_id, c.kind
    FROM store.callback_instance AS i
    JOIN store.callback AS c ON i.callback_id = c.callback_id
    WHERE runs IS NULL OR list_contains(runs, i.run_id)
),
executor_state AS NOT MATERIALIZED (
    SELECT run_id, thread_id, state, start_ns, start_event_id
    FROM store.executor_state
    WHERE runs IS NULL OR list_contains(runs, run_id)
),
thread_break AS NOT MATERIALIZED (
    SELECT run_id, thread_id, resumed_ns, resumed_event_id
    FROM store.thread_break
    WHERE runs IS NULL OR list_contains(runs, run_id)
),
-- A callback never seen to end was over at the first event that cannot be inside of it.
outside AS (
    SELECT
        start_event_id AS event_id,
        thread_id,
        start_ns AS at_ns
    FROM executor_state
    UNION ALL
    SELECT start_event_id, thread_id, start_ns
    FROM instance
    UNION ALL
    SELECT resumed_event_id, thread_id, resumed_ns
    FROM thread_break
),
closed AS (
    SELECT
        i.run_id, i.thread_id,
        i.effective_end_event_id AS event_id,
        any_value(x.at_ns) AS at_ns,
        i.callback_instance_id, i.parent_id
    FROM instance AS i
    JOIN outside AS x ON i.thread_id = x.thread_id AND i.effective_end_event_id = x.event_id
    WHERE i.end_event_id IS NULL
    GROUP BY ALL
),
change AS (
    SELECT
        run_id, thread_id,
        resumed_event_id AS event_id,
        0 AS step,
        resumed_ns AS at_ns,
        NULL::BIGINT AS running_id,
        0 AS state,
        NULL AS kind
    FROM thread_break
    UNION ALL
    SELECT run_id, thread_id, end_event_id, 1, end_ns, parent_id, 0, NULL
    FROM instance
    WHERE end_event_id IS NOT NULL
    UNION ALL
    SELECT run_id, thread_id, event_id, 1, at_ns, parent_id, 0, NULL FROM closed
    UNION ALL
    SELECT
        run_id, thread_id, start_event_id, 2, start_ns, NULL,
        CASE state WHEN 'wait' THEN 1 WHEN 'process' THEN 2 ELSE 3 END,
        NULL
    FROM executor_state
    SEMI JOIN derive.delimited_run USING (run_id)
    UNION ALL
    SELECT run_id, thread_id, start_event_id, 3, start_ns, callback_instance_id, 0, kind
    FROM instance
    UNION ALL
    SELECT t.run_id, t.thread_id, t.start_event_id, 4, t.taken_ns, NULL, 0, i.kind
    FROM store.take AS t
    LEFT JOIN instance AS i ON t.take_id = i.take_id
    WHERE t.method <> 'callback_only' AND t.start_event_id IS NOT NULL
        AND (runs IS NULL OR list_contains(runs, t.run_id))
),
-- The window by the clock of each thread, which is rounded. A window without limits has the least
-- and the greatest number: less of them leaves room for the offset of a clock.
extent AS (
    SELECT
        t.thread_id,
        derive.recorded_ns(greatest(window_start_ns, -(1::BIGINT << 62)), p) - 1 AS start_ns,
        derive.recorded_ns(least(window_end_ns, 1::BIGINT << 62), p) + 1 AS end_ns
    FROM store.thread AS t
    JOIN derive.process_clock AS p ON t.process_id = p.process_id
    WHERE window_start_ns IS NOT NULL
),
-- Where the changes of a thread around the window begin and end, and what held before.
reach AS (
    SELECT
        c.thread_id,
        max(c.event_id) FILTER (c.at_ns < e.start_ns AND c.step < 4) AS first_event_id,
        min(c.event_id) FILTER (c.at_ns > e.end_ns AND c.step < 4) AS last_event_id,
        max(c.event_id) FILTER (c.at_ns < e.start_ns AND c.step = 0) AS break_event_id,
        max(c.event_id) FILTER (c.at_ns < e.start_ns AND c.state > 0) AS state_event_id,
        max(c.event_id) FILTER (c.at_ns < e.start_ns AND c.step IN (1, 3)) AS run_event_id
    FROM change AS c
    JOIN extent AS e ON c.thread_id = e.thread_id
    GROUP BY c.thread_id
),
situation AS (
    SELECT
        c.run_id, c.thread_id, c.event_id, c.step, c.at_ns, c.kind,
        coalesce(last_value(CASE WHEN c.step = 0 THEN c.event_id END IGNORE NULLS) OVER so_far, -1)
            AS break_event_id,
        last_value(CASE WHEN c.state > 0 THEN c.event_id END IGNORE NULLS) OVER so_far
            AS state_event_id,
        last_value(nullif(c.state, 0) IGNORE NULLS) OVER so_far AS state,
        last_value(CASE WHEN c.step IN (1, 3) THEN c.event_id END IGNORE NULLS) OVER so_far
            AS run_event_id,
        last_value(CASE WHEN c.step IN (1, 3) THEN coalesce(c.running_id, 0) END IGNORE NULLS)
            OVER so_far AS running_id
    FROM change AS c
    LEFT JOIN reach AS r ON c.thread_id = r.thread_id
    WHERE (
            coalesce(c.event_id >= r.first_event_id, true)
            AND coalesce(c.event_id <= r.last_event_id, true)
        )
        OR c.event_id IN (r.break_event_id, r.state_event_id, r.run_event_id)
    WINDOW so_far AS (
        PARTITION BY c.run_id, c.thread_id ORDER BY c.event_id, c.step ROWS UNBOUNDED PRECEDING
    )
),
-- What held before a gap of the trace is not known behind it. A take while the executor executes is
-- what it is about to do anyway.
split AS (
    SELECT
        run_id, thread_id, event_id, step, at_ns, kind, break_event_id, run_event_id, running_id,
        CASE WHEN state_event_id >= break_event_id THEN state_event_id END AS state_event_id,
        CASE WHEN state_event_id >= break_event_id THEN state ELSE 0 END AS state,
        lead(at_ns) OVER on_thread AS next_ns,
        lead(step) OVER on_thread AS next_step,
        lead(kind) OVER on_thread AS next_kind,
        lead(state) OVER on_thread AS next_state
    FROM situation
    WHERE step < 4 OR state IS NULL OR state = 2 OR state_event_id < break_event_id
    WINDOW on_thread AS (PARTITION BY run_id, thread_id ORDER BY event_id, step)
),
described AS (
    SELECT
        s.run_id, s.thread_id, s.at_ns, s.next_ns, s.next_step, s.next_kind, s.next_state, s.step,
        s.state,
        s.kind IS NOT NULL AS has_callback,
        coalesce(s.run_event_id > s.state_event_id, false) AS has_run,
        i.callback_instance_id, i.kind,
        s.state > 0 AND coalesce(s.state_event_id > i.start_event_id, true) AS is_spinning
    FROM split AS s
    LEFT JOIN instance AS i
        ON s.running_id = i.callback_instance_id
        AND i.effective_end_event_id > s.event_id
        AND i.start_event_id >= s.break_event_id
),
classified AS (
    SELECT
        t.run_id, t.thread_id, x.executor_id,
        t.at_ns AS start_ns,
        CASE WHEN t.next_step > 0 THEN t.next_ns END AS end_ns,
        t.callback_instance_id,
        CASE
            WHEN t.callback_instance_id IS NOT NULL AND (NOT t.is_spinning OR t.next_step = 1)
                THEN CASE WHEN t.kind = 'service' THEN 'service' ELSE 'callback' END
            WHEN t.step = 4 THEN CASE WHEN t.is_spinning OR t.has_callback THEN 'take' END
            WHEN NOT t.is_spinning THEN NULL
            WHEN t.state = 1 AND NOT t.has_run THEN 'wait'
            WHEN t.state = 3 AND NOT t.has_run
                THEN CASE WHEN t.next_kind = 'timer' THEN 'select' ELSE 'take' END
            -- It ran a callback, or looked in vain, and looks next under the lock of the executor.
            WHEN (t.has_run OR t.state = 2 AND t.next_step = 2 AND t.next_state = 2)
                AND t.callback_instance_id IS NULL
                AND e.kind LIKE 'multi_threaded%'
                THEN 'blocked'
            ELSE 'select'
        END AS activity
    FROM described AS t
    JOIN store.executor_thread AS x ON t.thread_id = x.thread_id
    JOIN store.executor AS e ON x.executor_id = e.executor_id
)
SELECT run_id, executor_id, thread_id, activity, start_ns, end_ns, callback_instance_id
FROM classified
WHERE activity IS NOT NULL AND (end_ns > start_ns OR end_ns IS NULL)
UNION ALL
SELECT run_id, executor_id, thread_id, activity, start_ns, end_ns, NULL
FROM derive.queue_activity(runs)
