-- description: Traces read, with what their packets and events say of their extent. Those that only
--     read performance counters have no events of their own.
-- grain: one row per CTF trace
-- when: staging.placed_source
WITH extent AS (
    SELECT
        trace_index,
        min(begin_ns) AS start_ns,
        max(greatest(coalesce(end_ns, begin_ns), coalesce(last_event_ns, begin_ns))) AS end_ns,
        sum(event_count)::BIGINT AS event_count,
        -- What a packet says may be anything; what is calculated with it must fit.
        least(coalesce(sum(discarded_event_count), 0), 9007199254740992)::BIGINT
            AS discarded_event_count
    FROM staging.packet
    GROUP BY trace_index
),
-- Tracepoints count that were enabled, even if they never occurred.
with_requests AS (
    SELECT trace_index
    FROM staging.declared
    WHERE name IN ('ros2:rmw_send_request', 'ros2:rmw_take_request')
    GROUP BY trace_index
    HAVING count(*) = 2
)
SELECT
    s.trace_index + 1 AS trace_id,
    s.host_id, s.path, s.uuid, s.tracer, s.domain,
    coalesce(e.start_ns, s.begin_ns) + s.shift_ns AS start_ns,
    coalesce(e.end_ns, s.end_ns) + s.shift_ns AS end_ns,
    coalesce(e.event_count, 0) AS event_count,
    coalesce(e.discarded_event_count, 0) AS discarded_event_count,
    s.trace_index IN (FROM with_requests) AS has_request_events
FROM staging.placed_source AS s
LEFT JOIN extent AS e ON s.trace_index = e.trace_index
WHERE s.trace_index NOT IN (FROM staging.reader)
ORDER BY trace_id
