-- 200 goals of an action: each seventh is rejected, each thirteenth cancelled, each fiftieth is still
-- executed when the next one comes, and of the last five only some were answered.
CREATE OR REPLACE TEMP MACRO spread(n, step) AS (n * step) % 211;
INSERT INTO store.node (node_id, run_id, process_id, full_name) VALUES
    (1, 1, 1, '/asking'), (2, 1, 1, '/acting');
INSERT INTO store.thread (thread_id, run_id, process_id, tid) VALUES
    (2, 1, 1, 2), (3, 1, 1, 3);
INSERT INTO store.client (client_id, run_id, process_id, node_id, service_name, created_ns) VALUES
    (1, 1, 1, 1, '/dock/_action/send_goal', 1),
    (2, 1, 1, 1, '/dock/_action/cancel_goal', 2),
    (3, 1, 1, 1, '/dock/_action/get_result', 3);
INSERT INTO store.service (service_id, run_id, process_id, node_id, service_name, created_ns) VALUES
    (4, 1, 1, 2, '/dock/_action/send_goal', 1),
    (5, 1, 1, 2, '/dock/_action/cancel_goal', 2),
    (6, 1, 1, 2, '/dock/_action/get_result', 3);
INSERT INTO store.publisher (publisher_id, run_id, process_id, node_id, topic_name, created_ns)
VALUES
    (1, 1, 1, 2, '/dock/_action/feedback', 4), (2, 1, 1, 2, '/dock/_action/status', 5);
CREATE OR REPLACE TEMP TABLE sent AS
SELECT
    n, n % 7 <> 0 AS is_accepted, n % 13 = 0 AND n % 7 <> 0 AS is_cancelled,
    n % 7 <> 0 AND n < 195 AS is_asked,
    1000000 * n + 150 * spread(n, 7) AS sent_ns,
    1000000 * n + 60000 + 250 * spread(n, 11) AS taken_ns,
    1000000 * n + 130000 + 300 * spread(n, 17) AS answered_ns,
    1000000 * n + 200000 + 350 * spread(n, 23) AS answer_taken_ns,
    1000000 * n + CASE WHEN n % 50 = 1 THEN 1900000 ELSE 700000 + 450 * spread(n, 31) END
    AS result_sent_ns
FROM (SELECT unnest(range(200)) AS n);
INSERT INTO store.request
    (request_id, run_id, client_id, service_id, sequence_number, sent_ns, taken_ns,
     sender_thread_id, receiver_thread_id)
SELECT 1000 + n, 1, 1, 4, n, sent_ns, taken_ns, 1, 2 FROM sent
UNION ALL
SELECT 2000 + n, 1, 3, 6, n, answer_taken_ns + 1000, answer_taken_ns + 30000, 1, 2
FROM sent
WHERE is_asked
UNION ALL
SELECT 3000 + n, 1, 2, 5, n, answer_taken_ns + 40000, answer_taken_ns + 60000, 1, 2
FROM sent
WHERE is_cancelled;
INSERT INTO store.response
    (response_id, run_id, client_id, service_id, sequence_number, sent_ns, taken_ns,
     sender_thread_id, receiver_thread_id, request_id)
SELECT 1000 + n, 1, 1, 4, n, answered_ns, answer_taken_ns, 2, 1, 1000 + n
FROM sent
WHERE n <> 199
UNION ALL
SELECT
    2000 + n, 1, 3, 6, n, result_sent_ns,
    CASE WHEN n % 17 > 0 THEN result_sent_ns + 20000 + 50 * spread(n, 43) END, 3, 1, 2000 + n
FROM sent
WHERE is_asked
UNION ALL
SELECT 3000 + n, 1, 2, 5, n, answer_taken_ns + 80000, answer_taken_ns + 90000, 2, 1, 3000 + n
FROM sent
WHERE is_cancelled;
INSERT INTO store.publication
    (publication_id, run_id, trace_id, publisher_id, process_id, thread_id, start_ns, end_ns)
SELECT
    row_number() OVER (), 1, 1, publisher_id, 1, thread_id, start_ns, start_ns
FROM (
    SELECT 2 AS publisher_id, 2 AS thread_id, answered_ns + 500 AS start_ns
    FROM sent
    WHERE is_accepted
    UNION ALL
    SELECT 2, 2, answer_taken_ns + 70000 FROM sent WHERE is_cancelled
    UNION ALL
    SELECT 1, 3, answer_taken_ns + 100000 + 500 * spread(n, 53) FROM sent WHERE is_accepted
    UNION ALL
    SELECT 1, 3, answer_taken_ns + 300000 FROM sent WHERE is_accepted
);
INSERT INTO store.link_call (run_id, taken_response_id, request_id, candidate_count)
SELECT 1, 1000 + n, 2000 + n, 1 FROM sent WHERE is_asked AND n % 2 = 0;
INSERT INTO store.gap (run_id, trace_id, kind, start_ns, end_ns)
VALUES (1, 1, 'pause', 50100000, 53100000);
UPDATE store.run SET end_ns = 210000000;
UPDATE store.trace SET start_ns = 0, end_ns = 210000000;
