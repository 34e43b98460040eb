-- description: Everything that has a row in the timeline, in its order: by host, process and node;
--     there the states of a managed node, timers, subscriptions, services, clients, publishers and
--     events of the user, and below each process the threads of its executors. Where the kernel was
--     traced: below that each thread as the kernel saw it, and at the end of a host its cores.
-- grain: one row per row of the timeline
-- column: row_key BIGINT  Identity of the row: eight times that of the object, plus its kind; of
--     events see event_row.sql; of states -4 times that of the node, less 1, of threads to the
--     kernel -4 times that of the thread, less 2, of cores -4 times the object_id, less 3
-- column: kind VARCHAR  'timer', 'subscription', 'service', 'client', 'publisher', 'callback' (of
--     an unknown kind), 'event' (of the user), 'state' (of a managed node), 'thread' (of an
--     executor), 'schedule' (a thread to the kernel), 'core' or 'middleware' (what belongs to no
--     object of a node)
-- column: object_id BIGINT  Identity of the timer, subscription, …; of 'middleware' the process, of
--     'state' the node, of 'event' the first, of 'core' its number and 8192 times that of its host
--     (Linux has no more cores)
-- column: host
-- column: process VARCHAR  Name of the process and its pid; of cores 'cores'
-- column: process_id BIGINT  Identity of the process; of cores minus that of the host
-- column: node VARCHAR  Full name of the node; NULL: none, or not known
-- column: label VARCHAR  Period, topic, service, name of the event, or thread
-- column: symbol VARCHAR  Functions registered for its callbacks
-- column: is_internal
WITH symbol AS (
    SELECT timer_id, subscription_id, service_id,
        string_agg(DISTINCT symbol, ', ' ORDER BY symbol) AS symbol
    FROM main.callback
    WHERE run_id = $run AND symbol IS NOT NULL
    GROUP BY timer_id, subscription_id, service_id
),
object AS (
    SELECT
        8 * t.timer_id AS row_key,
        'timer' AS kind,
        t.timer_id AS object_id,
        t.process_id, t.node_id,
        coalesce(printf('%.10g ms', t.period_ns / 1e6), printf('0x%x', t.timer_handle)) AS label,
        s.symbol,
        false AS is_internal,
        1 AS place
    FROM main.timer AS t
    LEFT JOIN symbol AS s ON t.timer_id = s.timer_id
    WHERE t.run_id = $run
    UNION ALL
    SELECT
        8 * o.subscription_id + 1,
        'subscription', o.subscription_id, o.process_id, o.node_id,
        coalesce(o.topic_name, '?'),
        s.symbol, o.is_internal, 2
    FROM main.subscription AS o
    LEFT JOIN symbol AS s ON o.subscription_id = s.subscription_id
    WHERE o.run_id = $run
    UNION ALL
    SELECT
        8 * o.service_id + 2,
        'service', o.service_id, o.process_id, o.node_id,
        coalesce(o.service_name, '?'),
        s.symbol, o.is_internal, 3
    FROM main.service AS o
    LEFT JOIN symbol AS s ON o.service_id = s.service_id
    WHERE o.run_id = $run
    UNION ALL
    SELECT
        8 * client_id + 3,
        'client', client_id, process_id, node_id,
        coalesce(service_name, '?'),
        NULL, is_internal, 4
    FROM main.client
    WHERE run_id = $run
    UNION ALL
    SELECT
        8 * publisher_id + 4,
        'publisher', publisher_id, process_id, node_id,
        coalesce(topic_name, '?'),
        NULL, is_internal, 5
    FROM main.publisher
    WHERE run_id = $run
    UNION ALL
    SELECT
        8 * c.callback_id + 5,
        'callback', c.callback_id, c.process_id, c.node_id, l.label, c.symbol, l.is_internal, 6
    FROM main.callback AS c
    JOIN main.callback_label AS l ON c.callback_id = l.callback_id
    JOIN callback_row AS r ON c.callback_id = r.callback_id
    WHERE c.run_id = $run AND r.row_key = 8 * c.callback_id + 5
    UNION ALL
    SELECT
        row_key, 'event',
        -row_key // 4,
        process_id, node_id, name, NULL, false, 9
    FROM event_row
    WHERE run_id = $run
    UNION ALL
    SELECT DISTINCT
        -4 * n.node_id - 1,
        'state', n.node_id, n.process_id, n.node_id, 'state', NULL, false, 0
    FROM main.node_state AS s
    JOIN main.node AS n ON s.node_id = n.node_id
    WHERE s.run_id = $run
    UNION ALL
    SELECT
        8 * x.thread_id + 6,
        'thread', x.thread_id, t.process_id, NULL,
        printf('%s %d (%s)', coalesce(t.name, '?'), t.tid, replace(e.kind, '_', '-')),
        NULL, false, 8
    FROM main.executor_thread AS x
    JOIN main.executor AS e ON x.executor_id = e.executor_id
    JOIN main.thread AS t ON x.thread_id = t.thread_id
    WHERE x.run_id = $run
    QUALIFY row_number() OVER (PARTITION BY x.thread_id ORDER BY x.executor_id) = 1
    UNION ALL
    SELECT
        -4 * t.thread_id - 2,
        'schedule', t.thread_id, t.process_id, NULL,
        printf('%s %d (kernel)', coalesce(t.name, '?'), t.tid),
        NULL, false, 8
    FROM main.thread AS t
    WHERE t.run_id = $run AND t.thread_id IN (SELECT thread_id FROM main.thread_state)
    UNION ALL
    SELECT
        8 * process_id + 7,
        'middleware', process_id, process_id, NULL, 'not of a node', NULL, true, 7
    FROM (
        SELECT process_id FROM main.publication WHERE run_id = $run AND publisher_id IS NULL
        UNION
        SELECT process_id FROM main.take WHERE run_id = $run AND subscription_id IS NULL
    )
),
core AS (
    SELECT DISTINCT p.host_id, s.cpu
    FROM main.thread_state AS s
    JOIN main.thread AS t ON s.thread_id = t.thread_id
    JOIN main.process AS p ON t.process_id = p.process_id
    WHERE s.run_id = $run AND s.cpu IS NOT NULL
),
placed AS (
    SELECT
        o.row_key, o.kind, o.object_id, h.host_id,
        h.hostname AS host,
        printf('%s %d', coalesce(p.name, '?'), p.pid)
            || CASE WHEN p.life > 1 THEN printf(' (life %d)', p.life) ELSE '' END AS process,
        o.process_id,
        n.full_name AS node,
        o.label, o.symbol, o.is_internal, o.place, p.first_seen_ns, n.created_ns, n.node_id
    FROM object AS o
    JOIN main.process AS p ON o.process_id = p.process_id
    JOIN main.host AS h ON p.host_id = h.host_id
    LEFT JOIN main.node AS n ON o.node_id = n.node_id
    UNION ALL
    SELECT
        -4 * (8192 * c.host_id + c.cpu) - 3,
        'core',
        8192 * c.host_id + c.cpu,
        c.host_id, h.hostname, 'cores',
        -c.host_id,
        NULL,
        printf('CPU %d', c.cpu),
        NULL, false, 10, NULL, NULL, NULL
    FROM core AS c
    JOIN main.host AS h ON c.host_id = h.host_id
)
SELECT row_key, kind, object_id, host, process, process_id, node, label, symbol, is_internal
FROM placed
ORDER BY
    host, host_id, kind = 'core', first_seen_ns, process_id, place = 8, place = 7,
    created_ns NULLS LAST, node_id NULLS LAST, place, object_id, kind DESC
