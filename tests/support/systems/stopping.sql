-- Twenty seconds. A process for each node, with its number; all go on until the end but those of
-- /ended and /viewer. Of each node something stops:
-- 1 /controller: its timer of 100 ms at 6 s, with /cmd; its timer of 50 ms goes on; /x is called then.
-- 2 /driver: a thread publishes /points each 50 ms until 8 s; nothing else happens.
-- 3 /ended: its timer, with its process.
-- 4 /relay: /relayed, with /points, that it is made of.
-- 5 /managed: its timer, when the node becomes inactive.
-- 6 /acting: /steps, when a goal is over.
-- 7 /camera: /image, at 10 s, when /viewer (8) ends, which heard it.
-- 9 /hangs: its timer, while a callback has no end.
-- 10 /simulated: its timer, with /clock.
-- 11 /rare: its timer stops half a second before the end.
-- 12 /irregular: /now_and_then comes in bursts. Another publisher of /anew goes on. /late began 15 s
-- after its process.
CREATE TEMP TABLE tick AS
SELECT n, 50_000_000 * n AS at_ns FROM range(1, 400) AS r (n);

UPDATE store.run SET start_ns = 0, end_ns = 20_000_000_000;
UPDATE store.process SET first_seen_ns = 0, last_seen_ns = 20_000_000_000;
INSERT INTO store.process (process_id, run_id, host_id, pid, name, life, first_seen_ns, last_seen_ns)
SELECT
    n, 1, 1, 100 + n, 'process', 1, 0,
    CASE n WHEN 3 THEN 6_050_000_000 WHEN 8 THEN 10_020_000_000 ELSE 20_000_000_000 END
FROM range(2, 13) AS r (n);
INSERT INTO store.thread (thread_id, run_id, process_id, tid, name, last_seen_ns)
SELECT n, 1, n, 100 + n, 'thread', CASE n WHEN 9 THEN 6_000_000_000 ELSE 20_000_000_000 END
FROM range(2, 13) AS r (n);
INSERT INTO store.node (node_id, run_id, process_id, full_name, created_ns)
VALUES (1, 1, 1, '/controller', 0), (2, 1, 2, '/driver', 0), (3, 1, 3, '/ended', 0),
    (4, 1, 4, '/relay', 0), (5, 1, 5, '/managed', 0), (6, 1, 6, '/acting', 0),
    (7, 1, 7, '/camera', 0), (8, 1, 8, '/viewer', 0), (9, 1, 9, '/hangs', 0),
    (10, 1, 10, '/simulated', 0), (11, 1, 11, '/rare', 0), (12, 1, 12, '/irregular', 0);
INSERT INTO store.publisher (publisher_id, run_id, process_id, node_id, topic_name)
VALUES (1, 1, 1, 1, '/cmd'), (2, 1, 2, 2, '/points'), (4, 1, 4, 4, '/relayed'),
    (6, 1, 6, 6, '/steps'), (7, 1, 7, 7, '/image'), (12, 1, 12, 12, '/now_and_then'),
    (13, 1, 12, 12, '/late'), (14, 1, 12, 12, '/anew'), (15, 1, 12, 12, '/anew');
INSERT INTO store.subscription (subscription_id, run_id, process_id, node_id, topic_name)
VALUES (4, 1, 4, 4, '/points'), (7, 1, 8, 8, '/image'), (10, 1, 10, 10, '/clock'),
    (1, 1, 1, 1, '/points');
INSERT INTO store.timer (timer_id, run_id, process_id, node_id, period_ns)
VALUES (1, 1, 1, 1, 100_000_000), (2, 1, 1, 1, 50_000_000), (3, 1, 3, 3, 50_000_000),
    (5, 1, 5, 5, 50_000_000), (9, 1, 9, 9, 50_000_000), (10, 1, 10, 10, 50_000_000),
    (11, 1, 11, 11, 50_000_000);
INSERT INTO store.callback (
    callback_id, run_id, process_id, node_id, kind, timer_id, subscription_id
)
VALUES (1, 1, 1, 1, 'timer', 1, NULL), (2, 1, 1, 1, 'timer', 2, NULL), (3, 1, 3, 3, 'timer', 3, NULL),
    (4, 1, 4, 4, 'subscription', NULL, 4), (5, 1, 5, 5, 'timer', 5, NULL),
    (9, 1, 9, 9, 'timer', 9, NULL), (10, 1, 10, 10, 'timer', 10, NULL),
    (11, 1, 11, 11, 'timer', 11, NULL), (13, 1, 10, 10, 'subscription', NULL, 10);
INSERT INTO store.service (service_id, run_id, process_id, node_id, service_name)
VALUES (1, 1, 1, 1, '/x'), (6, 1, 6, 6, '/move/_action/get_result');
INSERT INTO store.request (request_id, run_id, service_id, taken_ns, receiver_thread_id)
VALUES (1, 1, 1, 6_010_000_000, 1), (6, 1, 6, 5_000_000_000, 6);
INSERT INTO store.response (response_id, run_id, service_id, sent_ns, sender_thread_id, request_id)
VALUES (6, 1, 6, 8_020_000_000, 6, 6);
INSERT INTO store.lifecycle_transition (run_id, node_id, at_ns, start_state, goal_state)
VALUES (1, 5, 1_000_000_000, 'inactive', 'active'), (1, 5, 6_030_000_000, 'active', 'inactive');

INSERT INTO store.callback_instance (
    callback_instance_id, run_id, trace_id, callback_id, process_id, thread_id, start_ns, end_ns,
    depth, start_event_id, end_event_id
)
SELECT
    1000 * c.callback_id + t.n, 1, 1, c.callback_id, c.process_id, c.process_id, t.at_ns,
    CASE
        WHEN c.callback_id <> 9 OR t.at_ns < 6_000_000_000 THEN t.at_ns + 1_000_000
    END AS end_ns,
    1, t.at_ns, end_ns
FROM store.callback AS c
JOIN tick AS t
    ON t.at_ns <= CASE c.callback_id
        WHEN 2 THEN 20_000_000_000
        WHEN 4 THEN 8_000_000_000
        WHEN 11 THEN 19_500_000_000
        ELSE 6_000_000_000
    END
    AND (c.callback_id <> 1 OR t.n % 2 = 0);
INSERT INTO store.publication (
    publication_id, run_id, trace_id, publisher_id, process_id, thread_id, start_ns, end_ns
)
SELECT
    1000 * p.publisher_id + t.n, 1, 1, p.publisher_id, p.process_id, p.process_id,
    t.at_ns + CASE p.publisher_id WHEN 2 THEN 0 ELSE 500_000 END AS start_ns,
    start_ns + 50_000
FROM store.publisher AS p
JOIN tick AS t
    ON t.at_ns <= CASE p.publisher_id
        WHEN 1 THEN 6_000_000_000
        WHEN 7 THEN 10_000_000_000
        WHEN 13 THEN 16_000_000_000
        WHEN 15 THEN 20_000_000_000
        ELSE 8_000_000_000
    END
    AND (p.publisher_id <> 1 OR t.n % 2 = 0)
    AND (p.publisher_id <> 12 OR t.n % 40 < 8)
    AND (p.publisher_id <> 13 OR t.at_ns > 15_000_000_000)
    AND (p.publisher_id <> 15 OR t.at_ns > 8_000_000_000);
