-- title: What makes data late, or lets them get lost
-- description: Everything on the paths of an explanation that costs time or messages, whether it
--     matters or not. The cost is by how much the data at the end of the path are older because of
--     it: 95 % of the messages are delayed by no more. By how much half of them are, where it only
--     may be so: what is certain comes before a doubt. It reads what an explanation has by then.
-- grain: one row per kind, culprit and path
-- reads: breakdown, delivery, open_end, path_row, why_callback
-- param: asked_ns BIGINT  Begin of what was asked for: with the warm-up, which start_ns leaves out
-- column: kind VARCHAR  'callback', 'executor', 'cpu', 'service', 'queue', 'lost', 'late_start',
--     'stale' or 'way'
-- column: who VARCHAR  The culprit: a node, or a thread without ROS
-- column: what VARCHAR  What it does: its callback, service or topic
-- column: path VARCHAR  Path that it delays
-- column: cost_ns BIGINT [ns]  By how much
-- column: matters BOOLEAN  It is enough to be told
-- column: clause VARCHAR  What is to be said of the culprit
-- column: lacks VARCHAR  What was not recorded that would tell whether it is so: 'kernel' or
--     'callbacks'
WITH span AS (
    SELECT
        run_id,
        least(end_ns, $end_ns) - greatest(start_ns, $start_ns) AS length_ns,
        run_id IN (SELECT run_id FROM main.thread_state WHERE $has_kernel) AS has_kernel
    FROM main.run
    WHERE list_contains($runs, run_id)
),
place AS MATERIALIZED (
    SELECT DISTINCT
        b.node, b.what, b.path, b.part, b.p95_ns,
        e.p95_ns AS path_ns,
        s.length_ns / nullif(e.roots, 0) AS period_ns,
        s.has_kernel,
        (b.node, b.what) IN (
            SELECT (node, label) FROM main.callback_label WHERE list_contains($runs, run_id)
            UNION ALL
            SELECT (node, label) FROM why_callback
        ) AS is_traced
    FROM breakdown AS b
    JOIN path_row AS e ON b.path = e.path AND b.run_id = e.run_id
    JOIN span AS s ON b.run_id = s.run_id
    -- Below 0 where clocks are apart: nobody makes such a path late.
    WHERE (e.p95_ns > 0) IS NOT FALSE
),
way AS MATERIALIZED (
    SELECT DISTINCT
        path, path_ns,
        string_split(path, ' → ') AS steps
    FROM place
),
callback AS MATERIALIZED (
    SELECT
        -- Nothing takes more than its path has: callbacks also run for what is not on it. What is
        -- not known stays so; least() would forget that.
        m.* REPLACE (
            m.cpu_ns - greatest(m.cpu_ns - p.path_ns, 0) AS cpu_ns,
            least(m.call_ns, p.path_ns) AS call_ns,
            least(m.other_ns, p.path_ns) AS other_ns, least(m.beside_ns, p.path_ns) AS beside_ns,
            -- Further messages wait for what a callback waits for.
            CASE WHEN m.call_ns <= m.computed_ns THEN least(m.own_ns, p.path_ns) ELSE 0 END
                AS own_ns
        ),
        CASE WHEN m.call_ns > m.computed_ns THEN least(m.own_ns, p.path_ns) ELSE 0 END
            AS queued_ns,
        p.path, p.p95_ns, p.path_ns, p.has_kernel,
        -- A callback may take up to most of its period, or 20 ms: a controller of 50 Hz notices.
        least(20_000_000, 0.8 * m.period_ns) AS limit_ns,
        m.computed_ns > 3 * m.usual_ns AND NOT p.has_kernel AS is_unusual
    FROM why_callback AS m
    JOIN place AS p ON m.node = p.node AND m.label = p.what
    WHERE p.part IN ('callback', 'service')
),
computing AS (
    SELECT
        node, label, path, path_ns, limit_ns, is_unusual, usual_ns,
        greatest(least(p95_ns, computed_ns), 0) + own_ns AS cost_ns,
        own_ns,
        true AS is_traced
    FROM callback
    UNION ALL
    -- Callbacks that are not traced: from a take to what is published.
    SELECT node, what, path, path_ns, 20_000_000, false, NULL, p95_ns, 0, false
    FROM place
    WHERE part = 'callback' AND NOT is_traced
),
other AS (
    SELECT
        c.node, c.label, c.path, c.path_ns, c.limit_ns, c.has_kernel,
        greatest(c.other_ns, c.beside_ns) AS other_ns,
        -- The groups of callbacks are not in a trace: a thread may be free, and must not run them.
        c.beside_ns > 2 * c.other_ns AS is_supposed,
        c.other_run_ns,
        o.node AS other_node,
        o.label AS other_label,
        o.callback_id,
        s.server AS likely_server,
        s.service_name AS likely_service
    FROM callback AS c
    JOIN main.callback_label AS o ON c.other_id = o.callback_id
    -- On a path it is known what it waits for, as far as times show it.
    LEFT JOIN why_callback AS s
        ON o.node = s.node AND o.label = s.label AND NOT s.is_recorded
        AND s.call_ns > s.computed_ns
),
-- How long those run that keep others waiting, and the service that they wait for themselves.
holding AS (
    SELECT
        i.callback_id,
        quantile_disc(i.end_ns - i.start_ns, 0.5) AS usual_ns,
        quantile_disc(i.end_ns - i.start_ns, 0.95) AS run_ns,
        arg_max(w.service_name, w.call_ns) AS service_name,
        arg_max(w.server, w.call_ns) AS server,
        sum(w.call_ns) > 0.5 * sum(i.end_ns - i.start_ns) AS is_calling
    FROM main.callback_instance AS i
    LEFT JOIN (
        SELECT
            callback_instance_id,
            sum(returned_ns - sent_ns) AS call_ns,
            arg_max(service_name, returned_ns - sent_ns) AS service_name,
            arg_max(
                coalesce(server, 'a server that is not recorded'), returned_ns - sent_ns
            ) AS server
        FROM main.waited_call
        WHERE $has_calls AND list_contains($runs, run_id)
        GROUP BY callback_instance_id
    ) AS w
        ON i.callback_instance_id = w.callback_instance_id
    WHERE i.callback_id IN (SELECT callback_id FROM other)
        AND i.start_ns >= $start_ns AND i.start_ns < $end_ns
    GROUP BY i.callback_id
),
-- Subscriptions with messages that failed, from the first that they took on.
failing AS (
    SELECT
        d.topic_name, d.subscriber, d.subscription_id, d.dropped, d.lost, d.delivered, s.queue_depth
    FROM delivery AS d
    JOIN main.subscription AS s ON d.subscription_id = s.subscription_id
    WHERE d.dropped + d.lost > 0
),
flowing AS (
    SELECT
        f.subscription_id,
        (count(*) - 1) * 1e9 / nullif(max(b.start_ns) - min(b.start_ns), 0) AS in_hz,
        -- One message has no rate.
        (nullif(greatest(count(*) FILTER (WHERE d.status = 'delivered'), 1), 1) - 1) * 1e9
        / nullif(max(b.start_ns) - min(b.start_ns), 0) AS out_hz
    FROM failing AS f
    JOIN main.stat_delivery AS d ON f.subscription_id = d.subscription_id
    JOIN main.publication AS b ON d.publication_id = b.publication_id
    WHERE d.status IN ('delivered', 'dropped', 'lost')
        AND b.start_ns >= $asked_ns AND b.start_ns < $end_ns
    GROUP BY f.subscription_id
),
failed AS (
    SELECT
        f.topic_name, f.subscriber, f.dropped, f.lost,
        f.delivered + f.dropped + f.lost AS known,
        f.queue_depth, w.in_hz, w.out_hz, p.path, p.path_ns
    FROM failing AS f
    JOIN flowing AS w ON f.subscription_id = w.subscription_id
    JOIN way AS p
        ON list_contains(p.steps, f.subscriber)
        AND list_contains(p.steps, coalesce(f.topic_name, '?'))
),
created AS (
    SELECT
        n.full_name, n.created_ns,
        quantile_disc(n.created_ns, 0.5) OVER () AS usual_ns,
        s.length_ns
    FROM main.node AS n
    JOIN span AS s ON n.run_id = s.run_id
    WHERE NOT n.is_inferred
),
late AS (
    SELECT
        c.full_name AS node,
        p.path, p.path_ns,
        (c.created_ns - c.usual_ns)::BIGINT AS cost_ns,
        d.missed, d.topic_name, d.published
    FROM created AS c
    JOIN way AS p ON list_contains(p.steps, c.full_name)
    LEFT JOIN (
        SELECT
            subscriber,
            sum(published) AS published,
            string_agg(topic_name, ', ') AS topic_name,
            sum(reasons['before_subscription'])::BIGINT AS missed
        FROM delivery
        WHERE reasons['before_subscription'] > 0
        GROUP BY subscriber
    ) AS d
        ON c.full_name = d.subscriber
    -- A robot starts within seconds; of a long recording a short begin does not matter.
    WHERE c.created_ns - c.usual_ns > greatest(2_000_000_000, 0.02 * c.length_ns)
        AND c.created_ns >= $asked_ns AND c.created_ns < $end_ns
),
-- What timers may use, by all that their nodes keep and that comes more often.
kept AS (
    SELECT
        n.full_name AS node,
        d.topic_name, t.period_ns,
        string_agg(
            printf('on %s every %s', d.topic_name, main.duration_text(c.period_ns::BIGINT)), ', '
        ) OVER (
            PARTITION BY d.timer_id ORDER BY d.topic_name
            ROWS BETWEEN UNBOUNDED PRECEDING AND UNBOUNDED FOLLOWING
        ) AS inputs
    FROM open_end AS d
    JOIN main.node AS n ON d.node_id = n.node_id
    JOIN main.timer AS t ON d.timer_id = t.timer_id
    JOIN why_callback AS c
        ON n.full_name = c.node AND c.label = 'Subscription(' || d.topic_name || ')'
    WHERE t.period_ns >= 2 * c.period_ns
),
sampled AS (
    SELECT
        p.node, p.what, p.path, p.path_ns,
        p.p95_ns AS cost_ns,
        NULL AS inputs,
        -- A callback of a message has to wait for the other inputs that it uses together.
        starts_with(p.what, 'Timer(') AND c.period_ns >= 2 * p.period_ns
        AND p.p95_ns >= 20_000_000 AS matters
    FROM place AS p
    JOIN callback AS c ON p.node = c.node AND p.what = c.label AND p.path = c.path
    WHERE p.part = 'cache'
    UNION ALL
    SELECT
        k.node,
        printf('Timer(%.10g ms)', k.period_ns / 1e6),
        p.path, p.path_ns,
        k.period_ns // 2,
        printf('%s and wait for up to %s', k.inputs, main.duration_text(k.period_ns)),
        k.period_ns >= 20_000_000
    FROM kept AS k
    JOIN way AS p ON ends_with(p.path, ' → ' || k.topic_name || ' → ' || k.node)
),
-- Executors of several threads that look for work again and again.
awake AS (
    SELECT
        n.full_name AS node,
        min(f.detail) AS detail
    FROM store.finding AS f
    JOIN main.node AS n ON f.process_id = n.process_id
    WHERE f.name = 'busy_waiting' AND list_contains($runs, f.run_id)
    GROUP BY n.full_name
),
moving AS (
    SELECT
        p.what AS topic,
        p.path, p.path_ns, p.has_kernel,
        true AS is_traced,
        c.node,
        -- A thread that waits for a CPU, and not for work, is not known to have some: messages that
        -- wait for others then seem to be on the way, unless their arrival is known.
        greatest(
            p.p95_ns - coalesce(
                coalesce(c.cpu_ns, 0) + greatest(c.beside_ns - c.other_ns, 0)
                + CASE WHEN p.part = 'until_arrival' THEN 0 ELSE c.own_ns + c.queued_ns END
                + CASE WHEN p.part = 'until_arrival' OR p.p95_ns <= 2 * c.period_ns
                    THEN 0 ELSE c.other_ns END,
                0
            ),
            0
        ) AS cost_ns
    FROM place AS p
    LEFT JOIN callback AS c
        ON p.path = c.path AND c.label = 'Subscription(' || p.what || ')'
    WHERE p.part IN ('network_or_idle', 'until_arrival')
    UNION ALL
    -- Where no callbacks are traced.
    SELECT what, path, path_ns, has_kernel, false, node, p95_ns
    FROM place
    WHERE part = 'undecided' AND NOT is_traced
)
SELECT
    'callback' AS kind,
    node AS who,
    label AS what,
    path, cost_ns,
    cost_ns >= limit_ns AND cost_ns >= 0.1 * path_ns AS matters,
    printf(
        CASE
            WHEN is_traced THEN 'its callback %s takes %s of %s'
            ELSE 'what it does with a message on %s takes %s of %s'
        END,
        label, main.duration_text(cost_ns - own_ns), main.duration_text(path_ns)
    )
    || CASE WHEN own_ns > 0.2 * cost_ns
        THEN printf(', and further messages wait for it for %s', main.duration_text(own_ns))
        ELSE '' END
    || CASE WHEN is_unusual
        THEN printf(
            ', usually %s: it ran, or was kept from the CPU', main.duration_text(usual_ns)
        )
        ELSE '' END AS clause,
    CASE WHEN is_unusual THEN 'kernel' END AS lacks
FROM computing
UNION ALL
SELECT
    'executor',
    CASE WHEN h.is_calling THEN h.server ELSE coalesce(o.likely_server, o.other_node) END,
    o.other_label, o.path, o.other_ns,
    o.other_ns >= o.limit_ns AND o.other_ns >= 0.1 * o.path_ns,
    CASE
        WHEN h.is_calling OR o.likely_server IS NOT NULL
            THEN printf(
                'its service %s, for which %s waits (%s)%s,',
                CASE WHEN h.is_calling THEN h.service_name ELSE o.likely_service END,
                o.other_label, main.duration_text(h.run_ns),
                CASE WHEN h.is_calling THEN '' ELSE ' as far as times show' END
            )
        ELSE printf('its callback %s (%s)', o.other_label, main.duration_text(h.run_ns))
    END
    || printf(
        ' keeps %s of %s waiting in their executor, for %s of %s', o.label, o.node,
        main.duration_text(o.other_ns), main.duration_text(o.path_ns)
    )
    || CASE WHEN o.is_supposed THEN ', if one callback group has both' ELSE '' END
    || CASE WHEN greatest(h.run_ns, o.other_run_ns) > 3 * h.usual_ns AND NOT o.has_kernel
        THEN printf(
            '; usually it takes %s: it ran, or was kept from the CPU',
            main.duration_text(h.usual_ns)
        )
        ELSE '' END,
    CASE WHEN greatest(h.run_ns, o.other_run_ns) > 3 * h.usual_ns AND NOT o.has_kernel
        THEN 'kernel' END
FROM other AS o
JOIN holding AS h ON o.callback_id = h.callback_id
UNION ALL
SELECT
    'cpu',
    coalesce(cpu_by, node),
    node, path, cpu_ns,
    cpu_ns >= limit_ns AND cpu_ns >= 0.1 * path_ns,
    CASE WHEN cpu_by IS NULL
        THEN printf(
            'waits for a CPU for %s of %s (what had it is not known)',
            main.duration_text(cpu_ns), main.duration_text(path_ns)
        )
        ELSE printf(
            'takes the CPU from %s, which waits for it for %s of %s', node,
            main.duration_text(cpu_ns), main.duration_text(path_ns)
        )
    END,
    NULL
FROM callback
WHERE cpu_ns > 0
UNION ALL
SELECT
    'service',
    coalesce(server, 'a server that is not recorded'),
    service_name, path,
    call_ns + queued_ns,
    call_ns + queued_ns >= limit_ns AND call_ns + queued_ns >= 0.1 * path_ns,
    printf(
        'its service %s keeps a callback of %s waiting for %s of %s', service_name, node,
        main.duration_text(call_ns), main.duration_text(path_ns)
    )
    || coalesce(printf(' (it answers in %s)', main.duration_text(served_ns)), '')
    || CASE WHEN is_recorded
        THEN ''
        ELSE ', as far as times show (requests are recorded since Kilted)' END
    || CASE WHEN queued_ns > 0.2 * call_ns
        THEN printf(', and further messages wait for that for %s', main.duration_text(queued_ns))
        ELSE '' END,
    NULL
FROM callback
WHERE call_ns > 0
UNION ALL
SELECT
    'queue', subscriber, topic_name, path,
    (dropped / known * 1e9 / out_hz)::BIGINT,
    dropped >= 3 AND dropped >= 0.02 * known,
    printf(
        'its queue of %s overwrote %d of %d messages on %s',
        coalesce(queue_depth::VARCHAR, 'unknown depth'), dropped, known, coalesce(topic_name, '?')
    )
    -- A single message has no rate.
    || coalesce(printf(' (%.3g Hz come in, %.3g Hz are taken)', in_hz, out_hz), ''),
    NULL
FROM failed
WHERE dropped > 0
UNION ALL
SELECT
    'lost', subscriber, topic_name, path,
    (lost / known * 1e9 / in_hz)::BIGINT,
    lost >= 3 AND lost >= 0.02 * known,
    printf('%d of %d messages on %s were lost on the way', lost, known, coalesce(topic_name, '?')),
    NULL
FROM failed
WHERE lost > 0
UNION ALL
SELECT
    'late_start', node, topic_name, path, cost_ns, true,
    printf('started %s after the others', main.duration_text(cost_ns))
    || coalesce(printf(' and missed %d of %d messages on %s', missed, published, topic_name), ''),
    NULL
FROM late
UNION ALL
SELECT
    'stale', node, what, path, cost_ns, matters,
    CASE WHEN inputs IS NULL
        THEN printf('its %s uses what it was told before: messages wait for it for %s of %s',
            what, main.duration_text(cost_ns), main.duration_text(path_ns))
        ELSE printf('its %s may use what it was told before: messages come %s'
            || ' (msgflow suggest links)',
            what, inputs)
    END,
    NULL
FROM sampled
UNION ALL
SELECT
    CASE WHEN a.detail IS NULL THEN 'way' ELSE 'executor' END,
    coalesce(m.node, 'between nodes'),
    m.topic, m.path, m.cost_ns,
    m.cost_ns >= 20_000_000 AND m.cost_ns >= 0.1 * m.path_ns,
    printf(
        CASE
            WHEN a.detail IS NOT NULL
                THEN 'messages on %s wait for %s of %s, while its executor looks for work again and'
                || ' again: '
            WHEN NOT m.is_traced
                THEN 'messages on %s are on the way, or wait in its queue, for %s of %s'
            WHEN m.has_kernel THEN 'messages on %s are on the way for %s of %s'
            ELSE 'messages on %s are on the way, or its thread has no CPU, for %s of %s'
        END,
        m.topic, main.duration_text(m.cost_ns), main.duration_text(m.path_ns)
    )
    || coalesce(a.detail || ' (msgflow check)', ''),
    CASE
        WHEN a.detail IS NOT NULL THEN NULL
        WHEN NOT m.is_traced THEN 'callbacks'
        WHEN NOT m.has_kernel THEN 'kernel'
    END
FROM moving AS m
LEFT JOIN awake AS a ON m.node = a.node
