-- title: A callback that never ended
-- description: A callback was still running when the recording ended, at least half a second after
--     the last that its thread did, and ten times as long as it ever took before. What its executor
--     had to do besides waits for it: messages that it would have taken are reader_in_callback.
-- cause: It waits for something that cannot come: a lock, or the response of a service that only
--     its own executor could take (a synchronous call in a callback). Or its process crashed in it,
--     or was killed.
-- cure: Look where it waits (gdb -p PID, thread apply all bt), call services with
--     async_send_request, and let the callback return. If its process did nothing since, see its
--     output, and dmesg, for a crash.
-- grain: one row per callback and thread
-- severity: error
-- when: store.callback_instance WHERE end_ns IS NULL
WITH hanging AS MATERIALIZED (
    SELECT run_id, process_id, thread_id, callback_instance_id, callback_id, start_ns
    FROM derive.hanging_callback
),
host_end AS (
    SELECT
        host_id,
        max(last_seen_ns) AS end_ns
    FROM store.process
    GROUP BY host_id
),
usual AS (
    SELECT
        callback_id,
        count(*) AS runs,
        max(end_ns - start_ns) AS longest_ns,
        quantile_disc(end_ns - start_ns, 0.5) AS median_ns
    FROM store.callback_instance
    WHERE callback_id IN (SELECT callback_id FROM hanging) AND end_ns IS NOT NULL
    GROUP BY callback_id
)
SELECT
    c.run_id, c.thread_id, b.node_id, s.topic_name,
    l.node || ' ' || l.label AS subject,
    1 AS count,
    printf(
        'open since %.3f s until the end, %.3f s later; %s; %s',
        (i.start_ns - r.start_ns) / 1e9, (e.end_ns - c.start_ns) / 1e9,
        CASE WHEN u.runs IS NULL THEN 'it is its first run'
            ELSE printf('usually %.3f ms', u.median_ns / 1e6) END,
        CASE WHEN p.last_seen_ns > h.last_seen_ns + 500_000_000
            THEN 'other threads of its process went on'
            ELSE 'its process did nothing since: it waits, or it crashed' END
    ) AS detail
FROM hanging AS c
JOIN main.callback_instance AS i ON c.callback_instance_id = i.callback_instance_id
JOIN main.run AS r ON c.run_id = r.run_id
JOIN main.callback_label AS l ON c.callback_id = l.callback_id
JOIN store.thread AS h ON c.thread_id = h.thread_id
JOIN store.process AS p ON c.process_id = p.process_id
JOIN host_end AS e ON p.host_id = e.host_id
JOIN store.callback AS b ON c.callback_id = b.callback_id
LEFT JOIN store.subscription AS s ON b.subscription_id = s.subscription_id
LEFT JOIN usual AS u ON c.callback_id = u.callback_id
WHERE e.end_ns - h.last_seen_ns > 500_000_000
    AND e.end_ns - c.start_ns > 10 * coalesce(u.longest_ns, 0)
