-- name: finding.clocks_apart
-- title: The clocks of two hosts are apart
-- description: Messages seem to arrive before they were published. Latencies between the two hosts
--     are wrong by at least that much. Links are right all the same, since they compare stamps.
-- cause: The hosts were not synchronised while recording.
-- cure: Correct the clocks now: msgflow clocks apply messages, or msgflow clocks apply FILE if
--     messages go one way only. Next time, synchronise the clocks before recording (chrony, ptp4l).
-- grain: one row per pair of hosts
-- severity: warning
-- phase: clocks
SELECT
    l.run_id,
    fh.hostname || ' → ' || th.hostname AS subject,
    count(*) AS count,
    printf(
        '%s received up to %.3f ms before publication',
        derive.counted(count(*), 'message'), -min(l.latency_ns) / 1e6
    ) AS detail
FROM main.link_transport AS l
JOIN main.publication AS b ON l.publication_id = b.publication_id
JOIN main.process AS fp ON b.process_id = fp.process_id
JOIN main.host AS fh ON fp.host_id = fh.host_id
JOIN main.take AS t ON l.take_id = t.take_id
JOIN main.process AS tp ON t.process_id = tp.process_id
JOIN main.host AS th ON tp.host_id = th.host_id
WHERE l.latency_ns < 0 AND fh.clock_id <> th.clock_id
GROUP BY l.run_id, fh.hostname, th.hostname
