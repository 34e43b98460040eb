-- name: staging.packet
-- description: Packets as read. What opens without a begin is taken to begin with its trace.
-- grain: one row per packet of a trace
-- when: raw.packet
SELECT
    p.trace_index,
    p.trace_index + 1 AS trace_id,
    p.stream_index,
    p.stream_class_id,
    p.stream_instance_id,
    p.cpu_id,
    p.position,
    coalesce(p.begin_ns, s.begin_ns, p.last_event_ns) AS begin_ns,
    p.end_ns,
    p.last_event_ns,
    p.event_count,
    p.discarded_event_count,
    p.lost_packet_count,
    p.is_numbered
FROM raw.packet AS p
JOIN staging.source AS s ON p.trace_index = s.trace_index
