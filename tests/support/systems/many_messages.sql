-- 300 messages every 10 ms: a timer's callback publishes /a, a relay's callback /b, and a slow node
-- keeps /a until its own timer publishes /c; the sink receives both. A client calls a service once
-- in every period. Delays are residues of a prime, so that no two of one kind are equal: the
-- median, the higher quantiles and the maximum of everything differ.
CREATE TEMP MACRO delay(n, step) AS ((n * step + 17) % 307)::BIGINT;

INSERT INTO store.node (node_id, run_id, process_id, full_name, is_inferred)
SELECT node_id, 1, 1, name, false
FROM (VALUES
    (1, '/source'), (2, '/relay'), (3, '/slow'), (4, '/sink'), (5, '/caller'), (6, '/server')
) AS v(node_id, name);
INSERT INTO store.thread (thread_id, run_id, process_id, tid, name)
SELECT each, 1, 1, each, 'thread' FROM range(2, 7) AS r(each);
UPDATE store.thread SET first_seen_ns = 0, last_seen_ns = 3100000000;
INSERT INTO store.executor (executor_id, run_id, process_id, kind, is_inferred)
SELECT 10 + each, 1, 1, 'single_threaded', false FROM range(1, 7) AS r(each);
INSERT INTO store.executor_thread (run_id, executor_id, thread_id)
SELECT 1, 10 + each, each FROM range(1, 7) AS r(each);
INSERT INTO store.publisher
    (publisher_id, run_id, process_id, node_id, topic_name, created_ns, is_internal, is_inferred)
VALUES (1, 1, 1, 1, '/a', 0, false, false), (2, 1, 1, 2, '/b', 0, false, false),
    (3, 1, 1, 3, '/c', 0, false, false);
INSERT INTO store.subscription
    (subscription_id, run_id, process_id, node_id, topic_name, created_ns, is_internal, is_inferred)
VALUES (1, 1, 1, 2, '/a', 0, false, false), (2, 1, 1, 3, '/a', 0, false, false),
    (3, 1, 1, 4, '/b', 0, false, false), (4, 1, 1, 4, '/c', 0, false, false);
INSERT INTO store.timer (timer_id, run_id, process_id, node_id, period_ns, created_ns)
VALUES (1, 1, 1, 1, 10000000, 0), (2, 1, 1, 3, 10000000, 0);
INSERT INTO store.service
    (service_id, run_id, process_id, node_id, service_name, created_ns, is_internal)
VALUES (1, 1, 1, 6, '/add', 0, false);
INSERT INTO store.client
    (client_id, run_id, process_id, node_id, service_name, created_ns, is_internal)
VALUES (1, 1, 1, 5, '/add', 0, false);
INSERT INTO store.callback
    (callback_id, run_id, process_id, node_id, kind, subscription_id, timer_id, service_id)
VALUES (1, 1, 1, 1, 'timer', NULL, 1, NULL), (2, 1, 1, 2, 'subscription', 1, NULL, NULL),
    (3, 1, 1, 3, 'subscription', 2, NULL, NULL), (4, 1, 1, 3, 'timer', NULL, 2, NULL),
    (5, 1, 1, 4, 'subscription', 3, NULL, NULL), (6, 1, 1, 4, 'subscription', 4, NULL, NULL),
    (7, 1, 1, 6, 'service', NULL, NULL, 1);
INSERT INTO store.annotation (annotation_id, run_id, kind, source, process_id)
VALUES (1, 1, 'periodic_async', 'trace', 1);
INSERT INTO store.annotation_input (run_id, annotation_id, subscription_id) VALUES (1, 1, 2);
INSERT INTO store.annotation_output (run_id, annotation_id, publisher_id) VALUES (1, 1, 3);
INSERT INTO store.executor_state (run_id, thread_id, state, start_ns, start_event_id)
SELECT 1, each, 'wait', 0, 0 FROM range(1, 7) AS r(each)
UNION ALL
SELECT 1, each, 'process', 10000000 * each, 10000000 * each FROM range(1, 7) AS r(each);

-- One row per period. a, b, c: start and end of a publication.
CREATE TEMP TABLE period AS
WITH source AS (
    SELECT n, 10000000 * n + 1000 * delay(n * n, 5) + n AS start_ns FROM range(300) AS r(n)
),
published AS (
    SELECT *, start_ns + 10000 + 100 * delay(n, 3) AS a_ns, 5000 + 10 * delay(n, 11) AS a_length
    FROM source
),
taken AS (
    SELECT
        *,
        a_ns + a_length + 20000 + 1000 * delay(n, 101) AS relay_ns,
        a_ns + a_length + 30000 + 1000 * delay(n, 19) AS slow_ns
    FROM published
),
relayed AS (
    SELECT
        *,
        relay_ns + 500 + 10 * delay(n, 13) AS relay_start_ns,
        slow_ns + 700 + 10 * delay(n, 29) AS slow_start_ns,
        10000000 * n + 5000000 + 2000 * delay(n * n, 7) AS timer_ns
    FROM taken
),
again AS (
    SELECT
        *,
        relay_start_ns + 10000 + 500 * delay(n, 53) AS b_ns,
        4000 + 10 * delay(n, 31) AS b_length,
        slow_start_ns + 30000 + 300 * delay(n, 43) AS slow_end_ns,
        timer_ns + 8000 + 100 * delay(n, 59) AS c_ns,
        6000 + 10 * delay(n, 67) AS c_length
    FROM relayed
)
SELECT
    *,
    b_ns + b_length + 15000 + 900 * delay(n, 73) AS sink_b_ns,
    c_ns + c_length + 12000 + 800 * delay(n, 83) AS sink_c_ns,
    10000000 * n + 7000000 AS sent_ns,
    10000000 * n + 7020000 + 400 * delay(n, 7) AS request_ns
FROM again;

INSERT INTO store.callback_instance
    (callback_instance_id, run_id, trace_id, callback_id, process_id, thread_id, start_ns, end_ns,
     take_id, request_id, is_intra_process, depth, start_event_id, end_event_id,
     effective_end_event_id)
SELECT
    1000 * callback_id + n, 1, 1, callback_id, 1, thread_id, start_ns, end_ns, take_id, request_id,
    false, 1, start_ns, end_ns, end_ns
FROM (
    SELECT n, 1 AS callback_id, 1 AS thread_id, start_ns,
        a_ns + a_length + 20000 + 200 * delay(n, 71) AS end_ns, NULL AS take_id, NULL AS request_id
    FROM period
    UNION ALL
    SELECT n, 2, 2, relay_start_ns, b_ns + b_length + 3000 + 100 * delay(n, 37), 1000 + n, NULL
    FROM period
    UNION ALL
    SELECT n, 3, 3, slow_start_ns, slow_end_ns, 2000 + n, NULL FROM period
    UNION ALL
    SELECT n, 4, 3, timer_ns, c_ns + c_length + 2000 + 100 * delay(n, 41), NULL, NULL FROM period
    UNION ALL
    SELECT n, 5, 4, sink_b_ns + 900 + 10 * delay(n, 61),
        sink_b_ns + 60000 + 700 * delay(n, 23), 3000 + n, NULL
    FROM period
    UNION ALL
    SELECT n, 6, 4, sink_c_ns + 800 + 10 * delay(n, 47),
        sink_c_ns + 50000 + 600 * delay(n, 79), 4000 + n, NULL
    FROM period
    UNION ALL
    SELECT n, 7, 6, request_ns + 2000 + 20 * delay(n, 97),
        request_ns + 90000 + 500 * delay(n, 103), NULL, 1 + n
    FROM period
);
INSERT INTO store.publication
    (publication_id, run_id, trace_id, publisher_id, process_id, thread_id, start_ns, end_ns,
     rclcpp_ns, rcl_ns, rmw_ns, source_timestamp_ns, start_event_id, end_event_id,
     callback_event_id)
SELECT
    1000 * publisher_id + n, 1, 1, publisher_id, 1, thread_id, at_ns, at_ns + length, at_ns,
    at_ns + 1000 + delay(n, 5), at_ns + length, at_ns + length, at_ns, at_ns + length, began_ns
FROM (
    SELECT n, 1 AS publisher_id, 1 AS thread_id, a_ns AS at_ns, a_length AS length,
        start_ns AS began_ns
    FROM period
    UNION ALL
    SELECT n, 2, 2, b_ns, b_length, relay_start_ns FROM period
    UNION ALL
    SELECT n, 3, 3, c_ns, c_length, timer_ns FROM period
);
INSERT INTO store.take
    (take_id, run_id, trace_id, subscription_id, process_id, thread_id, taken_ns,
     source_timestamp_ns, method, start_event_id, end_event_id)
SELECT
    1000 * subscription_id + n, 1, 1, subscription_id, 1, thread_id, at_ns, stamp_ns, 'rmw', at_ns,
    at_ns
FROM (
    SELECT n, 1 AS subscription_id, 2 AS thread_id, relay_ns AS at_ns, a_ns + a_length AS stamp_ns
    FROM period
    UNION ALL
    SELECT n, 2, 3, slow_ns, a_ns + a_length FROM period
    UNION ALL
    SELECT n, 3, 4, sink_b_ns, b_ns + b_length FROM period
    UNION ALL
    SELECT n, 4, 4, sink_c_ns, c_ns + c_length FROM period
);
INSERT INTO store.request
    (request_id, run_id, client_id, service_id, sequence_number, sent_ns, taken_ns,
     sender_thread_id, receiver_thread_id, callback_instance_id)
SELECT 1 + n, 1, 1, 1, 1 + n, sent_ns, request_ns, 5, 6, 7000 + n FROM period;
INSERT INTO store.response
    (response_id, run_id, client_id, service_id, sequence_number, sent_ns, taken_ns,
     sender_thread_id, receiver_thread_id, callback_instance_id, request_id)
SELECT
    1 + n, 1, 1, 1, 1 + n, i.end_ns + 1000 + 10 * delay(n, 89),
    i.end_ns + 20000 + 300 * delay(n, 107), 6, 5, 7000 + n, 1 + n
FROM period
JOIN store.callback_instance AS i ON i.callback_instance_id = 7000 + n;
UPDATE store.run SET end_ns = 3100000000;
UPDATE store.trace SET start_ns = 0, end_ns = 3100000000;
