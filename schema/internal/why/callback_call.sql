-- title: Services that callbacks wait for
-- description: Calls of services for whose response a callback waits, or which a coroutine awaits.
--     Releases before Kilted record no requests. Then a callback waits for a service if its process
--     has a client of it, and nearly all that the service did happened in the callback.
-- grain: one row per node, callback and service
-- reads: callback_name, callback_use
-- when: main.client WHERE NOT is_internal
-- column: node VARCHAR  Node that waits
-- column: callback VARCHAR  What triggers its callback
-- column: service_name VARCHAR  The service
-- column: server
-- column: server_callback VARCHAR  What triggers its callback; NULL: not traced
-- column: server_function VARCHAR  Its function; NULL: not known
-- column: usual_ns BIGINT [ns]  Median time of a call
-- column: p95_ns BIGINT [ns]  Median time of the calls that take three times as long, else 95 %
--     take no longer
-- column: long_calls BIGINT  So many calls are so long; NULL: all are alike
-- column: calls BIGINT  All calls
-- column: share DOUBLE  Share of all calls in the time that the callback takes, 0 to 1
-- column: total_ns BIGINT [ns]  All calls together
-- column: is_awaited BOOLEAN  A coroutine awaits it
-- column: is_recorded BOOLEAN  Requests show it; else that its callback ran within this one
WITH within AS (
    SELECT
        i.callback_instance_id,
        v.service_id,
        v.service_name,
        j.callback_instance_id AS server_instance_id,
        j.end_ns - j.start_ns AS call_ns
    FROM main.callback_instance AS i
    -- A process may have several clients of one service.
    JOIN (SELECT DISTINCT run_id, process_id, service_name FROM main.client) AS q
        ON i.process_id = q.process_id
    JOIN main.service AS v ON q.run_id = v.run_id AND q.service_name = v.service_name
    ANTI JOIN main.request AS r ON v.service_id = r.service_id
    JOIN main.callback AS s ON v.service_id = s.service_id
    JOIN main.callback_instance AS j
        ON s.callback_id = j.callback_id AND i.start_ns < j.start_ns AND i.end_ns > j.end_ns
    WHERE list_contains($runs, i.run_id) AND NOT v.is_internal
),
ran_at_all AS (
    SELECT
        s.service_id,
        count(*) AS instances
    FROM main.callback AS s
    JOIN main.callback_instance AS j ON s.callback_id = j.callback_id
    WHERE s.service_id IN (SELECT service_id FROM within)
    GROUP BY s.service_id
),
call AS MATERIALIZED (
    SELECT
        w.callback_instance_id, w.service_name, w.server, w.server_instance_id,
        w.returned_ns - w.sent_ns AS call_ns,
        w.is_awaited,
        true AS is_recorded
    FROM main.waited_call AS w
    WHERE $has_calls AND list_contains($runs, w.run_id)
    UNION ALL
    SELECT
        w.callback_instance_id, w.service_name, NULL, w.server_instance_id, w.call_ns, false,
        false
    FROM within AS w
    JOIN ran_at_all AS a ON w.service_id = a.service_id
    QUALIFY count(DISTINCT w.server_instance_id) OVER (PARTITION BY w.service_id)
        >= 0.9 * a.instances
),
named AS (
    SELECT
        n.node, n.callback, c.service_name, c.call_ns, c.is_awaited, c.is_recorded,
        coalesce(s.node, c.server, 'a server that is not recorded') AS server,
        coalesce(s.callback, g.callback) AS server_callback,
        -- A goal is accepted by another function than the one that executes it.
        CASE WHEN NOT ends_with(c.service_name, '/_action/send_goal')
            THEN coalesce(s.function, g.function) END AS server_function,
        quantile_disc(c.call_ns, 0.5) OVER (
            PARTITION BY n.node, n.callback, c.service_name
        ) AS usual_ns
    FROM call AS c
    JOIN main.callback_instance AS i ON c.callback_instance_id = i.callback_instance_id
    JOIN callback_name AS n ON i.callback_id = n.callback_id
    LEFT JOIN main.callback_instance AS j ON c.server_instance_id = j.callback_instance_id
    LEFT JOIN callback_name AS s ON j.callback_id = s.callback_id
    -- The result of an action is that of its execution.
    LEFT JOIN (SELECT DISTINCT node, callback, function FROM callback_name) AS g
        ON c.server = g.node
        AND g.callback = printf(
            'Action(%s)', regexp_replace(c.service_name, '/_action/get_result$', '')
        )
    WHERE i.start_ns >= $start_ns AND i.start_ns < $end_ns
),
measured AS (
    SELECT
        node, callback, service_name,
        any_value(server) AS server,
        any_value(server_callback) AS server_callback,
        any_value(server_function) AS server_function,
        bool_or(is_awaited) AS is_awaited,
        bool_and(is_recorded) AS is_recorded,
        any_value(usual_ns) AS usual_ns,
        count(*) AS calls,
        sum(call_ns)::BIGINT AS total_ns,
        sum(call_ns) FILTER (WHERE is_awaited) AS awaited_ns,
        quantile_disc(call_ns, 0.95) AS p95_ns,
        count(*) FILTER (WHERE call_ns > 3 * usual_ns) AS long_calls,
        quantile_disc(call_ns, 0.5) FILTER (WHERE call_ns > 3 * usual_ns) AS long_ns
    FROM named
    GROUP BY node, callback, service_name
)
SELECT
    m.node, m.callback, m.service_name, m.server, m.server_callback, m.server_function,
    m.usual_ns,
    CASE WHEN m.long_calls >= 3 THEN m.long_ns ELSE m.p95_ns END AS p95_ns,
    CASE WHEN m.long_calls >= 3 THEN m.long_calls END AS long_calls,
    m.calls,
    sum(m.total_ns) OVER (PARTITION BY m.node, m.callback)
    / greatest(u.mean_ns * u.instances + coalesce(m.awaited_ns, 0), 1) AS share,
    m.total_ns, m.is_awaited, m.is_recorded
FROM measured AS m
JOIN callback_use AS u ON m.node = u.node AND m.callback = u.callback
