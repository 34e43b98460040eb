-- Six seconds. /ping publishes /x and takes /y, /pong publishes /y and takes /x: both end at 4 s. The
-- callback of /busy takes 8 ms in place of 2 ms from 3.4 s on, as make takes its CPU. From then on
-- the program make uses 0.9 CPUs, and that of /busy 0.5 in place of 0.1. Messages on
-- /late wait for 20 ms in place of 1 ms from 4.6 s on.
CREATE TEMP TABLE beat AS
SELECT
    n,
    40000000 * n AS at_ns,
    -- Residues of a prime: no two lengths are equal.
    1000 * (n * 5 % 151) AS more_ns
FROM range(1, 150) AS r (n);

UPDATE store.run SET start_ns = 0, end_ns = 6000000000;
INSERT INTO store.process (process_id, run_id, host_id, pid, name, life, last_seen_ns)
SELECT each, 1, 1, 100 + each, 'process', 1, 6000000000 FROM range(2, 7) AS r (each);
INSERT INTO store.thread (thread_id, run_id, process_id, tid, name)
SELECT each, 1, each, 100 + each, 'thread' FROM range(2, 7) AS r (each);
INSERT INTO store.node (node_id, run_id, process_id, full_name, created_ns)
VALUES (2, 1, 2, '/ping', 0), (3, 1, 3, '/pong', 0), (4, 1, 4, '/busy', 0), (5, 1, 5, '/source', 0),
    (6, 1, 6, '/sink', 0);
INSERT INTO store.publisher (publisher_id, run_id, process_id, node_id, topic_name)
VALUES (1, 1, 2, 2, '/x'), (2, 1, 3, 3, '/y'), (3, 1, 5, 5, '/late');
INSERT INTO store.subscription
    (subscription_id, run_id, process_id, node_id, topic_name, created_ns)
VALUES (1, 1, 3, 3, '/x', 0), (2, 1, 2, 2, '/y', 0), (3, 1, 6, 6, '/late', 0);
INSERT INTO store.timer (timer_id, run_id, process_id, node_id, period_ns)
VALUES (1, 1, 4, 4, 40000000);
INSERT INTO store.callback (callback_id, run_id, process_id, node_id, kind, timer_id)
VALUES (1, 1, 4, 4, 'timer', 1);
INSERT INTO store.callback_instance (
    callback_instance_id, run_id, trace_id, callback_id, process_id, thread_id, start_ns, end_ns,
    depth, start_event_id, end_event_id, effective_end_event_id
)
SELECT
    n, 1, 1, 1, 4, 4, at_ns,
    at_ns + CASE WHEN at_ns < 3400000000 THEN 2000000 ELSE 8000000 END + more_ns,
    1, at_ns, at_ns + 1, at_ns + 1
FROM beat;
INSERT INTO store.publication (
    publication_id, run_id, trace_id, publisher_id, process_id, thread_id, start_ns, end_ns,
    start_event_id, end_event_id
)
SELECT
    1000 * publisher_id + n, 1, 1, publisher_id,
    CASE publisher_id WHEN 3 THEN 5 ELSE publisher_id + 1 END,
    CASE publisher_id WHEN 3 THEN 5 ELSE publisher_id + 1 END,
    at_ns + publisher_id, at_ns + publisher_id, at_ns, at_ns
FROM beat
CROSS JOIN (VALUES (1), (2), (3)) AS p (publisher_id)
WHERE publisher_id = 3 OR at_ns <= 4000000000;
INSERT INTO store.take (
    take_id, run_id, trace_id, subscription_id, process_id, thread_id, taken_ns, method,
    start_event_id, end_event_id
)
SELECT
    publication_id, 1, 1, publisher_id,
    CASE publisher_id WHEN 1 THEN 3 WHEN 2 THEN 2 ELSE 6 END,
    CASE publisher_id WHEN 1 THEN 3 WHEN 2 THEN 2 ELSE 6 END,
    start_ns + CASE WHEN publisher_id = 3 AND start_ns > 4600000000 THEN 20000000 ELSE 1000000 END,
    'rmw', start_ns + 1, start_ns + 1
FROM store.publication;
INSERT INTO store.link_transport
    (run_id, publication_id, take_id, publisher_id, subscription_id, method, candidate_count)
SELECT 1, take_id, take_id, subscription_id, subscription_id, 'exact', 1 FROM store.take;
INSERT INTO store.other_thread (other_thread_id, run_id, host_id, tid, pid, program)
VALUES (1, 1, 1, 60, 60, 'make');
INSERT INTO store.preemptor (run_id, thread_id, start_ns, end_ns, state, preemptor_other_thread_id)
SELECT 1, 4, at_ns + 1000000, at_ns + 6000000, 'preempted', 1 FROM beat WHERE at_ns >= 3400000000;
INSERT INTO store.program_usage (run_id, host_id, process_id, start_ns, end_ns, pid, name, cpu_ns)
SELECT
    1, 1, process_id, at_ns, at_ns + 200000000, pid, name,
    (200000000 * CASE WHEN at_ns < 3400000000 THEN before ELSE behind END)::BIGINT
FROM (SELECT 200000000 * n AS at_ns FROM range(0, 30) AS r (n))
CROSS JOIN (VALUES (4, 104, 'busy', 0.1, 0.5), (NULL, 60, 'make', 0, 0.9))
    AS p (process_id, pid, name, before, behind);
