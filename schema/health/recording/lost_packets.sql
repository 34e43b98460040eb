-- title: Whole packets are missing
-- description: The numbers of the packets skip some, or the stream of one CPU ends before the
--     events of others. What happened in these packets is missing, and nothing is paired across the
--     gaps.
-- cause: The buffers were overwritten (a snapshot, or a channel in overwrite mode), packets were
--     lost on the way to the relay daemon, a chunk of a rotated recording was not given to the
--     ingest, or files are cut off.
-- cure: Record to disk (not a snapshot), with a channel in discard mode: lttng enable-channel
--     --userspace --discard CHANNEL; or take snapshots of larger buffers. Ingest all chunks of a
--     recording together.
-- grain: one row per trace
-- severity: error
-- when: store.gap WHERE kind = 'packets'
SELECT
    run_id, trace_id,
    count(*) AS count,
    printf(
        '%s on %s, %.3f s in all',
        derive.counted(count(*), 'place'),
        derive.counted(count(DISTINCT cpu), 'CPU'),
        sum(end_ns - start_ns) / 1e9
    ) AS detail
FROM main.gap
WHERE kind = 'packets'
GROUP BY run_id, trace_id
