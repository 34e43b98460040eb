-- kind: inline
-- description: Begins and ends of slices of threads and of executors, in the order of each track,
--     with the links between them. A request whose response a callback waited for lasts until then.
--     A link begins at the last and ends at the first moment of a
--     request or response that was traced.
-- grain: one row per begin and end of a slice, and per moment
WITH waited AS MATERIALIZED (
    SELECT request_id, service_id, returned_ns, queue_ns, served_ns
    FROM main.waited_call
    WHERE run_id = $run_id
),
slice AS MATERIALIZED (
    SELECT
        i.thread_id * 8 + 2 AS track, i.start_ns, coalesce(i.end_ns, i.start_ns) AS end_ns,
        0 AS code, i.callback_id AS object_id, i.callback_instance_id AS id,
        CASE WHEN c.symbol IS NOT NULL THEN c.callback_id END AS symbol_id
    FROM main.callback_instance AS i
    JOIN main.callback AS c ON i.callback_id = c.callback_id
    WHERE i.run_id = $run_id AND i.start_ns >= $start_ns AND i.start_ns < $end_ns
    UNION ALL
    SELECT thread_id * 8 + 2, start_ns, coalesce(end_ns, start_ns), 1,
        coalesce(publisher_id, 0), publication_id, NULL
    FROM main.publication
    WHERE run_id = $run_id AND start_ns >= $start_ns AND start_ns < $end_ns
    UNION ALL
    SELECT thread_id * 8 + 2, taken_ns, taken_ns, 2, coalesce(subscription_id, 0), take_id, NULL
    FROM main.take
    WHERE run_id = $run_id AND taken_ns >= $start_ns AND taken_ns < $end_ns
        AND method <> 'callback_only'
    UNION ALL
    SELECT
        q.sender_thread_id * 8 + 2, q.sent_ns, coalesce(w.returned_ns, q.sent_ns), 3,
        coalesce(
            3 * w.service_id + 1,
            3 * coalesce(q.client_id, 0) + 2 * (w.request_id IS NOT NULL)::INTEGER
        ),
        q.request_id, NULL
    FROM main.request AS q
    LEFT JOIN waited AS w ON q.request_id = w.request_id
    WHERE q.run_id = $run_id AND q.sent_ns >= $start_ns AND q.sent_ns < $end_ns
        AND q.sender_thread_id IS NOT NULL
    UNION ALL
    SELECT receiver_thread_id * 8 + 2, taken_ns, taken_ns, 4, coalesce(service_id, 0), request_id,
        NULL
    FROM main.request
    WHERE run_id = $run_id AND taken_ns >= $start_ns AND taken_ns < $end_ns
        AND receiver_thread_id IS NOT NULL
    UNION ALL
    SELECT sender_thread_id * 8 + 2, sent_ns, sent_ns, 5, coalesce(service_id, 0), response_id,
        NULL
    FROM main.response
    WHERE run_id = $run_id AND sent_ns >= $start_ns AND sent_ns < $end_ns
        AND sender_thread_id IS NOT NULL
    UNION ALL
    SELECT receiver_thread_id * 8 + 2, taken_ns, taken_ns, 6, coalesce(client_id, 0), response_id,
        NULL
    FROM main.response
    WHERE run_id = $run_id AND taken_ns >= $start_ns AND taken_ns < $end_ns
        AND receiver_thread_id IS NOT NULL
),
link AS (
    SELECT
        CASE l.from_kind WHEN 'callback_instance' THEN 0 WHEN 'publication' THEN 1
            WHEN 'take' THEN 2 WHEN 'request' THEN CASE WHEN q.taken_ns IS NULL THEN 3 ELSE 4 END
            ELSE CASE WHEN a.taken_ns IS NULL THEN 5 ELSE 6 END
        END AS from_code,
        l.from_id,
        CASE l.to_kind WHEN 'callback_instance' THEN 0 WHEN 'publication' THEN 1
            WHEN 'take' THEN 2 WHEN 'request' THEN CASE WHEN o.sent_ns IS NULL THEN 4 ELSE 3 END
            ELSE CASE WHEN r.sent_ns IS NULL THEN 6 ELSE 5 END
        END AS to_code,
        l.to_id, l.link_kind
    FROM main.flow_edge AS l
    LEFT JOIN main.request AS q ON l.from_kind = 'request' AND l.from_id = q.request_id
    LEFT JOIN main.response AS a ON l.from_kind = 'response' AND l.from_id = a.response_id
    LEFT JOIN main.request AS o ON l.to_kind = 'request' AND l.to_id = o.request_id
    LEFT JOIN main.response AS r ON l.to_kind = 'response' AND l.to_id = r.response_id
    WHERE l.run_id = $run_id
    UNION ALL
    SELECT 3, request_id, 4, request_id, 'transport'
    FROM main.request
    WHERE run_id = $run_id AND sent_ns IS NOT NULL AND taken_ns IS NOT NULL
    UNION ALL
    SELECT 5, response_id, 6, response_id, 'transport'
    FROM main.response
    WHERE run_id = $run_id AND sent_ns IS NOT NULL AND taken_ns IS NOT NULL
),
-- Arrows with both ends drawn.
arrow AS MATERIALIZED (
    SELECT l.from_code, l.from_id, l.to_code, l.to_id,
        hash(l.from_code, l.from_id, l.to_code, l.to_id, l.link_kind) AS arrow_id
    FROM link AS l
    SEMI JOIN slice AS f ON l.from_code = f.code AND l.from_id = f.id
    SEMI JOIN slice AS t ON l.to_code = t.code AND l.to_id = t.id
),
outgoing AS (
    SELECT from_code AS code, from_id AS id, list(arrow_id ORDER BY arrow_id) AS arrows
    FROM arrow
    GROUP BY from_code, from_id
),
incoming AS (
    SELECT to_code AS code, to_id AS id, list(arrow_id ORDER BY arrow_id) AS arrows
    FROM arrow
    GROUP BY to_code, to_id
),
drawn AS NOT MATERIALIZED (
    SELECT track, start_ns, end_ns, code, object_id, id, symbol_id FROM slice
    UNION ALL
    SELECT
        thread_id * 8 + 3, start_ns, coalesce(end_ns, start_ns), 7,
        list_position(['wait', 'select', 'take', 'callback', 'service', 'blocked'], activity),
        executor_id, NULL
    FROM main.executor_activity
    WHERE run_id = $run_id AND start_ns >= $start_ns AND start_ns < $end_ns
        AND thread_id IN (SELECT thread_id FROM main.executor_state WHERE run_id = $run_id)
),
-- What ends at a moment before what begins there, the inner before the outer, and what begins the
-- other way round.
event AS (
    SELECT
        track, start_ns AS at_ns, CASE WHEN end_ns > start_ns THEN 1 ELSE 2 END AS rank,
        end_ns AS far_ns, code, object_id, id, symbol_id
    FROM drawn
    UNION ALL
    SELECT track, end_ns, 0, start_ns, code, NULL, id, NULL FROM drawn WHERE end_ns > start_ns
)
SELECT
    e.track, e.at_ns, e.rank, e.object_id * 8 + e.code + 1 AS name, e.code, e.id,
    e.symbol_id, a.candidate_count, w.queue_ns, w.served_ns, o.arrows AS outgoing,
    i.arrows AS incoming
FROM event AS e
LEFT JOIN outgoing AS o ON e.rank > 0 AND e.code = o.code AND e.id = o.id
LEFT JOIN incoming AS i ON e.rank > 0 AND e.code = i.code AND e.id = i.id
LEFT JOIN waited AS w ON e.rank > 0 AND e.code = 3 AND e.id = w.request_id
LEFT JOIN derive.ambiguous_effect AS a
    ON e.rank > 0 AND e.id = a.id AND a.run_id = $run_id
    AND e.code = CASE a.kind WHEN 'take' THEN 2 ELSE 1 END
ORDER BY e.track, e.at_ns, e.rank, e.far_ns DESC, e.code, e.id
