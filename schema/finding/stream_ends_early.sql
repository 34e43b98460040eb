-- name: finding.stream_ends_early
-- title: Streams end before their trace
-- description: The last packet of a CPU's stream ends well before the end of the trace, while
--     packets of other CPUs go on: events of that CPU may be missing from then on.
-- cause: Files are cut off (no space, power lost, copied while written), or the last buffers were
--     not written.
-- cure: Stop the session before copying; check free space; compare the sizes of the files with the
--     originals.
-- grain: one row per trace
-- severity: warning
-- needs: store.packet, main.trace, derive.counted
WITH stream AS (
    SELECT
        run_id, trace_id, cpu_id, stream_class_id, stream_instance_id,
        max(coalesce(end_ns, last_event_ns)) AS end_ns
    FROM store.packet
    GROUP BY run_id, trace_id, cpu_id, stream_class_id, stream_instance_id
),
trace_end AS (
    SELECT trace_id, min(begin_ns) AS start_ns, max(coalesce(end_ns, last_event_ns)) AS end_ns
    FROM store.packet
    GROUP BY trace_id
)
SELECT
    t.run_id,
    t.path AS subject,
    count(*) AS count,
    printf(
        '%s (CPU %s) end up to %.3f s early',
        derive.counted(count(*), 'stream'),
        string_agg(DISTINCT coalesce(s.cpu_id::VARCHAR, '?'), ', '),
        max(e.end_ns - s.end_ns) / 1e9
    ) AS detail
FROM stream AS s
JOIN trace_end AS e ON s.trace_id = e.trace_id
JOIN main.trace AS t ON s.trace_id = t.trace_id
WHERE t.domain IS DISTINCT FROM 'kernel'
    AND e.end_ns - s.end_ns > greatest(0.05 * (e.end_ns - e.start_ns), 500_000_000)
GROUP BY t.run_id, t.trace_id, t.path
