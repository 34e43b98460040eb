-- title: A callback that never ended
-- description: A callback was still running when the recording ended, at least half a second after
--     the last that its thread did, and ten times as long as it ever took before. What its executor
--     had to do besides waits for it: messages that it would have taken are reader_in_callback. If
--     the last that it did was to call a service, it is said what became of that request.
-- cause: It waits for something that cannot come: a lock, or the response of a service that only
--     its own executor could take (a synchronous call in a callback), while its callback group is
--     busy. Or its process crashed in it, or was killed.
-- cure: Call services with call_async (rclpy; await it) or async_send_request (rclcpp), and let the
--     callback return; or give the client a callback group of its own, and its executor a thread
--     more (MultiThreadedExecutor). Without a call, look where it waits (gdb -p PID, thread apply
--     all bt). If its process did nothing since, see its output, and dmesg, for a crash.
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
        CASE
            WHEN a.sent_ns IS NOT NULL THEN printf(
                'its request to %s was answered at %.3f s, and the answer was not taken: a'
                ' synchronous call, in a callback that keeps its executor or group busy',
                coalesce(d.service_name, 'a service'), (a.sent_ns - r.start_ns) / 1e9
            )
            WHEN d.is_own IS NOT NULL THEN printf(
                'its request to %s%s was never answered', coalesce(d.service_name, 'a service'),
                CASE WHEN d.is_own THEN ' of its own process' ELSE '' END
            )
            WHEN p.last_seen_ns > h.last_seen_ns + 500_000_000
                THEN 'other threads of its process went on'
            ELSE 'its process did nothing since: it waits, or it crashed'
        END
    )
    || coalesce(printf(' (msgflow flow --callback-instance %d)', d.callback_instance_id), '')
    AS detail
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
LEFT JOIN derive.last_request AS d ON c.callback_instance_id = d.callback_instance_id
LEFT JOIN main.response AS a ON d.response_id = a.response_id
WHERE e.end_ns - h.last_seen_ns > 500_000_000
    AND e.end_ns - c.start_ns > 10 * coalesce(u.longest_ns, 0)
