-- Six seconds. The callback of /source takes 8 ms in place of 2 ms from 3.4 s on; 80 ms before that
-- a node begins that subscribes to its topic. That of /grower grows from 3 to 9 ms all the time. A
-- thread of /control publishes each 40 ms; while a timer of the node runs, it pauses for 100 ms
-- twice, and once for 80 ms without one. /stopper publishes until 4 s, /shorter until 5.1 s. Of the
-- messages that /other sends to /sink, none arrives from 3.52 s on.
CREATE TEMP TABLE beat AS
SELECT
    n,
    40000000 * n AS at_ns,
    -- Residues of a prime: no two lengths are equal.
    1000 * (n * 5 % 151) AS more_ns,
    at_ns + CASE WHEN at_ns < 3400000000 THEN 2000000 ELSE 8000000 END + more_ns AS source_end_ns
FROM range(1, 150) AS r (n);
CREATE TEMP TABLE lossy AS
SELECT
    10 * n + m AS number,
    at_ns + 4000000 * m AS at_ns,
    beat.at_ns >= 3500000000 AS is_lost
FROM beat
CROSS JOIN range(10) AS r (m);

UPDATE store.run SET start_ns = 0, end_ns = 6000000000;
INSERT INTO store.process (process_id, run_id, host_id, pid, name, life, last_seen_ns)
SELECT each, 1, 1, 100 + each, 'process', 1, 6000000000 FROM range(2, 9) AS r (each);
INSERT INTO store.thread (thread_id, run_id, process_id, tid, name)
SELECT each, 1, each, 100 + each, 'thread' FROM range(2, 9) AS r (each)
UNION ALL
SELECT 10, 1, 4, 110, 'loop';
INSERT INTO store.node (node_id, run_id, process_id, full_name, created_ns)
VALUES (2, 1, 2, '/source', 0), (3, 1, 3, '/sink', 0), (4, 1, 4, '/control', 0),
    (5, 1, 5, '/grower', 0), (6, 1, 6, '/stopper', 0), (7, 1, 7, '/viewer', 3320000000),
    (8, 1, 8, '/other', 0);
INSERT INTO store.publisher (publisher_id, run_id, process_id, node_id, topic_name)
VALUES (1, 1, 2, 2, '/scan'), (2, 1, 4, 4, '/command'), (3, 1, 6, 6, '/stopped'),
    (4, 1, 6, 6, '/shorter'), (5, 1, 8, 8, '/lossy');
INSERT INTO store.subscription
    (subscription_id, run_id, process_id, node_id, topic_name, created_ns)
VALUES (1, 1, 3, 3, '/scan', 0), (2, 1, 7, 7, '/scan', 3320000000), (3, 1, 3, 3, '/lossy', 0);
INSERT INTO store.timer (timer_id, run_id, process_id, node_id, period_ns)
VALUES (1, 1, 2, 2, 40000000), (2, 1, 4, 4, 1500000000), (3, 1, 5, 5, 40000000);
INSERT INTO store.callback
    (callback_id, run_id, process_id, node_id, kind, subscription_id, timer_id)
VALUES (1, 1, 2, 2, 'timer', NULL, 1), (2, 1, 4, 4, 'timer', NULL, 2),
    (3, 1, 5, 5, 'timer', NULL, 3), (4, 1, 3, 3, 'subscription', 1, NULL);

INSERT INTO store.callback_instance (
    callback_instance_id, run_id, trace_id, callback_id, process_id, thread_id, start_ns, end_ns,
    take_id, depth, start_event_id, end_event_id, effective_end_event_id
)
SELECT
    1000 * callback_id + n, 1, 1, callback_id, process_id, process_id, start_ns, end_ns, take_id, 1,
    start_ns, end_ns, end_ns
FROM (
    SELECT
        n,
        1 AS callback_id,
        2 AS process_id,
        at_ns AS start_ns,
        source_end_ns AS end_ns,
        NULL AS take_id
    FROM beat
    UNION ALL
    SELECT n, 2, 4, at_ns + 5000000, at_ns + 95000000, NULL FROM beat WHERE n IN (50, 100)
    UNION ALL
    SELECT n, 3, 5, at_ns, at_ns + 3000000 + at_ns // 1000 + more_ns, NULL FROM beat
    UNION ALL
    SELECT n, 4, 3, source_end_ns + 300000, source_end_ns + 1000000, 1000 + n FROM beat
);
INSERT INTO store.publication (
    publication_id, run_id, trace_id, publisher_id, process_id, thread_id, start_ns, end_ns,
    start_event_id, end_event_id, callback_event_id
)
SELECT
    1000 * publisher_id + n, 1, 1, publisher_id, process_id, thread_id, start_ns, start_ns + 50000,
    start_ns, start_ns + 50000, callback_ns
FROM (
    SELECT
        n,
        1 AS publisher_id,
        2 AS process_id,
        2 AS thread_id,
        source_end_ns - 100000 AS start_ns,
        at_ns AS callback_ns
    FROM beat
    UNION ALL
    SELECT n, 2, 4, 10, at_ns, NULL FROM beat WHERE n NOT IN (51, 52, 75, 101, 102)
    UNION ALL
    SELECT n, 3, 6, 6, at_ns, NULL FROM beat WHERE at_ns <= 4000000000
    UNION ALL
    SELECT n, 4, 6, 6, at_ns + 2000000, NULL FROM beat WHERE at_ns <= 5100000000
    UNION ALL
    SELECT number, 5, 8, 8, at_ns, NULL FROM lossy
);
INSERT INTO store.take (
    take_id, run_id, trace_id, subscription_id, process_id, thread_id, taken_ns, method,
    start_event_id, end_event_id
)
SELECT
    1000 * subscription_id + n, 1, 1, subscription_id, process_id, process_id, taken_ns, 'rmw',
    taken_ns, taken_ns
FROM (
    SELECT
        n,
        1 AS subscription_id,
        3 AS process_id,
        source_end_ns + 200000 AS taken_ns
    FROM beat
    UNION ALL
    SELECT number, 3, 3, at_ns + 500000 FROM lossy WHERE NOT is_lost
);
INSERT INTO store.link_transport
    (run_id, publication_id, take_id, publisher_id, subscription_id, method, candidate_count)
SELECT
    1,
    CASE subscription_id WHEN 3 THEN 2000 ELSE 0 END + take_id,
    take_id,
    CASE subscription_id WHEN 3 THEN 5 ELSE 1 END,
    subscription_id,
    'exact',
    1
FROM store.take;
INSERT INTO store.undelivered (run_id, publication_id, publisher_id, subscription_id, reason)
SELECT 1, 5000 + number, 5, 3, 'not_delivered' FROM lossy WHERE is_lost;
INSERT INTO store.link_causal
    (run_id, callback_instance_id, publication_id, publisher_id, kind, candidate_count)
SELECT 1, 1000 + n, 1000 + n, 1, 'direct', 1 FROM beat;
