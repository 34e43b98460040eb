-- name: staging.callback_pair
-- description: Begins of callbacks with their ends. Per thread and callback the event after a
--     begin must be its end; an end left over belongs to the latest begin left over (a callback
--     that spins and is called again), repeated until nothing pairs. Nothing pairs across a gap.
-- grain: one row per callback_start
-- needs: staging.callback_event
WITH RECURSIVE neighbour AS (
    SELECT
        event_id, thread_id, callback_handle, segment, is_start, ts_ns,
        lead(is_start) OVER same AS next_is_start,
        lead(event_id) OVER same AS next_event_id,
        lead(ts_ns) OVER same AS next_ns,
        lag(is_start) OVER same AS previous_is_start
    FROM staging.callback_event
    WINDOW same AS (PARTITION BY thread_id, callback_handle, segment ORDER BY event_id)
),
left_over AS (
    SELECT
        0 AS pass, event_id, thread_id, callback_handle, segment, is_start, ts_ns,
        NULL::BIGINT AS partner_event_id, NULL::BIGINT AS partner_ns
    FROM neighbour
    WHERE CASE
        WHEN is_start THEN next_is_start IS DISTINCT FROM false
        ELSE previous_is_start IS DISTINCT FROM true
    END
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
late_pair AS (
    SELECT event_id, partner_event_id, partner_ns
    FROM left_over
    WHERE is_start AND partner_event_id IS NOT NULL
)
SELECT
    n.event_id AS start_event_id,
    CASE WHEN n.next_is_start = false THEN n.next_event_id ELSE p.partner_event_id END
        AS end_event_id,
    CASE WHEN n.next_is_start = false THEN n.next_ns ELSE p.partner_ns END AS end_ns
FROM neighbour AS n
LEFT JOIN late_pair AS p ON n.event_id = p.event_id
WHERE n.is_start
