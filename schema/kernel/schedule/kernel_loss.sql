-- name: staging.kernel_loss
-- description: When kernel events were lost on some CPU, by the time until which any earlier loss
--     of the clock reaches as well.
-- grain: one row per packet behind whose last event events were lost
-- when: staging.thread_switch
WITH packet AS (
    SELECT
        s.clock_key,
        p.discarded_event_count,
        coalesce(p.last_event_ns, p.begin_ns) + s.shift_ns AS start_ns,
        coalesce(
            lead(p.begin_ns) OVER (
                PARTITION BY p.trace_index, p.stream_index ORDER BY p.position
            ),
            p.end_ns
        ) + s.shift_ns AS end_ns
    FROM raw.packet AS p
    JOIN staging.schedule AS s ON p.trace_index = s.trace_index
    WHERE s.is_joined
)
SELECT
    clock_key,
    start_ns,
    max(end_ns) OVER (PARTITION BY clock_key ORDER BY start_ns) AS until_ns
FROM packet
WHERE discarded_event_count <> 0
