-- when: store.request, store.response
-- description: What a thread sends after it took a request or a response for which no callback is
--     traced: clients and action servers of rclcpp run their callbacks right behind the take. The
--     turn ends with the next event of the executor, the next take, and where a callback begins or
--     ends. Of threads without executors and callbacks (rclpy) a trace shows one kind of turn: from
--     the take of a request to the response that the same thread sends to it.
--     A callback that spins may take a response, too. The node tells what follows: the client's
--     node publishes with the response, the node of the callback around it does not.
--     In Python it runs later, as a callback instance that names the response.
--     Nothing is linked across a gap of the host. An object that the same thread also sends with
--     where nothing was taken may do so here as well: then "nothing" is one more candidate. So is
--     another process, where several with equal ids cannot be told apart.
-- grain: one row per publication, request or response sent in such a turn
CREATE OR REPLACE MACRO derive.link_call(only_run) AS TABLE
WITH taken AS (
    SELECT
        receiver_thread_id AS thread_id,
        taken_ns,
        request_id AS taken_request_id,
        NULL::BIGINT AS taken_response_id
    FROM store.request
    WHERE run_id = only_run AND callback_instance_id IS NULL
    UNION ALL
    SELECT receiver_thread_id, taken_ns, NULL, response_id
    FROM store.response
    WHERE run_id = only_run
),
-- Threads that take calls, with all that shows what they turn to.
executing AS MATERIALIZED (
    SELECT thread_id, at_ns
    FROM derive.thread_turn AS t
    SEMI JOIN taken AS k ON t.thread_id = k.thread_id
    WHERE run_id = only_run
),
answered AS (
    SELECT k.thread_id, k.taken_ns, r.sent_ns, k.taken_request_id
    FROM taken AS k
    JOIN store.response AS r
        ON k.taken_request_id = r.request_id AND k.thread_id = r.sender_thread_id
    ANTI JOIN executing AS e ON k.thread_id = e.thread_id
    WHERE r.run_id = only_run
),
turn AS (
    SELECT
        k.thread_id,
        k.taken_ns AS at_ns,
        k.taken_request_id, k.taken_response_id
    FROM taken AS k
    SEMI JOIN executing AS e ON k.thread_id = e.thread_id
    UNION ALL
    SELECT thread_id, at_ns, NULL, NULL FROM executing
    UNION ALL
    SELECT thread_id, taken_ns, taken_request_id, NULL FROM answered
    UNION ALL
    SELECT thread_id, sent_ns, NULL, NULL FROM answered
    UNION ALL
    -- While its callback waits for another service, the thread may turn to something else.
    SELECT k.thread_id, k.taken_ns, NULL, NULL
    FROM taken AS k
    ANTI JOIN executing AS e ON k.thread_id = e.thread_id
    ANTI JOIN answered AS o ON k.taken_request_id = o.taken_request_id
    UNION ALL
    SELECT thread_id, taken_ns, NULL, NULL
    FROM store.take AS t
    SEMI JOIN taken AS k ON t.thread_id = k.thread_id
    WHERE run_id = only_run
),
-- Inside of no callback instance, or of one of another node.
sent AS (
    SELECT
        b.thread_id,
        b.start_ns AS sent_ns,
        'publisher' AS kind,
        b.publisher_id AS object_id,
        b.publication_id,
        NULL::BIGINT AS request_id,
        NULL::BIGINT AS response_id,
        CASE WHEN d.publication_id IS NOT NULL THEN p.node_id END AS only_node_id
    FROM store.publication AS b
    SEMI JOIN taken AS k ON b.thread_id = k.thread_id
    LEFT JOIN derive.link_causal_direct(only_run) AS d ON b.publication_id = d.publication_id
    LEFT JOIN store.callback_instance AS i ON d.callback_instance_id = i.callback_instance_id
    LEFT JOIN store.callback AS c ON i.callback_id = c.callback_id
    LEFT JOIN store.publisher AS p ON b.publisher_id = p.publisher_id
    WHERE b.run_id = only_run AND (d.publication_id IS NULL OR c.node_id <> p.node_id)
    UNION ALL
    SELECT q.sender_thread_id, q.sent_ns, 'client', q.client_id, NULL, q.request_id, NULL, NULL
    FROM store.request AS q
    JOIN store.link_request AS l ON q.request_id = l.request_id
    WHERE q.run_id = only_run AND l.run_id = only_run AND l.callback_instance_id IS NULL
    UNION ALL
    SELECT r.sender_thread_id, r.sent_ns, 'service', r.service_id, NULL, NULL, r.response_id, NULL
    FROM store.response AS r
    ANTI JOIN (
        SELECT r.response_id
        FROM store.link_response AS l
        JOIN store.response AS r ON l.response_id = r.response_id
        JOIN store.callback_instance AS i
            ON l.callback_instance_id = i.callback_instance_id AND r.sender_thread_id = i.thread_id
        WHERE l.run_id = only_run AND r.sent_ns BETWEEN i.start_ns AND coalesce(i.end_ns, r.sent_ns)
    ) AS i ON r.response_id = i.response_id
    WHERE r.run_id = only_run
),
behind AS MATERIALIZED (
    SELECT s.*, t.at_ns, t.taken_request_id, t.taken_response_id
    FROM sent AS s
    ASOF JOIN turn AS t ON s.thread_id = t.thread_id AND s.sent_ns > t.at_ns
    LEFT JOIN store.response AS r ON t.taken_response_id = r.response_id
    LEFT JOIN store.client AS c ON r.client_id = c.client_id
    WHERE s.only_node_id IS NULL OR s.only_node_id = c.node_id
),
-- Where something may be missing between the two, nothing is known.
behind_gap AS (
    SELECT b.thread_id, b.sent_ns
    FROM behind AS b
    JOIN store.thread AS h ON b.thread_id = h.thread_id
    JOIN store.process AS p ON h.process_id = p.process_id
    ASOF JOIN (FROM derive.host_gap WHERE run_id = only_run) AS g
        ON p.host_id = g.host_id AND b.sent_ns > g.start_ns
    WHERE g.start_ns >= b.at_ns OR g.covered_until_ns > b.at_ns
),
known AS MATERIALIZED (
    SELECT b.*
    FROM behind AS b
    ANTI JOIN behind_gap AS g ON b.thread_id = g.thread_id AND b.sent_ns = g.sent_ns
),
independent AS (
    SELECT DISTINCT thread_id, kind, object_id
    FROM known
    WHERE taken_request_id IS NULL AND taken_response_id IS NULL
)
SELECT
    only_run AS run_id,
    l.taken_request_id, l.taken_response_id, l.publication_id,
    CASE l.kind WHEN 'publisher' THEN l.object_id END AS publisher_id,
    l.request_id, l.response_id,
    1 + (i.thread_id IS NOT NULL OR coalesce(p.is_ambiguous, false))::BIGINT AS candidate_count
FROM known AS l
LEFT JOIN independent AS i
    ON l.thread_id = i.thread_id AND l.kind = i.kind AND l.object_id = i.object_id
LEFT JOIN store.response AS r ON l.response_id = r.response_id
JOIN store.thread AS h ON l.thread_id = h.thread_id
JOIN store.process AS p ON h.process_id = p.process_id
-- That a request leads to its own response goes without saying. A question for a result leads to
-- nothing else: it waits for the goal.
WHERE l.taken_response_id IS NOT NULL
    OR l.taken_request_id IS NOT NULL AND l.taken_request_id IS DISTINCT FROM r.request_id
    AND l.taken_request_id NOT IN (
        SELECT q.request_id
        FROM store.request AS q
        JOIN store.service AS v ON q.service_id = v.service_id
        WHERE v.service_name LIKE '%/\_action/get\_result' ESCAPE '\'
    )
UNION ALL
SELECT
    only_run, NULL, i.response_id, s.publication_id, s.publisher_id, s.request_id,
    s.sent_response_id,
    1 + p.is_ambiguous::BIGINT
FROM store.callback_instance AS i
JOIN (
    SELECT
        callback_instance_id, publication_id, publisher_id,
        NULL::BIGINT AS request_id,
        NULL::BIGINT AS sent_response_id
    FROM derive.link_causal_direct(only_run)
    UNION ALL
    SELECT callback_instance_id, NULL, NULL, request_id, NULL
    FROM store.link_request
    WHERE run_id = only_run
    UNION ALL
    SELECT callback_instance_id, NULL, NULL, NULL, response_id
    FROM store.link_response
    WHERE run_id = only_run
) AS s ON i.callback_instance_id = s.callback_instance_id
JOIN store.process AS p ON i.process_id = p.process_id
WHERE i.run_id = only_run AND i.response_id IS NOT NULL
