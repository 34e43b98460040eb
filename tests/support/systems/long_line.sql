-- 1500 nodes in a line: each passes on every message to the next one at once. The first
-- has a timer, which publishes twice.
INSERT INTO store.node (node_id, run_id, process_id, full_name, is_inferred)
SELECT node, 1, 1, '/node_' || node, false FROM range(1, 1502) AS r(node);
INSERT INTO store.publisher
    (publisher_id, run_id, process_id, node_id, topic_name, created_ns, is_internal, is_inferred)
SELECT node, 1, 1, node, '/topic_' || node, 0, false, false FROM range(1, 1501) AS r(node);
INSERT INTO store.subscription
    (subscription_id, run_id, process_id, node_id, topic_name, created_ns, is_internal, is_inferred)
SELECT node, 1, 1, node + 1, '/topic_' || node, 0, false, false FROM range(1, 1501) AS r(node);
INSERT INTO store.timer (timer_id, run_id, process_id, node_id, period_ns, created_ns)
VALUES (1, 1, 1, 1, 1000000, 0);
INSERT INTO store.callback
    (callback_id, run_id, process_id, node_id, kind, subscription_id, timer_id)
SELECT
    node, 1, 1, node, CASE WHEN node = 1 THEN 'timer' ELSE 'subscription' END, nullif(node - 1, 0),
    CASE WHEN node = 1 THEN 1 END
FROM range(1, 1502) AS r(node);

CREATE TEMP TABLE run_of_node AS
SELECT node, 10000 * round + node AS id, 1000000 * round + 100 * node AS start_ns
FROM range(2) AS o(round), range(1, 1502) AS r(node);
INSERT INTO store.callback_instance
    (callback_instance_id, run_id, trace_id, callback_id, process_id, thread_id, start_ns, end_ns,
     take_id, is_intra_process, depth, start_event_id, end_event_id, effective_end_event_id)
SELECT
    id, 1, 1, node, 1, 1, start_ns, start_ns + 50, CASE WHEN node > 1 THEN id - 1 END, false, 1,
    start_ns, start_ns + 50, start_ns + 50
FROM run_of_node;
INSERT INTO store.publication
    (publication_id, run_id, trace_id, publisher_id, process_id, thread_id, start_ns, end_ns,
     rcl_ns, rmw_ns, source_timestamp_ns, start_event_id, end_event_id, callback_event_id)
SELECT
    id, 1, 1, node, 1, 1, start_ns + 10, start_ns + 30, start_ns + 10, start_ns + 20,
    start_ns + 20, start_ns + 10, start_ns + 30, start_ns
FROM run_of_node
WHERE node <= 1500;
INSERT INTO store.take
    (take_id, run_id, trace_id, subscription_id, process_id, thread_id, taken_ns,
     source_timestamp_ns, method, start_event_id, end_event_id)
SELECT
    id, 1, 1, node, 1, 1, start_ns + 80, start_ns + 20, 'rmw', start_ns + 80, start_ns + 80
FROM run_of_node
WHERE node <= 1500;
