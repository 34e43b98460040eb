-- title: The events of a publisher end before its messages
-- description: Messages were taken that were sent after the last event of every known publisher of
--     the topic. Their flows begin at the take, and what the process did last is missing.
-- cause: The buffers of the process were not written when the session was destroyed or the process
--     was killed, or files of the trace are cut off.
-- cure: Stop the session (lttng stop) before the nodes and before lttng destroy, and let nodes shut
--     down by themselves.
-- grain: one row per topic
-- severity: warning
-- when: store.orphan_take WHERE reason = 'publisher_trace_ends'
WITH late AS (
    SELECT
        o.run_id, s.topic_name,
        count(*) AS number,
        max(t.taken_ns) AS last_ns
    FROM main.stat_orphan AS o
    JOIN main.take AS t ON o.take_id = t.take_id
    LEFT JOIN main.subscription AS s ON o.subscription_id = s.subscription_id
    WHERE o.reason = 'publisher_trace_ends'
    GROUP BY o.run_id, s.topic_name
),
sender AS (
    SELECT
        b.run_id, b.topic_name,
        max(p.last_seen_ns) AS last_seen_ns,
        string_agg(
            DISTINCT printf('%s %d on %s', coalesce(p.name, '?'), p.pid, h.hostname), ', '
        ) AS label
    FROM main.publisher AS b
    JOIN main.process AS p ON b.process_id = p.process_id
    JOIN main.host AS h ON p.host_id = h.host_id
    GROUP BY b.run_id, b.topic_name
)
SELECT
    l.run_id, l.topic_name,
    coalesce(l.topic_name, 'unknown topic') AS subject,
    l.number AS count,
    printf(
        '%s until %.3f s after the last event of %s',
        derive.counted(l.number, 'message'), (l.last_ns - s.last_seen_ns) / 1e9,
        coalesce(s.label, 'every process')
    ) AS detail
FROM late AS l
LEFT JOIN sender AS s ON l.run_id = s.run_id AND l.topic_name = s.topic_name
