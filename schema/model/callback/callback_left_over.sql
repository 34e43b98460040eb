-- name: staging.callback_left_over
-- description: The begins and ends of callbacks that are not plain, paired: on the thread, a
--     begin's next event of the same callback must be its end. Ends left over (recursion) belong to
--     the latest begin left over (a callback that spins and is called again), repeated until
--     nothing pairs. Nothing pairs across a gap.
-- grain: one row per such begin or end; `partner_event_id` is NULL where there is none
-- when: staging.callback_event
WITH RECURSIVE left_over AS (
    SELECT
        0 AS pass, c.event_id, c.thread_id, c.trace_index, c.callback_handle, c.segment,
        c.is_start, c.ts_ns, NULL::BIGINT AS partner_event_id, NULL::BIGINT AS partner_ns
    FROM staging.callback_event AS c
    UNION ALL
    SELECT
        pass, event_id, thread_id, trace_index, callback_handle, segment, is_start, ts_ns,
        partner_event_id, partner_ns
    FROM (
        SELECT
            pass + 1 AS pass, event_id, thread_id, trace_index, callback_handle, segment, is_start,
            ts_ns,
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
)
SELECT
    event_id, thread_id, trace_index, is_start,
    max(partner_event_id) AS partner_event_id, max(partner_ns) AS partner_ns
FROM left_over
GROUP BY event_id, thread_id, trace_index, is_start
