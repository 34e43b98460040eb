-- title: The clocks of two hosts are apart
-- description: Messages seem to arrive before they were published. Latencies between the two hosts
--     are wrong by at least that much. Links are right all the same, since they compare stamps.
-- cause: The hosts were not synchronised while recording.
-- cure: Correct the clocks now: msgflow clocks apply messages, or msgflow clocks apply FILE if
--     messages go one way only. Next time, synchronise the clocks before recording (chrony, ptp4l).
-- grain: one row per pair of hosts
-- severity: warning
-- when: derive.several_clocks
SELECT
    l.run_id,
    f.hostname || ' → ' || t.hostname AS subject,
    count(*) AS count,
    printf(
        '%s received up to %.3f ms before publication',
        derive.counted(count(*), 'message'), -min(l.latency_ns) / 1e6
    ) AS detail
FROM main.remote_latency AS l
JOIN main.host AS f ON l.from_host_id = f.host_id
JOIN main.host AS t ON l.to_host_id = t.host_id
WHERE l.latency_ns < 0
GROUP BY l.run_id, f.hostname, t.hostname
