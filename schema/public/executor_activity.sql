-- name: main.executor_activity
-- description: What executor threads did, refined by callbacks: the states are split where a
--     callback begins and ends. Before its callback an executing thread takes the message; after
--     it, a thread of a multi-threaded executor is blocked until it may look for work again.
-- grain: one row per interval of a thread in which nothing changed
-- column: run_id BIGINT  Run that the row belongs to
-- column: executor_id BIGINT  Executor
-- column: thread_id BIGINT  Thread it happened on
-- column: activity VARCHAR  'wait', 'select', 'take', 'callback', 'service' or 'blocked'
-- column: start_ns BIGINT [epoch ns]  Begin
-- column: end_ns BIGINT [epoch ns]  End; NULL: not known (the last, or a gap follows)
-- column: callback_instance_id BIGINT  Callback that ran
-- needs: store.executor_state, store.callback_instance, store.callback, store.executor_thread,
--     store.executor, store.thread, derive.corrected_ns, derive.process_clock
WITH change AS (
    SELECT
        run_id, thread_id, start_event_id AS event_id, start_ns AS at_ns, state,
        NULL::BIGINT AS callback_instance_id, 0 AS step
    FROM store.executor_state
    UNION ALL
    SELECT run_id, thread_id, start_event_id, start_ns, NULL, callback_instance_id, 1
    FROM store.callback_instance
    WHERE depth = 1
    UNION ALL
    SELECT run_id, thread_id, end_event_id, end_ns, NULL, NULL, -1
    FROM store.callback_instance
    WHERE depth = 1 AND end_event_id IS NOT NULL
),
ordered AS (
    SELECT
        run_id,
        thread_id,
        event_id AS change_event_id,
        step,
        at_ns AS start_ns,
        lead(at_ns) OVER on_thread AS end_ns,
        max(CASE WHEN state IS NOT NULL THEN event_id END) OVER so_far AS state_event_id,
        max(CASE WHEN step = 1 THEN event_id END) OVER so_far AS callback_event_id,
        max(CASE WHEN step = -1 THEN event_id END) OVER so_far AS ended_event_id
    FROM change
    WINDOW
        on_thread AS (PARTITION BY run_id, thread_id ORDER BY event_id),
        so_far AS (
            PARTITION BY run_id, thread_id ORDER BY event_id ROWS UNBOUNDED PRECEDING
        )
),
-- Where a gap follows a state, nobody knows how its last part went on.
followed AS (
    SELECT
        run_id, thread_id, start_ns, end_ns, state_event_id, callback_event_id, ended_event_id,
        lead(state_event_id) OVER (
            PARTITION BY run_id, thread_id ORDER BY change_event_id, step
        ) IS DISTINCT FROM state_event_id AS is_last_of_state
    FROM ordered
),
classified AS (
    SELECT
        o.run_id,
        o.thread_id,
        x.executor_id,
        o.start_ns,
        CASE WHEN s.end_ns IS NULL AND o.is_last_of_state THEN NULL ELSE o.end_ns END AS end_ns,
        i.callback_instance_id,
        CASE
            WHEN i.callback_instance_id IS NOT NULL THEN
                CASE WHEN c.kind = 'service' THEN 'service' ELSE 'callback' END
            WHEN s.state = 'wait' THEN 'wait'
            WHEN s.state = 'execute' AND coalesce(o.callback_event_id < o.state_event_id, true)
                THEN 'take'
            WHEN s.state = 'execute' AND e.kind = 'multi_threaded' THEN 'blocked'
            ELSE 'select'
        END AS activity
    FROM followed AS o
    JOIN store.executor_thread AS x ON o.thread_id = x.thread_id
    JOIN store.executor AS e ON x.executor_id = e.executor_id
    LEFT JOIN store.executor_state AS s
        ON o.run_id = s.run_id AND o.state_event_id = s.start_event_id
    LEFT JOIN store.callback_instance AS i
        ON o.run_id = i.run_id
        AND o.callback_event_id = i.start_event_id
        AND coalesce(o.ended_event_id < o.callback_event_id, true)
        AND coalesce(o.state_event_id < i.effective_end_event_id, true)
    LEFT JOIN store.callback AS c ON i.callback_id = c.callback_id
    WHERE s.state IS NOT NULL OR i.callback_instance_id IS NOT NULL
)
SELECT
    k.run_id,
    k.executor_id,
    k.thread_id,
    k.activity,
    derive.corrected_ns(k.start_ns, p.offset_ns, p.drift_ppb, p.reference_ns) AS start_ns,
    derive.corrected_ns(k.end_ns, p.offset_ns, p.drift_ppb, p.reference_ns) AS end_ns,
    k.callback_instance_id
FROM classified AS k
JOIN store.thread AS t ON k.thread_id = t.thread_id
JOIN derive.process_clock AS p ON t.process_id = p.process_id
WHERE k.end_ns > k.start_ns OR k.end_ns IS NULL
