-- description: Begins and ends of callbacks that are not plain, each with its partner. A begin is
--     paired with the next event of the same callback on its thread, if that is an end. Ends left
--     over (recursion) belong to the latest begin left over (a callback that spins and is called
--     again). This is repeated until nothing pairs. Nothing pairs across a gap: `segment` counts
--     the gaps that the thread has seen. Three columns say what comes before an event on its
--     thread: of calls (`previous_event_id`, not across a gap), of callbacks, and of the executor.
--     `executor_event_id` is the last of these, but not across a gap.
-- grain: one row per such callback_start or callback_end; `partner_event_id` is NULL where there is
--     none
-- when: raw.ros2_callback_start, raw.ros2_callback_end
WITH RECURSIVE event AS (
    SELECT
        s.event_id, s.ts_ns, s.trace_index, s.thread_index, s.callback AS callback_handle,
        true AS is_start, coalesce(s.is_intra_process = 1, false) AS is_intra_process,
        s.previous_call_event_id, s.previous_callback_event_id, s.previous_executor_event_id
    FROM raw.ros2_callback_start AS s
    ANTI JOIN staging.callback_pair_plain AS p ON s.event_id = p.start_event_id
    UNION ALL
    SELECT
        e.event_id, e.ts_ns, e.trace_index, e.thread_index, e.callback, false, false,
        e.previous_call_event_id, e.previous_callback_event_id, NULL
    FROM raw.ros2_callback_end AS e
    ANTI JOIN staging.callback_pair_plain AS p ON e.event_id = p.end_event_id
),
located AS (
    SELECT e.*, c.thread_id, c.process_id
    FROM event AS e
    JOIN staging.context AS c
        ON e.thread_index = c.thread_index
        AND e.event_id >= c.from_event_id
        AND e.event_id < c.until_event_id
),
callback_event AS MATERIALIZED (
    SELECT
        e.event_id, e.ts_ns, e.trace_index, e.thread_id, e.process_id, e.callback_handle,
        e.is_start, e.is_intra_process,
        CASE WHEN c.event_id IS NULL THEN e.previous_call_event_id END AS previous_event_id,
        e.previous_callback_event_id, e.previous_executor_event_id,
        CASE WHEN x.event_id IS NULL THEN e.previous_executor_event_id END AS executor_event_id,
        coalesce(i.segment, 0) AS segment
    FROM located AS e
    LEFT JOIN staging.callback_pair_segment AS i ON e.event_id = i.event_id
    LEFT JOIN (SELECT event_id FROM staging.near_gap WHERE sequence = 'call' AND is_behind) AS c
        ON e.event_id = c.event_id
    LEFT JOIN (SELECT event_id FROM staging.near_gap WHERE sequence = 'executor' AND is_behind) AS x
        ON e.event_id = x.event_id
),
left_over AS (
    SELECT
        0 AS pass, event_id, thread_id, callback_handle, segment, is_start, ts_ns,
        NULL::BIGINT AS partner_event_id, NULL::BIGINT AS partner_ns
    FROM callback_event
    UNION ALL
    SELECT
        pass, event_id, thread_id, callback_handle, segment, is_start, ts_ns, partner_event_id,
        partner_ns
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
paired AS (
    SELECT event_id, max(partner_event_id) AS partner_event_id, max(partner_ns) AS partner_ns
    FROM left_over
    GROUP BY event_id
)
SELECT e.*, p.partner_event_id, p.partner_ns
FROM callback_event AS e
JOIN paired AS p ON e.event_id = p.event_id
