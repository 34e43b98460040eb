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
-- when: derive.early_stream
SELECT
    run_id,
    path AS subject,
    count(*) AS count,
    printf(
        '%s (CPU %s) end up to %.3f s early',
        derive.counted(count(*), 'stream'),
        string_agg(DISTINCT coalesce(cpu_id::VARCHAR, '?'), ', '),
        max(early_ns) / 1e9
    ) AS detail
FROM derive.early_stream
GROUP BY run_id, recording_id, path
