-- title: The clocks of two hosts are not synchronised
-- description: Latencies between the two contain the difference of their clocks, which is not
--     known.
-- cause: No correction was asked for, or messages go one way only.
-- cure: Correct the clocks: msgflow clocks apply messages, or msgflow clocks apply FILE if messages
--     go one way only. If the hosts were synchronised while recording, do nothing.
-- grain: one row per pair of hosts
-- severity: warning
-- when: derive.several_clocks
SELECT
    l.run_id,
    f.hostname || ' → ' || t.hostname AS subject,
    count(*) AS count,
    printf(
        '%s, from %.3f ms to %.3f ms as recorded',
        derive.counted(count(*), 'message'), min(l.latency_ns) / 1e6, max(l.latency_ns) / 1e6
    ) AS detail
FROM main.remote_latency AS l
JOIN main.host AS f ON l.from_host_id = f.host_id
JOIN main.host AS t ON l.to_host_id = t.host_id
JOIN main.clock AS fc ON f.clock_id = fc.clock_id
JOIN main.clock AS tc ON t.clock_id = tc.clock_id
WHERE derive.clock_group_id(fc.clock_id, fc.reference_clock_id)
    <> derive.clock_group_id(tc.clock_id, tc.reference_clock_id)
GROUP BY l.run_id, f.hostname, t.hostname
-- Shown as apart already.
HAVING min(l.latency_ns) >= 0
