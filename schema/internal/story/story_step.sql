-- title: The story of a goal, or of a call of a service
-- description: What happened, in order. Stages follow each other, and their times add up; each
--     names what ran in the waiting process, or what it waited for, for most of the time. Besides,
--     what the server did meanwhile: goals that it sent, and services that it called; and the first
--     message for this goal: of a publisher that was silent in the second before. And the next goal
--     of the client, if it came before a result.
-- grain: one row per step
-- reads: callback_name
-- brief: step, took_ns, what, node, at_ns, share, request_id
-- next: why --request {request_id} | flow --publication {publication_id}
-- param: request_id BIGINT  The request that sent the goal, or called the service
-- column: at_ns BIGINT [epoch ns]  When
-- column: step VARCHAR  What happened
-- column: is_stage BOOLEAN  It ends a stage, which began with the one before
-- column: took_ns BIGINT [ns]  Of a stage; of what the server did meanwhile the longest
-- column: node VARCHAR [node]  Node that did it
-- column: what VARCHAR  What it is about; of a stage, what made it wait
-- column: function VARCHAR  Function of the callback that it is
-- column: share DOUBLE [share]  For so much of the stage
-- column: request_id BIGINT  Goal that was sent, or call of a service, that it is about; of several
--     the longest
-- column: publication_id BIGINT  Message
WITH goal AS MATERIALIZED (FROM main.goal),
answer AS (
    SELECT
        request_id,
        min(sent_ns) AS sent_ns,
        min(taken_ns) AS taken_ns
    FROM main.response
    GROUP BY request_id
),
asked AS MATERIALIZED (
    SELECT
        g.*,
        q.sent_ns AS asked_ns,
        q.taken_ns AS heard_ns,
        i.callback_instance_id,
        i.start_ns AS begun_ns,
        r.sent_ns AS said_ns,
        r.taken_ns AS said_taken_ns,
        coalesce(g.action_name, v.service_name, c.service_name) AS name,
        v.process_id AS server_process_id,
        c.process_id AS client_process_id,
        v.node_id AS server_node_id,
        s.full_name AS server,
        n.full_name AS client,
        coalesce(
            g.result_sent_ns, CASE WHEN g.goal_id IS NULL THEN r.sent_ns END, x.end_ns
        ) AS until_ns
    FROM main.request AS q
    JOIN main.run AS x ON q.run_id = x.run_id
    LEFT JOIN answer AS r ON q.request_id = r.request_id
    LEFT JOIN main.callback_instance AS i ON q.callback_instance_id = i.callback_instance_id
    LEFT JOIN goal AS g ON q.request_id = g.goal_id
    LEFT JOIN main.service AS v ON q.service_id = v.service_id
    LEFT JOIN main.node AS s ON v.node_id = s.node_id
    LEFT JOIN main.client AS c ON q.client_id = c.client_id
    LEFT JOIN main.node AS n ON c.node_id = n.node_id
    WHERE q.request_id = $request_id
),
stage AS MATERIALIZED (
    SELECT
        m.id, m.is_stage,
        CASE WHEN m.is_server THEN a.server ELSE a.client END AS node,
        CASE WHEN m.is_server THEN a.server_process_id ELSE a.client_process_id END AS process_id,
        m.end_ns,
        CASE
            WHEN m.is_stage
                THEN lag(CASE WHEN m.is_stage THEN m.end_ns END IGNORE NULLS)
                    -- Clocks may be apart, and its event come after it was taken.
                    OVER (ORDER BY m.id = 'sent' DESC, m.is_server DESC, m.end_ns)
        END AS start_ns
    FROM asked AS a
    CROSS JOIN LATERAL (
        VALUES
            ('sent', a.asked_ns, true, false),
            ('taken', a.heard_ns, true, true),
            ('begun', a.begun_ns, true, true),
            (
                CASE
                    WHEN a.is_accepted THEN 'accepted'
                    WHEN NOT a.is_accepted THEN 'rejected'
                    ELSE 'answered'
                END,
                a.said_ns, true, true
            ),
            ('answer taken', a.said_taken_ns, a.goal_id IS NULL, false),
            ('cancel asked', a.cancel_asked_ns, false, false),
            ('cancelled', a.cancel_accepted_ns, false, true),
            ('first feedback', a.first_feedback_ns, true, true),
            ('last feedback', nullif(a.last_feedback_ns, a.first_feedback_ns), true, true),
            ('result sent', a.result_sent_ns, true, true),
            ('result taken', a.result_taken_ns, true, false)
    ) AS m (id, end_ns, is_stage, is_server)
    WHERE m.end_ns IS NOT NULL
),
-- Goals that the server sent, and services that it called.
done AS MATERIALIZED (
    SELECT
        q.request_id,
        n.full_name AS node,
        q.sent_ns AS start_ns,
        coalesce(g.action_name, c.service_name) AS name,
        coalesce(g.result_taken_ns, r.taken_ns) AS end_ns
    FROM asked AS a
    JOIN main.client AS c ON a.server_node_id = c.node_id
    JOIN main.request AS q
        ON c.client_id = q.client_id AND q.sent_ns BETWEEN a.heard_ns AND a.until_ns
    LEFT JOIN answer AS r ON q.request_id = r.request_id
    LEFT JOIN goal AS g ON q.request_id = g.goal_id
    LEFT JOIN main.service AS v ON q.service_id = v.service_id
    LEFT JOIN main.node AS n ON v.node_id = n.node_id
    LEFT JOIN main.link_request AS l ON q.request_id = l.request_id
    LEFT JOIN main.callback_instance AS i ON l.callback_instance_id = i.callback_instance_id
    WHERE (g.goal_id IS NOT NULL OR NOT contains(c.service_name, '/_action/'))
        -- Where it is known, for this goal.
        AND coalesce(
            coalesce(i.continues_id, i.callback_instance_id) = a.callback_instance_id, true
        )
),
meanwhile AS (
    SELECT
        b.id,
        l.callback || ' of ' || l.node AS what,
        l.function, b.share,
        false AS is_done,
        NULL AS request_id
    FROM main.callback_beside('stage') AS b
    JOIN callback_name AS l ON b.alike_id = l.callback_id
    UNION ALL
    SELECT
        s.id,
        d.name || coalesce(' of ' || d.node, ''),
        NULL,
        -- It may have asked several at a time.
        least(
            sum(least(d.end_ns, s.end_ns) - greatest(d.start_ns, s.start_ns))
                / (s.end_ns - s.start_ns),
            1
        ),
        true,
        arg_max(d.request_id, d.end_ns - d.start_ns)
    FROM stage AS s
    JOIN done AS d ON d.start_ns < s.end_ns AND d.end_ns > s.start_ns AND s.id <> 'result taken'
    GROUP BY s.id, s.start_ns, s.end_ns, d.name, d.node
),
most AS (
    FROM meanwhile
    -- What a callback waited for says more than that it ran.
    QUALIFY row_number() OVER (
        PARTITION BY id ORDER BY is_done AND share > 0.5 DESC, share DESC, what
    ) = 1
),
told AS (
    SELECT
        s.end_ns AS at_ns,
        s.id AS step,
        s.is_stage,
        s.end_ns - s.start_ns AS took_ns,
        s.node,
        CASE WHEN s.is_stage AND s.start_ns IS NULL THEN a.name ELSE m.what END AS what,
        m.function, m.share, m.request_id
    FROM stage AS s
    CROSS JOIN asked AS a
    LEFT JOIN most AS m ON s.id = m.id
    UNION ALL BY NAME
    SELECT
        min(d.start_ns) AS at_ns,
        'asks' AS step,
        false AS is_stage,
        max(d.end_ns - d.start_ns) AS took_ns,
        any_value(a.server) AS node,
        d.name || coalesce(' of ' || d.node, '')
        || CASE WHEN count(*) > 1 THEN printf(', %d times', count(*)) ELSE '' END AS what,
        arg_max(d.request_id, d.end_ns - d.start_ns) AS request_id
    FROM done AS d
    CROSS JOIN asked AS a
    GROUP BY d.name, d.node
    UNION ALL BY NAME
    SELECT
        min(b.start_ns) AS at_ns,
        'first command' AS step,
        false AS is_stage,
        any_value(a.server) AS node,
        arg_min(u.topic_name, b.start_ns) AS what,
        arg_min(b.publication_id, b.start_ns) AS publication_id
    FROM asked AS a
    JOIN main.publisher AS u ON a.server_node_id = u.node_id
    JOIN main.publication AS b
        ON u.publisher_id = b.publisher_id AND b.start_ns BETWEEN a.answered_ns AND a.until_ns
    WHERE NOT u.is_internal
        AND NOT contains(u.topic_name, '/_action/')
        AND NOT EXISTS (
            FROM main.publication AS e
            WHERE e.publisher_id = u.publisher_id
                AND e.start_ns BETWEEN a.asked_ns - 1_000_000_000 AND a.asked_ns
        )
    HAVING count(*) > 0
    UNION ALL BY NAME
    SELECT
        min(g.sent_ns) AS at_ns,
        'next goal' AS step,
        false AS is_stage,
        any_value(a.client) AS node,
        arg_min(g.goal_id, g.sent_ns) AS request_id
    FROM asked AS a
    JOIN goal AS g
        ON a.action_client_id = g.action_client_id
        AND g.sent_ns > a.sent_ns
        AND g.sent_ns < coalesce(a.result_taken_ns, a.until_ns)
    HAVING count(*) > 0
)
FROM told
ORDER BY step = 'sent' DESC, at_ns, is_stage DESC, step
