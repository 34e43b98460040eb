-- name: finding.stream_ends_early
-- title: Streams end before their trace
-- description: The last packet of a CPU ends more than half a second before the last one of other
--     CPUs, all chunks and snapshots of the recording considered. Events of that CPU may be missing
--     from then on.
-- cause: Files are cut off (disk full, power lost, copied while written), or the last buffers were
--     not written.
-- cure: Stop the session before copying, check the free space, and compare the sizes of the files
--     with the originals.
-- grain: one row per recording, by the trace that ends last
-- severity: warning
WITH packet AS (
    SELECT
        t.run_id, r.recording_id, t.path, p.cpu_id, p.stream_class_id, p.stream_instance_id,
        coalesce(p.end_ns, p.last_event_ns) AS end_ns
    FROM store.packet AS p
    JOIN main.trace AS t ON p.trace_id = t.trace_id
    JOIN derive.recording AS r ON p.trace_id = r.trace_id
    WHERE t.domain IS DISTINCT FROM 'kernel'
),
stream AS (
    SELECT
        recording_id, stream_class_id, stream_instance_id, any_value(cpu_id) AS cpu_id,
        max(end_ns) AS end_ns
    FROM packet
    GROUP BY recording_id, stream_class_id, stream_instance_id
),
recording AS (
    SELECT
        run_id, recording_id, arg_max(path, end_ns) AS path, max(end_ns) AS end_ns
    FROM packet
    GROUP BY run_id, recording_id
)
SELECT
    r.run_id,
    r.path AS subject,
    count(*) AS count,
    printf(
        '%s (CPU %s) end up to %.3f s early',
        derive.counted(count(*), 'stream'),
        string_agg(DISTINCT coalesce(s.cpu_id::VARCHAR, '?'), ', '),
        max(r.end_ns - s.end_ns) / 1e9
    ) AS detail
FROM stream AS s
JOIN recording AS r ON s.recording_id = r.recording_id
-- LTTng ends all streams when it stops, which takes it 0.2 s at most.
WHERE r.end_ns - s.end_ns > 500_000_000
GROUP BY r.run_id, r.recording_id, r.path
