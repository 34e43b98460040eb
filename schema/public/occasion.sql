-- description: What began, ended, or happened once, besides what is measured: nodes, their objects,
--     transitions, parameters, goals, rare requests, programs, lost events, clocks that were set.
-- grain: one row per occasion
-- param: runs, series
-- column: run_id
-- column: kind VARCHAR  'node', 'restart', 'object', 'state', 'parameter', 'goal', 'request',
--     'program', 'loss' or 'clock'
-- column: at_ns BIGINT [epoch ns]  When it happened
-- column: nodes VARCHAR[]  Nodes that it is of
-- column: topics VARCHAR[]  Topics that it is about
-- column: host_id BIGINT  Machine that it happened on; NULL: any
-- column: sentence VARCHAR  What happened
CREATE OR REPLACE MACRO main.occasion(runs, series) AS TABLE
WITH life AS (
    SELECT
        n.run_id,
        n.full_name AS node,
        n.created_ns, p.host_id, p.process_id, p.last_seen_ns, r.start_ns, r.end_ns,
        list_distinct(list(s.topic_name) FILTER (s.topic_name IS NOT NULL)) AS topics,
        list_distinct(list(s.topic_name) FILTER (s.owner = 'subscription')) AS takes
    FROM main.node AS n
    JOIN main.process AS p ON n.process_id = p.process_id
    JOIN main.run AS r ON n.run_id = r.run_id
    LEFT JOIN query_table(series) AS s ON n.process_id = s.process_id AND n.full_name = s.node
    WHERE list_contains(runs, n.run_id)
    GROUP BY ALL
),
-- The last message on each topic.
heard AS (
    SELECT
        s.run_id, s.topic_name,
        max(b.start_ns) AS last_ns
    FROM main.publication AS b
    JOIN query_table(series) AS s ON s.owner = 'publisher' AND b.publisher_id = s.object_id
    GROUP BY s.run_id, s.topic_name
),
timed AS (
    SELECT DISTINCT c.process_id
    FROM main.callback AS c
    JOIN main.callback_instance AS i ON c.callback_id = i.callback_id
    WHERE list_contains(runs, c.run_id) AND c.kind = 'timer'
),
object AS (
    SELECT
        'Subscription' AS label,
        node_id, topic_name, created_ns
    FROM main.subscription
    WHERE list_contains(runs, run_id) AND NOT is_internal
    UNION ALL
    SELECT 'Publisher', node_id, topic_name, created_ns
    FROM main.publisher
    WHERE list_contains(runs, run_id) AND NOT is_internal
),
taken AS (
    SELECT
        o.run_id, o.host_id,
        coalesce(o.program, '?') AS program,
        p.start_ns, p.end_ns
    FROM main.preemptor AS p
    JOIN main.other_thread AS o ON p.preemptor_other_thread_id = o.other_thread_id
    WHERE list_contains(runs, o.run_id) AND NOT coalesce(o.is_recorder, false)
),
clock_step AS (
    SELECT
        b.run_id, p.host_id,
        min(b.start_ns) AS at_ns,
        min(t.source_timestamp_ns - b.start_ns)
        - lag(min(t.source_timestamp_ns - b.start_ns))
            OVER (PARTITION BY p.host_id ORDER BY min(b.start_ns))
        AS step_ns
    FROM main.process AS p
    JOIN main.publication AS b ON p.process_id = b.process_id
    JOIN main.link_transport AS l ON b.publication_id = l.publication_id
    JOIN main.take AS t ON l.take_id = t.take_id
    WHERE list_contains(runs, b.run_id)
        AND p.host_id IN (SELECT host_id FROM main.finding WHERE name = 'clock_jumps')
        AND t.source_timestamp_ns <> 0
    GROUP BY b.run_id, p.host_id, b.start_ns // 100_000_000
),
asked AS (
    SELECT
        q.run_id,
        coalesce(q.sent_ns, q.taken_ns) AS at_ns,
        list_filter([m.full_name, n.full_name], lambda name: name IS NOT NULL) AS nodes,
        string_split(coalesce(v.service_name, c.service_name), '/_action/') AS names
    FROM main.request AS q
    LEFT JOIN main.service AS v ON q.service_id = v.service_id
    LEFT JOIN main.node AS n ON v.node_id = n.node_id
    LEFT JOIN main.client AS c ON q.client_id = c.client_id
    LEFT JOIN main.node AS m ON c.node_id = m.node_id
    WHERE list_contains(runs, q.run_id) AND NOT coalesce(v.is_internal, c.is_internal, false)
)
SELECT
    run_id,
    CASE WHEN is_again THEN 'restart' ELSE 'node' END AS kind,
    created_ns AS at_ns,
    [node] AS nodes,
    topics, host_id,
    printf('%s began%s', node, CASE WHEN is_again THEN ' again' ELSE '' END) AS sentence
FROM (
    SELECT
        *,
        lag(last_seen_ns) OVER (PARTITION BY run_id, node ORDER BY created_ns) < created_ns
            AS is_again
    FROM life
)
WHERE created_ns > start_ns + 1_000_000_000
UNION ALL
SELECT
    run_id, 'node', last_seen_ns,
    [node],
    topics, host_id,
    printf('%s is not seen any more', node)
FROM life AS l
WHERE l.last_seen_ns < l.end_ns - 1_000_000_000
    -- One that gets no messages any more, and has no timer, may be well.
    AND (
        l.process_id IN (SELECT process_id FROM timed)
        OR EXISTS (
            FROM heard AS h
            WHERE h.run_id = l.run_id
                AND list_contains(l.takes, h.topic_name)
                AND h.last_ns > l.last_seen_ns + 100_000_000
        )
    )
UNION ALL
SELECT
    n.run_id, 'object', o.created_ns,
    [n.full_name],
    [o.topic_name],
    p.host_id,
    printf('%s(%s) of %s began', o.label, o.topic_name, n.full_name)
FROM object AS o
JOIN main.node AS n ON o.node_id = n.node_id
JOIN main.process AS p ON n.process_id = p.process_id
WHERE o.created_ns > n.created_ns + 1_000_000_000
UNION ALL
SELECT
    t.run_id, 'state', t.at_ns,
    [n.full_name],
    [],
    p.host_id,
    printf('%s became %s', n.full_name, t.goal_state)
FROM main.lifecycle_transition AS t
JOIN main.node AS n ON t.node_id = n.node_id
JOIN main.process AS p ON n.process_id = p.process_id
WHERE list_contains(runs, t.run_id)
UNION ALL
SELECT
    b.run_id,
    CASE WHEN u.topic_name = '/parameter_events' THEN 'parameter' ELSE 'goal' END,
    b.start_ns,
    [n.full_name],
    [],
    p.host_id,
    CASE WHEN u.topic_name = '/parameter_events'
        THEN printf('a parameter of %s was set', n.full_name)
        ELSE printf('a goal of %s began or ended', replace(u.topic_name, '/_action/status', ''))
    END
FROM main.publication AS b
JOIN main.publisher AS u ON b.publisher_id = u.publisher_id
JOIN main.node AS n ON u.node_id = n.node_id
JOIN main.process AS p ON n.process_id = p.process_id
WHERE list_contains(runs, b.run_id) AND b.start_ns > n.created_ns + 1_000_000_000
    AND (
        u.topic_name = '/parameter_events'
        -- Where goals are recorded, the next rows have them.
        OR ends_with(u.topic_name, '/_action/status')
        AND u.run_id NOT IN (SELECT run_id FROM main.goal)
    )
UNION ALL
SELECT
    run_id,
    CASE WHEN len(names) > 1 THEN 'goal' ELSE 'request' END,
    at_ns, nodes,
    [],
    NULL,
    CASE WHEN len(names) > 1 THEN printf('a goal of %s was sent', names[1])
        ELSE names[1] || ' was called' END
FROM asked
WHERE coalesce(names[2], 'send_goal') = 'send_goal'
-- A service that is called all the time is no occasion.
QUALIFY len(names) > 1 OR count(*) OVER (PARTITION BY run_id, names) <= 5
UNION ALL
SELECT
    run_id, 'program',
    min(at_ns) FILTER (cpus > 0.2),
    [],
    [],
    host_id,
    program || CASE WHEN processes > 1 THEN printf(' (%d processes)', processes) ELSE '' END
    || printf(' used %.1f CPUs', max(cpus))
FROM main.program_use(runs)
WHERE process_id IS NULL
GROUP BY run_id, host_id, program, processes
UNION ALL
SELECT
    run_id, 'program',
    min(start_ns),
    [],
    [],
    host_id,
    printf('%s took the CPU', program)
FROM taken
GROUP BY run_id, host_id, program
HAVING sum(end_ns - start_ns) > 20_000_000
UNION ALL
SELECT
    run_id, 'loss',
    min(start_ns),
    [],
    [],
    NULL,
    printf('events were lost (%s)', kind)
FROM main.gap
WHERE list_contains(runs, run_id) AND kind = 'loss'
GROUP BY run_id, kind, start_ns // 1_000_000_000
UNION ALL
SELECT
    run_id, 'clock', at_ns,
    [],
    [],
    host_id,
    printf('the clock of its machine was set by %s', main.duration_text(step_ns))
FROM clock_step
WHERE abs(step_ns) > 100_000_000
