-- name: staging.callback_pair
-- description: Begins of callbacks with their end: on the thread, a begin's next event of the same
--     callback must be its end. Ends left over (recursion) belong to the latest begin left over
--     (a callback that spins and is called again), repeated until nothing pairs. Nothing pairs
--     across a gap. `is_plain`: nothing else of any callback lies between, which is nearly always
--     so; only the others have to be ordered.
-- grain: one row per callback_start
-- needs: staging.callback_event
WITH RECURSIVE plain AS (
    SELECT s.event_id AS start_event_id, e.event_id AS end_event_id, e.ts_ns AS end_ns
    FROM staging.callback_event AS e
    JOIN staging.callback_event AS s
        ON e.previous_callback_event_id = s.event_id
        AND e.thread_id = s.thread_id
        AND e.callback_handle = s.callback_handle
        AND e.segment = s.segment
    WHERE NOT e.is_start AND s.is_start
),
left_over AS (
    SELECT
        0 AS pass, c.event_id, c.thread_id, c.callback_handle, c.segment, c.is_start, c.ts_ns,
        NULL::BIGINT AS partner_event_id, NULL::BIGINT AS partner_ns
    FROM staging.callback_event AS c
    ANTI JOIN (
        SELECT start_event_id AS event_id FROM plain
        UNION ALL
        SELECT end_event_id FROM plain
    ) AS p ON c.event_id = p.event_id
    UNION ALL
    SELECT
        pass, event_id, thread_id, callback_handle, segment, is_start, ts_ns,
        partner_event_id, partner_ns
    FROM (
        SELECT
            pass + 1 AS pass, event_id, thread_id, callback_handle, segment, is_start, ts_ns,
            CASE
                WHEN is_start AND NOT lead(is_start) OVER same THEN lead(event_id) OVER same
                WHEN NOT is_start AND lag(is_start) OVER same THEN lag(event_id) OVER same
            END AS partner_event_id,
            CASE WHEN is_start AND NOT lead(is_start) OVER same THEN lead(ts_ns) OVER same END
                AS partner_ns
        FROM left_over
        WHERE partner_event_id IS NULL
        WINDOW same AS (PARTITION BY thread_id, callback_handle, segment ORDER BY event_id)
    )
    QUALIFY bool_or(partner_event_id IS NOT NULL) OVER ()
),
found AS (
    SELECT start_event_id, end_event_id, end_ns, true AS is_plain FROM plain
    UNION ALL
    SELECT event_id, partner_event_id, partner_ns, false
    FROM left_over
    WHERE is_start AND partner_event_id IS NOT NULL
)
SELECT
    s.event_id AS start_event_id, f.end_event_id, s.ts_ns AS start_ns, f.end_ns, s.trace_index,
    s.thread_id, s.process_id, s.callback_handle, s.is_intra_process, s.previous_event_id,
    s.previous_executor_event_id, s.executor_event_id, coalesce(f.is_plain, false) AS is_plain
FROM staging.callback_event AS s
LEFT JOIN found AS f ON s.event_id = f.start_event_id
WHERE s.is_start
