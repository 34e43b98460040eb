-- title: What may make data sooner
-- description: Changes that a replay tries, of callbacks that make data of the paths older, or that
--     wait for others: first those of what takes most.
-- grain: one row per change
-- reads: application_path, blame, breakdown, callback_call, callback_cpu, callback_use, culprit,
--     noticed, thread_load
-- column: remedy VARCHAR  What it is: a word that `remedy` has the sentences of
-- column: change VARCHAR  What is changed, as `--set` reads it
-- column: node VARCHAR  Node
-- column: callback VARCHAR  What triggers its callback; NULL: all of the node
-- column: function VARCHAR  Its function; NULL: not known
-- column: topic_name VARCHAR  Topic whose messages it is about; NULL: none
-- column: is_python BOOLEAN  Python runs it
-- column: blamed_ns BIGINT [ns]  For how long it is to blame, on all paths together
WITH blamed AS (
    SELECT
        node, callback, waiting_node, waiting_callback, topic_name, mean_ns,
        waiting_node IS NOT NULL
        AND (waiting_node <> node OR waiting_callback <> callback) AS is_other,
        waiting_node = node AND waiting_callback = callback AS is_own
    FROM blame
    WHERE node IS NOT NULL AND callback IS NOT NULL AND mean_ns > 0
),
team AS (
    SELECT
        l.node, l.callback, l.executor_id,
        (
            SELECT count(*)
            FROM main.executor_thread AS x
            WHERE x.executor_id = l.executor_id
        ) AS threads
    FROM thread_load AS l
),
-- Timers that use what came before, and the topic that leads to them.
cached AS (
    SELECT
        b.node,
        b.what AS callback,
        u.period_ns,
        a.period_ns AS input_ns,
        a.steps[list_position(a.steps, b.node) - 1] AS topic_name,
        b.total_ns / a.reached AS mean_ns
    FROM breakdown AS b
    JOIN application_path AS a ON b.path = a.path
    JOIN callback_use AS u ON b.node = u.node AND b.what = u.callback
    WHERE b.part = 'cache' AND starts_with(b.what, 'Timer(')
),
-- How long messages travel at least, within a process and beyond.
way AS (
    SELECT
        s.topic_name,
        d.full_name AS node,
        p.process_id = s.process_id AS is_within,
        min(l.latency_ns) AS way_ns
    FROM main.link_transport AS l
    JOIN main.publication AS b ON l.publication_id = b.publication_id
    JOIN main.take AS t ON l.take_id = t.take_id
    JOIN main.publisher AS p ON b.publisher_id = p.publisher_id
    JOIN main.subscription AS s ON t.subscription_id = s.subscription_id
    JOIN main.process AS q ON p.process_id = q.process_id
    JOIN main.process AS r ON s.process_id = r.process_id AND q.host_id = r.host_id
    JOIN main.node AS d ON s.node_id = d.node_id
    WHERE list_contains($runs, l.run_id) AND NOT l.is_copy
    GROUP BY s.topic_name, d.full_name, p.process_id = s.process_id
),
candidate (remedy, change, node, callback, topic_name, blamed_ns) AS (
    SELECT
        'own_executor',
        printf('executor(%s %s)=1', node, callback),
        node, callback,
        arg_max(topic_name, mean_ns),
        sum(mean_ns)
    FROM blamed
    WHERE is_other
    GROUP BY node, callback
    UNION ALL
    SELECT
        'own_executor',
        printf('executor(%s %s)=1', waiting_node, waiting_callback),
        waiting_node, waiting_callback,
        arg_max(topic_name, mean_ns),
        sum(mean_ns)
    FROM blamed
    WHERE is_other
    GROUP BY waiting_node, waiting_callback
    UNION ALL
    SELECT
        'own_executor',
        printf('executor(%s)=1', node),
        node, NULL,
        arg_max(topic_name, mean_ns),
        sum(mean_ns)
    FROM blamed
    WHERE is_other AND node <> waiting_node
    GROUP BY node
    UNION ALL
    SELECT
        'more_threads',
        printf('threads(%s)=%d', arg_max(b.node, b.mean_ns), t.threads + 1),
        arg_max(b.node, b.mean_ns),
        NULL,
        arg_max(b.topic_name, b.mean_ns),
        sum(b.mean_ns)
    FROM blamed AS b
    JOIN team AS t ON b.node = t.node AND b.callback = t.callback
    WHERE b.is_other
    GROUP BY t.executor_id, t.threads
    UNION ALL
    SELECT
        'faster',
        printf('duration(%s %s)*0.7', node, callback),
        node, callback, NULL,
        0.3 * sum(mean_ns)
    FROM blamed
    GROUP BY node, callback
    UNION ALL
    SELECT
        'newest_only',
        printf('depth(%s %s)=1', b.node, b.callback),
        b.node, b.callback,
        any_value(b.topic_name),
        sum(b.mean_ns)
    FROM blamed AS b
    WHERE b.is_own AND starts_with(b.callback, 'Subscription(')
    GROUP BY b.node, b.callback
    UNION ALL
    SELECT
        'shorter_period',
        printf('period(%s %s)=%.6gms', node, callback, any_value(period_ns) / 2e6),
        node, callback, NULL,
        sum(mean_ns) / 2
    FROM cached
    GROUP BY node, callback
    UNION ALL
    SELECT
        'react',
        printf('reacts(%s %s)=%s', node, callback, topic_name),
        node, callback, topic_name,
        sum(mean_ns)
    FROM cached
    GROUP BY node, callback, topic_name
    UNION ALL
    -- Of other periods each phase comes by itself.
    SELECT DISTINCT
        'phase',
        printf('phase(%s %s)=%.6gms', node, callback, period_ns * p.share / 1e6),
        node, callback, topic_name, mean_ns
    FROM cached
    CROSS JOIN (VALUES (0.25), (0.5), (0.75)) AS p (share)
    WHERE period_ns BETWEEN 0.99 * input_ns AND 1.01 * input_ns
    UNION ALL
    SELECT
        'one_process',
        printf('way(%s %s)*%.3g', w.node, b.what, greatest(i.way_ns, 1) / w.way_ns),
        w.node, b.what, w.topic_name,
        count(DISTINCT b.path) * (w.way_ns - i.way_ns)
    FROM way AS w
    JOIN breakdown AS b
        ON w.node = b.node AND starts_with(b.what, printf('Subscription(%s)', w.topic_name))
    CROSS JOIN (SELECT min(way_ns) AS way_ns FROM way WHERE is_within HAVING min(way_ns) > 0) AS i
    WHERE NOT w.is_within AND w.way_ns > i.way_ns
    GROUP BY w.node, b.what, w.topic_name, w.way_ns, i.way_ns
    UNION ALL
    SELECT
        'await',
        printf('awaits(%s %s)=%.2f', b.node, b.callback, least(c.share, 0.95)),
        b.node, b.callback,
        any_value(c.service_name),
        sum(b.mean_ns)
    FROM blamed AS b
    JOIN callback_call AS c ON b.node = c.node AND b.callback = c.callback
    CROSS JOIN noticed AS n
    WHERE NOT c.is_awaited AND c.share > n.of_callback AND (b.is_other OR b.is_own)
    GROUP BY b.node, b.callback, c.share
    UNION ALL
    SELECT
        CASE k.kind WHEN 'lock' THEN 'lock' ELSE 'sleep' END,
        printf(
            'duration(%s %s)*%.2f', k.node, k.callback,
            greatest(1 - u.sleeping_ns / u.run_ns, 0.01)
        ),
        k.node, k.callback, NULL,
        k.harm_ns * (u.sleeping_ns / u.run_ns)
    FROM culprit AS k
    JOIN callback_cpu AS u ON k.node = u.node AND k.callback = u.callback
    WHERE k.kind IN ('lock', 'sleeps')
    UNION ALL
    SELECT
        'own_cpu',
        printf('duration(%s %s)*%.2f', u.node, u.callback, 1 - u.waiting_ns / u.run_ns),
        u.node, u.callback, NULL,
        sum(b.mean_ns) * any_value(u.waiting_ns / u.run_ns)
    FROM callback_cpu AS u
    JOIN blamed AS b ON u.node = b.node AND u.callback = b.callback
    CROSS JOIN noticed AS n
    WHERE u.waiting_ns BETWEEN n.of_path * u.run_ns AND 0.99 * u.run_ns
    GROUP BY u.node, u.callback, u.waiting_ns, u.run_ns
)
SELECT
    c.remedy, c.change, c.node, c.callback, u.function, c.topic_name,
    c.node IN (
        SELECT n.full_name
        FROM main.node AS n
        JOIN main.process AS p ON n.process_id = p.process_id
        WHERE list_contains($runs, n.run_id) AND p.python_version IS NOT NULL
    ) AS is_python,
    c.blamed_ns::BIGINT AS blamed_ns
FROM candidate AS c
LEFT JOIN callback_use AS u ON c.node = u.node AND c.callback = u.callback
-- What takes less of their time gains next to nothing.
WHERE c.blamed_ns >= 0.02 * (SELECT sum(latency_ns) FROM application_path)
QUALIFY row_number() OVER (PARTITION BY c.change ORDER BY c.blamed_ns DESC, c.remedy) = 1
ORDER BY c.blamed_ns DESC, c.change
