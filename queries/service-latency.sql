-- title: Latency of services by service and client
-- description: How long service calls took, in total and by part. The round trip is measured on the
--     client's clock alone, from the sending of the request to the take of the response. The times
--     there and back compare two clocks, and are negative if these are apart (by microseconds with
--     Fast DDS, which reports a request after writing it). Every part is measured if both its ends
--     were traced. A request that no service was seen to take is counted with the only service of
--     that name, if there is one.
-- grain: one row per service and client
-- column: run_id
-- column: service_name VARCHAR        Service
-- column: server VARCHAR [node]  Node of the service; empty: not known
-- column: client VARCHAR [node]  Node of the client; empty: not known
-- column: requests BIGINT             Requests sent or taken in the time window
-- column: answered BIGINT             Requests whose response the client took
-- column: not_taken BIGINT            Requests that no service was seen to take
-- column: not_answered BIGINT         Requests that were taken, with no sign of a response
-- column: not_received BIGINT         Requests whose response was sent, but not seen to be taken
-- column: negative BIGINT             Requests or responses that were taken before they were sent
-- column: request_median_ns BIGINT [ns]   Median time from the sending of the request to its take
-- column: wait_median_ns BIGINT [ns]      Median time from its take to the service callback
-- column: callback_median_ns BIGINT [ns]  Median duration of the service callback; empty, as the
--     wait for it, for actions: rclcpp_action has no events of callbacks
-- column: reply_median_ns BIGINT [ns]     Median time from the end of the service callback to the
--     sending of the response; negative if the callback sends it itself
-- column: response_median_ns BIGINT [ns]  Median time from the sending of the response to its take
-- column: round_trip_min_ns BIGINT [ns]     Shortest round trip
-- column: round_trip_median_ns BIGINT [ns]  Median round trip
-- column: round_trip_mean_ns BIGINT [ns]    Mean round trip
-- column: round_trip_p95_ns BIGINT [ns]     95 % of the round trips are at most this
-- column: round_trip_p99_ns BIGINT [ns]     99 % of the round trips are at most this
-- column: round_trip_max_ns BIGINT [ns]     Longest round trip
-- column: service_id BIGINT           Identity of the service
-- column: client_id BIGINT            Identity of the client
-- column: is_internal
-- brief: service_name, client, round_trip_median_ns, round_trip_p99_ns, round_trip_max_ns,
--     requests, round_trip_p95_ns, answered, server, not_taken, not_answered, not_received,
--     callback_median_ns, wait_median_ns, request_median_ns, response_median_ns, reply_median_ns
-- note: requests
WITH single_service AS (
    SELECT
        run_id, service_name,
        min(service_id) AS service_id
    FROM main.service
    WHERE list_contains($runs, run_id)
    GROUP BY run_id, service_name
    HAVING count(*) = 1
),
answer AS (
    SELECT
        request_id,
        arg_min(sent_ns, response_id) AS sent_ns,
        min(taken_ns) AS taken_ns
    FROM main.response
    WHERE list_contains($runs, run_id) AND request_id IS NOT NULL
    GROUP BY request_id
),
call AS (
    SELECT
        q.run_id, q.client_id,
        coalesce(q.service_id, o.service_id) AS service_id,
        q.taken_ns IS NULL AND r.request_id IS NULL AS is_not_taken,
        q.taken_ns IS NOT NULL AND r.request_id IS NULL AS is_not_answered,
        r.request_id IS NOT NULL AND r.taken_ns IS NULL AS is_not_received,
        r.taken_ns IS NOT NULL AS is_answered,
        q.taken_ns - q.sent_ns AS request_ns,
        i.start_ns - q.taken_ns AS wait_ns,
        i.end_ns - i.start_ns AS callback_ns,
        r.sent_ns - i.end_ns AS reply_ns,
        r.taken_ns - r.sent_ns AS response_ns,
        r.taken_ns - q.sent_ns AS round_trip_ns
    FROM main.request AS q
    LEFT JOIN answer AS r ON q.request_id = r.request_id
    LEFT JOIN main.client AS c ON q.client_id = c.client_id
    LEFT JOIN single_service AS o
        ON q.service_id IS NULL AND q.run_id = o.run_id AND c.service_name = o.service_name
    LEFT JOIN main.callback_instance AS i ON q.callback_instance_id = i.callback_instance_id
    WHERE list_contains($runs, q.run_id)
        AND coalesce(q.sent_ns, q.taken_ns) >= $start_ns
        AND coalesce(q.sent_ns, q.taken_ns) < $end_ns
),
measured AS (
    SELECT
        run_id, service_id, client_id,
        count(*) AS requests,
        count(*) FILTER (WHERE is_answered) AS answered,
        count(*) FILTER (WHERE is_not_taken) AS not_taken,
        count(*) FILTER (WHERE is_not_answered) AS not_answered,
        count(*) FILTER (WHERE is_not_received) AS not_received,
        count(*) FILTER (WHERE request_ns < 0 OR response_ns < 0) AS negative,
        quantile_disc(request_ns, 0.5) AS request_median_ns,
        quantile_disc(wait_ns, 0.5) AS wait_median_ns,
        quantile_disc(callback_ns, 0.5) AS callback_median_ns,
        quantile_disc(reply_ns, 0.5) AS reply_median_ns,
        quantile_disc(response_ns, 0.5) AS response_median_ns,
        main.spread(round_trip_ns) AS round_trip
    FROM call
    GROUP BY run_id, service_id, client_id
)
SELECT
    m.run_id,
    coalesce(s.service_name, c.service_name) AS service_name,
    main.node_label(sn.full_name, sp.name, sp.pid) AS server,
    main.node_label(cn.full_name, cp.name, cp.pid) AS client,
    m.requests, m.answered, m.not_taken, m.not_answered, m.not_received, m.negative,
    m.request_median_ns, m.wait_median_ns, m.callback_median_ns, m.reply_median_ns,
    m.response_median_ns,
    m.round_trip.min_ns AS round_trip_min_ns,
    m.round_trip.median_ns AS round_trip_median_ns,
    m.round_trip.mean_ns AS round_trip_mean_ns,
    m.round_trip.p95_ns AS round_trip_p95_ns,
    m.round_trip.p99_ns AS round_trip_p99_ns,
    m.round_trip.max_ns AS round_trip_max_ns,
    m.service_id, m.client_id,
    coalesce(s.is_internal, c.is_internal, false) AS is_internal
FROM measured AS m
LEFT JOIN main.service AS s ON m.service_id = s.service_id
LEFT JOIN main.process AS sp ON s.process_id = sp.process_id
LEFT JOIN main.node AS sn ON s.node_id = sn.node_id
LEFT JOIN main.client AS c ON m.client_id = c.client_id
LEFT JOIN main.process AS cp ON c.process_id = cp.process_id
LEFT JOIN main.node AS cn ON c.node_id = cn.node_id
ORDER BY
    m.run_id, round_trip_p99_ns DESC NULLS LAST, service_name NULLS LAST, server NULLS LAST,
    client NULLS LAST, m.service_id, m.client_id
