-- title: The clocks of two hosts are not known well enough for the latencies between them
-- description: Most messages between the two took less time than the possible error of their
--     latency.
-- cause: In one direction there are few messages, or slow ones, or none for part of the recording.
-- cure: Record network packets as well (docs/clocks.md), or synchronise the clocks
--     before recording (chrony, ptp4l) and leave them as recorded: msgflow clocks apply none.
-- grain: one row per pair of hosts
-- severity: warning
-- when: derive.several_clocks
SELECT
    l.run_id,
    f.hostname || ' → ' || t.hostname AS subject,
    count(*) FILTER (WHERE abs(l.latency_ns) < l.uncertainty_ns) AS count,
    printf(
        '%d of %s took less than the possible error, which is up to %.3f ms; the median took '
        || '%.3f ms',
        count(*) FILTER (WHERE abs(l.latency_ns) < l.uncertainty_ns),
        derive.counted(count(*), 'message'),
        max(l.uncertainty_ns) / 1e6,
        quantile_disc(l.latency_ns, 0.5) / 1e6
    ) AS detail
FROM main.remote_latency AS l
JOIN main.host AS f ON l.from_host_id = f.host_id
JOIN main.host AS t ON l.to_host_id = t.host_id
WHERE l.uncertainty_ns IS NOT NULL
GROUP BY l.run_id, f.hostname, t.hostname
HAVING count(*) FILTER (WHERE abs(l.latency_ns) < l.uncertainty_ns) * 2 > count(*)
