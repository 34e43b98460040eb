-- title: A clock was set, and messages around that moment have no link
-- description: Messages are matched by time (Humble, Iron), and the clock that stamps them was set.
--     What was stamped between the moment until which its difference from the clock of the trace is
--     certain, and the one from which on it is so again, has no link. Nor has what could be of two
--     times, since the clock was set back. All other links are as certain as without it.
-- cause: NTP or a user set the clock of the host (the trace follows a clock that cannot be set).
-- cure: Let the clock settle before recording (chronyc waitsync), and slew instead of step.
-- grain: one row per host and step; it counts messages that were received
-- severity: warning
-- when: store.stamp_clock
WITH step AS (
    SELECT
        z.*,
        (SELECT min(start_ns) FROM store.trace WHERE run_id = $run_id) AS begin_ns,
        (SELECT max(end_ns) FROM store.trace WHERE run_id = $run_id) AS last_ns
    FROM derive.clock_step($run_id) AS z
),
missed AS (
    SELECT DISTINCT o.take_id, t.source_timestamp_ns, h.clock_id
    FROM store.orphan_take AS o
    JOIN store.take AS t ON o.take_id = t.take_id
    JOIN store.subscription AS s ON o.subscription_id = s.subscription_id
    JOIN store.publisher AS p ON s.run_id = p.run_id AND s.topic_name = p.topic_name
    JOIN store.process AS r ON p.process_id = r.process_id
    JOIN store.host AS h ON r.host_id = h.host_id
    WHERE o.run_id = $run_id AND o.reason = 'clock_set'
)
SELECT
    any_value(z.run_id) AS run_id,
    h.host_id,
    count(m.take_id) AS count,
    printf(
        '%s between %.3f s and %.3f s after recording began',
        coalesce(printf('%+.3f ms', (z.behind_ns - z.before_ns) / 1e6), 'by an unknown time'),
        (coalesce(z.start_ns, z.begin_ns) - z.begin_ns) / 1e9,
        (coalesce(z.end_ns, z.last_ns) - z.begin_ns) / 1e9
    ) AS detail
FROM step AS z
JOIN main.host AS h ON z.clock_id = h.clock_id
LEFT JOIN missed AS m
    ON z.clock_id = m.clock_id
    AND coalesce(m.source_timestamp_ns > z.start_ns + z.before_ns, true)
    AND coalesce(m.source_timestamp_ns < z.end_ns + z.behind_ns, true)
GROUP BY h.host_id, z.start_ns, z.end_ns, z.before_ns, z.behind_ns, z.begin_ns, z.last_ns
