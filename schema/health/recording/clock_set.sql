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
        *,
        CASE
            WHEN lead(start_ns) OVER (PARTITION BY clock_id ORDER BY start_ns) IS NULL
                THEN 9223372036854775807
            ELSE end_ns + greatest(before_ns, behind_ns)
        END AS last_stamp_ns,
        (SELECT min(start_ns) FROM store.trace WHERE run_id = $run_id) AS begin_ns
    FROM derive.clock_step($run_id)
),
missed AS (
    SELECT
        z.clock_id, z.segment,
        count(DISTINCT o.take_id) AS number
    FROM (
        SELECT o.take_id, t.source_timestamp_ns, h.clock_id
        FROM store.orphan_take AS o
        JOIN store.take AS t ON o.take_id = t.take_id
        JOIN store.subscription AS s ON o.subscription_id = s.subscription_id
        JOIN store.publisher AS p ON s.run_id = p.run_id AND s.topic_name = p.topic_name
        JOIN store.process AS r ON p.process_id = r.process_id
        JOIN store.host AS h ON r.host_id = h.host_id
        WHERE o.run_id = $run_id AND o.reason = 'clock_set'
    ) AS o
    ASOF JOIN step AS z ON o.clock_id = z.clock_id AND o.source_timestamp_ns <= z.last_stamp_ns
    GROUP BY z.clock_id, z.segment
)
SELECT
    z.run_id, h.host_id,
    coalesce(m.number, 0) AS count,
    printf(
        '%+.3f ms between %.3f s and %.3f s after recording began',
        (z.behind_ns - z.before_ns) / 1e6, (z.start_ns - z.begin_ns) / 1e9,
        (z.end_ns - z.begin_ns) / 1e9
    ) AS detail
FROM step AS z
JOIN main.host AS h ON z.clock_id = h.clock_id
LEFT JOIN missed AS m ON z.clock_id = m.clock_id AND z.segment = m.segment
