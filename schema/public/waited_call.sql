-- description: Calls of services that a callback waited for: it sent the request, and took the
--     response before it ended, or, of a coroutine, before its next step. Between them it did
--     nothing but wait, as far as the trace shows.
-- grain: one row per such call
-- column: run_id
-- column: request_id BIGINT  The request
-- column: callback_instance_id BIGINT  Callback instance that waited
-- column: service_id BIGINT  The service; NULL: not in the trace
-- column: service_name VARCHAR  Its name
-- column: server
-- column: server_instance_id BIGINT  Callback instance of the service; NULL: not traced
-- column: sent_ns BIGINT [epoch ns]  The request is sent
-- column: taken_ns BIGINT [epoch ns]  It is taken
-- column: start_ns BIGINT [epoch ns]  The callback of the service begins; where none is traced, the
--     take
-- column: answered_ns BIGINT [epoch ns]  The response is sent
-- column: returned_ns BIGINT [epoch ns]  It is taken
-- column: is_awaited BOOLEAN  A coroutine awaited the response
-- column: queue_ns BIGINT [ns]  From request to start_ns; NULL: not known, or clocks are apart
-- column: served_ns BIGINT [ns]  From start_ns to the response; NULL: the same
WITH step AS (
    SELECT
        coalesce(continues_id, callback_instance_id) AS callback_instance_id,
        start_ns, end_ns,
        lead(start_ns) OVER (
            PARTITION BY coalesce(continues_id, callback_instance_id) ORDER BY start_ns
        ) AS resumed_ns
    FROM main.callback_instance
    SEMI JOIN main.executor_thread USING (thread_id)
    WHERE continues_id IS NOT NULL
        OR callback_instance_id IN (SELECT continues_id FROM main.callback_instance)
),
call AS (
    SELECT
        l.run_id, l.request_id, l.callback_instance_id, q.service_id,
        coalesce(v.service_name, c.service_name, '?') AS service_name,
        main.node_label(n.full_name, r.name, r.pid) AS server,
        s.callback_instance_id AS server_instance_id,
        q.sent_ns, q.taken_ns,
        coalesce(s.start_ns, q.taken_ns) AS start_ns,
        a.sent_ns AS answered_ns,
        a.taken_ns AS returned_ns,
        a.taken_ns > coalesce(e.end_ns, i.end_ns) AS is_awaited
    FROM main.link_request AS l
    JOIN main.request AS q ON l.request_id = q.request_id
    JOIN main.response AS a ON q.request_id = a.request_id
    JOIN main.callback_instance AS i ON l.callback_instance_id = i.callback_instance_id
    -- Of a coroutine all requests count as those of its first step.
    ASOF LEFT JOIN step AS e
        ON l.callback_instance_id = e.callback_instance_id AND q.sent_ns >= e.start_ns
    LEFT JOIN main.callback_instance AS s ON q.callback_instance_id = s.callback_instance_id
    LEFT JOIN main.client AS c ON q.client_id = c.client_id
    LEFT JOIN main.service AS v ON q.service_id = v.service_id
    LEFT JOIN main.node AS n ON v.node_id = n.node_id
    LEFT JOIN main.process AS r ON v.process_id = r.process_id
    WHERE a.taken_ns BETWEEN q.sent_ns AND coalesce(e.resumed_ns, e.end_ns, i.end_ns)
)
SELECT
    run_id, request_id, callback_instance_id, service_id, service_name, server, server_instance_id,
    sent_ns, taken_ns, start_ns, answered_ns, returned_ns, is_awaited,
    CASE WHEN start_ns BETWEEN sent_ns AND returned_ns THEN start_ns - sent_ns END AS queue_ns,
    CASE WHEN answered_ns BETWEEN start_ns AND returned_ns THEN answered_ns - start_ns END
        AS served_ns
FROM call
