-- title: Latency of services by service and client, of many runs
-- description: As the query service-latency says it of one run. Quantiles of runs cannot be added
--     up: the largest of any run stands for them.
-- grain: one row per service, client and group of runs
-- column: label_group, service_name, server, client, runs
-- column: requests BIGINT             Requests sent or taken
-- column: answered, not_taken, not_answered, not_received, negative, round_trip_min_ns
-- column: round_trip_median_most_ns BIGINT [ns]  Largest median round trip
-- column: round_trip_p99_most_ns BIGINT [ns]     Largest 99 % quantile of the round trips
-- column: round_trip_max_ns, is_internal
-- brief: service_name, client, round_trip_median_most_ns, round_trip_p99_most_ns,
--     round_trip_max_ns, runs, requests, answered, server, not_taken, not_answered, not_received
SELECT
    s.label_group, s.service_name, s.server, s.client,
    count(DISTINCT s.run) AS runs,
    sum(COLUMNS([
        'requests', 'answered', 'not_taken', 'not_answered', 'not_received', 'negative'
    ]))::BIGINT,
    min(s.round_trip_min_ns) AS round_trip_min_ns,
    max(s.round_trip_median_ns) AS round_trip_median_most_ns,
    max(s.round_trip_p99_ns) AS round_trip_p99_most_ns,
    max(s.round_trip_max_ns) AS round_trip_max_ns,
    bool_and(s.is_internal) AS is_internal
FROM service_latency AS s
GROUP BY s.label_group, s.service_name, s.server, s.client
ORDER BY s.service_name, s.server, s.client, s.label_group
