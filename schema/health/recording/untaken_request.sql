-- title: A service that takes no more requests
-- description: Requests were sent until the end, and from some moment on the service took none, in
--     half a second or longer, ten times as long as usual and twice as long as ever, though its
--     process went on. Who sent them waits, or goes on without an answer. What its thread ran
--     meanwhile most of the time is named.
-- cause: Its executor has something else to run whenever it looks: timers and subscriptions come
--     before services. Or a callback never ends, or the two do not reach each other any more.
-- cure: Make what it runs meanwhile shorter than its period, or give the service a callback group
--     of its own, and its executor a thread more (MultiThreadedExecutor).
-- next: query service-latency
-- grain: one row per service
-- severity: warning
-- when: store.request WHERE taken_ns IS NULL
WITH sent AS (
    SELECT
        v.service_id, q.sent_ns, r.start_ns, r.end_ns,
        q.taken_ns - q.sent_ns AS wait_ns,
        max(
            CASE
                WHEN q.taken_ns IS NOT NULL
                    OR q.request_id IN (SELECT request_id FROM store.response)
                    THEN q.sent_ns
            END
        ) OVER (PARTITION BY q.client_id) AS last_ns
    FROM main.request AS q
    JOIN store.client AS c ON q.client_id = c.client_id
    JOIN (
        SELECT
            run_id, service_name,
            any_value(service_id) AS service_id
        FROM store.service
        -- A process that records no requests seems to take none.
        WHERE NOT is_internal AND process_id IN (SELECT process_id FROM derive.call_traced)
        GROUP BY run_id, service_name
        HAVING count(*) = 1
    ) AS v
        ON q.run_id = v.run_id AND c.service_name = v.service_name
    JOIN main.run AS r ON q.run_id = r.run_id
),
untaken AS MATERIALIZED (
    SELECT
        service_id, start_ns, end_ns,
        any_value(requests) AS requests,
        count(*) AS number,
        min(sent_ns) AS since_ns
    FROM (
        SELECT
            *,
            count(*) OVER (PARTITION BY service_id) AS requests,
            quantile_disc(wait_ns, 0.5) OVER (PARTITION BY service_id) AS usual_ns,
            max(wait_ns) OVER (PARTITION BY service_id) AS longest_ns
        FROM sent
    )
    WHERE sent_ns > coalesce(last_ns, 0) AND sent_ns < end_ns - 500_000_000
    GROUP BY service_id, start_ns, end_ns
    HAVING (count(*) >= 3 OR any_value(usual_ns) IS NOT NULL)
        AND end_ns - since_ns > 10 * coalesce(any_value(usual_ns), 0)
        AND end_ns - since_ns > 2 * coalesce(any_value(longest_ns), 0)
),
-- What threads of its node ran most of the time.
meanwhile AS (
    SELECT
        u.service_id, i.callback_id,
        sum(coalesce(i.end_ns, u.end_ns) - greatest(i.start_ns, u.since_ns))
            / any_value(u.end_ns - u.since_ns) AS share
    FROM untaken AS u
    JOIN store.service AS v ON u.service_id = v.service_id
    JOIN main.callback_instance AS i
        ON i.parent_id IS NULL AND coalesce(i.end_ns, u.end_ns) > u.since_ns
    WHERE i.thread_id IN (
        SELECT o.thread_id
        FROM store.callback_instance AS o
        JOIN store.callback AS c ON o.callback_id = c.callback_id
        WHERE c.node_id = v.node_id
    )
    GROUP BY u.service_id, i.callback_id
    HAVING share > 0.5
    QUALIFY row_number() OVER (PARTITION BY u.service_id ORDER BY share DESC, i.callback_id) = 1
)
SELECT
    v.run_id, v.process_id, v.node_id,
    n.full_name || ' Service(' || v.service_name || ')' AS subject,
    u.number AS count,
    printf(
        '%d of %d requests to %s are not taken, all since %.3f s', u.number, u.requests,
        v.service_name, (u.since_ns - u.start_ns) / 1e9
    )
    || coalesce(
        printf(
            ': its executor runs %s %s for %.0f %% of that time', l.node, l.label,
            100 * least(m.share, 1)
        ),
        ''
    ) AS detail
FROM untaken AS u
JOIN store.service AS v ON u.service_id = v.service_id
JOIN main.process AS p ON v.process_id = p.process_id
LEFT JOIN store.node AS n ON v.node_id = n.node_id
LEFT JOIN meanwhile AS m ON u.service_id = m.service_id
LEFT JOIN main.callback_label AS l ON m.callback_id = l.callback_id
-- One that ended takes nothing.
WHERE m.share IS NOT NULL OR u.number >= 3 AND p.last_seen_ns > u.since_ns + 500_000_000
