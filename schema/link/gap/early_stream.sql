-- description: Streams of ROS events that end before others of their recording. `path` is that of
--     the trace which ends last.
-- grain: one row per such stream
WITH stream AS (
    SELECT
        r.run_id, r.recording_id, p.stream_class_id, p.stream_instance_id,
        any_value(p.cpu_id) AS cpu_id,
        max(coalesce(p.end_ns, p.last_event_ns)) AS end_ns,
        arg_max(t.path, coalesce(p.end_ns, p.last_event_ns)) AS path
    FROM store.packet AS p
    JOIN store.trace AS t ON p.trace_id = t.trace_id
    JOIN derive.recording AS r ON p.trace_id = r.trace_id
    WHERE t.domain IS DISTINCT FROM 'kernel'
    GROUP BY r.run_id, r.recording_id, p.stream_class_id, p.stream_instance_id
)
SELECT
    run_id, recording_id, cpu_id,
    arg_max(path, end_ns) OVER recording AS path,
    max(end_ns) OVER recording - end_ns AS early_ns
FROM stream
WINDOW recording AS (PARTITION BY run_id, recording_id)
-- LTTng ends all streams when it stops, which takes it 0.2 s at most.
QUALIFY early_ns > 500_000_000
