-- description: What threads did, and the links between: an arrow leaves the last and reaches the
--     first slice of a request or response. A request whose response a callback waited for lasts
--     until then.
-- grain: one row per slice
WITH call AS MATERIALIZED (
    SELECT
        q.run_id,
        'request' AS kind,
        q.request_id AS id,
        q.sender_thread_id, q.sent_ns, q.receiver_thread_id, q.taken_ns,
        coalesce(
            'service ' || w.service_name || ' (' || coalesce(w.server, '?') || ')',
            'request ' || coalesce(c.service_name, '?')
        ) AS sent_name,
        'take request ' || coalesce(s.service_name, '?') AS taken_name,
        w.returned_ns, w.queue_ns, w.served_ns
    FROM main.request AS q
    LEFT JOIN main.waited_call AS w ON q.request_id = w.request_id
    LEFT JOIN main.client AS c ON q.client_id = c.client_id
    LEFT JOIN main.service AS s ON q.service_id = s.service_id
    WHERE q.run_id = $run_id
    UNION ALL
    SELECT
        r.run_id, 'response', r.response_id,
        r.sender_thread_id, r.sent_ns, r.receiver_thread_id, r.taken_ns,
        'respond ' || coalesce(s.service_name, '?'),
        'take response ' || coalesce(c.service_name, '?'),
        NULL, NULL, NULL
    FROM main.response AS r
    LEFT JOIN main.client AS c ON r.client_id = c.client_id
    LEFT JOIN main.service AS s ON r.service_id = s.service_id
    WHERE r.run_id = $run_id
),
slice AS (
    SELECT
        i.run_id, i.thread_id, i.start_ns, i.end_ns,
        'callback' AS category,
        'callback_instance' AS kind,
        i.callback_instance_id AS id,
        l.node || ' ' || l.label AS name,
        c.symbol,
        true AS is_first,
        true AS is_last
    FROM main.callback_instance AS i
    JOIN main.callback AS c ON i.callback_id = c.callback_id
    JOIN main.callback_label AS l ON i.callback_id = l.callback_id
    UNION ALL BY NAME
    SELECT
        b.run_id, b.thread_id, b.start_ns, b.end_ns,
        'publication' AS category,
        'publication' AS kind,
        b.publication_id AS id,
        'publish ' || coalesce(p.topic_name, '?') AS name,
        true AS is_first,
        true AS is_last
    FROM main.publication AS b
    LEFT JOIN main.publisher AS p ON b.publisher_id = p.publisher_id
    UNION ALL BY NAME
    SELECT
        t.run_id, t.thread_id,
        t.taken_ns AS start_ns,
        'take' AS category,
        'take' AS kind,
        t.take_id AS id,
        'take ' || coalesce(s.topic_name, '?') AS name,
        true AS is_first,
        true AS is_last
    FROM main.take AS t
    LEFT JOIN main.subscription AS s ON t.subscription_id = s.subscription_id
    WHERE t.method <> 'callback_only'
    UNION ALL BY NAME
    SELECT
        run_id,
        sender_thread_id AS thread_id,
        sent_ns AS start_ns,
        returned_ns AS end_ns,
        'service' AS category,
        kind, id,
        sent_name AS name,
        queue_ns, served_ns,
        true AS is_first,
        taken_ns IS NULL AS is_last
    FROM call
    UNION ALL BY NAME
    SELECT
        run_id,
        receiver_thread_id AS thread_id,
        taken_ns AS start_ns,
        'service' AS category,
        kind, id,
        taken_name AS name,
        sent_ns IS NULL AS is_first,
        true AS is_last
    FROM call
),
drawn AS MATERIALIZED (
    SELECT * REPLACE (coalesce(end_ns, start_ns) AS end_ns)
    FROM slice
    WHERE run_id = $run_id AND start_ns >= $start_ns AND start_ns < $end_ns
        AND thread_id IS NOT NULL
),
link AS (
    SELECT
        from_kind, from_id, to_kind, to_id, link_kind,
        false AS is_within
    FROM derive.flow_link
    WHERE run_id = $run_id
    UNION ALL
    SELECT kind, id, kind, id, 'transport', true FROM call
),
arrow AS MATERIALIZED (
    SELECT
        f.kind AS from_kind,
        f.id AS from_id,
        f.is_first AS is_from_first,
        t.kind AS to_kind,
        t.id AS to_id,
        t.is_first AS is_to_first,
        hash(l.from_kind, l.from_id, l.to_kind, l.to_id, l.link_kind) AS arrow
    FROM link AS l
    JOIN drawn AS f
        ON l.from_kind = f.kind AND l.from_id = f.id AND l.is_within <> f.is_last
    JOIN drawn AS t
        ON l.to_kind = t.kind AND l.to_id = t.id AND l.is_within <> t.is_first
),
outgoing AS (
    SELECT
        from_kind AS kind,
        from_id AS id,
        is_from_first AS is_first,
        list(arrow ORDER BY arrow) AS arrows
    FROM arrow
    GROUP BY ALL
),
incoming AS (
    SELECT
        to_kind AS kind,
        to_id AS id,
        is_to_first AS is_first,
        list(arrow ORDER BY arrow) AS arrows
    FROM arrow
    GROUP BY ALL
)
SELECT
    d.thread_id, d.start_ns, d.end_ns, d.category, d.name, d.kind, d.id,
    d.symbol, a.candidate_count, d.queue_ns, d.served_ns,
    o.arrows AS outgoing,
    i.arrows AS incoming
FROM drawn AS d
LEFT JOIN outgoing AS o ON d.kind = o.kind AND d.id = o.id AND d.is_first = o.is_first
LEFT JOIN incoming AS i ON d.kind = i.kind AND d.id = i.id AND d.is_first = i.is_first
LEFT JOIN derive.ambiguous_effect AS a
    ON d.kind = a.kind AND d.id = a.id AND a.run_id = $run_id
UNION ALL BY NAME
SELECT
    thread_id, start_ns,
    coalesce(end_ns, start_ns) AS end_ns,
    'executor' AS track,
    'executor' AS category,
    activity AS name,
    'executor' AS kind,
    executor_id AS id
FROM main.executor_activity
WHERE run_id = $run_id AND start_ns >= $start_ns AND start_ns < $end_ns
    AND thread_id IN (SELECT thread_id FROM main.executor_state WHERE run_id = $run_id)
ORDER BY thread_id, start_ns, end_ns DESC, kind, id
