-- A camera on a robot, whose clock is 1000 ns behind, and a filter and a server on another host:
-- one message each way, a call of a service, a callback inside another one, and what is not known
-- or not seen to the end. Beside them another run, which no page may show.
UPDATE store.run SET end_ns = 4000;
INSERT INTO store.run (run_id, name, created_at, msgflow_version, derivation_hash, start_ns, end_ns)
VALUES (2, 'other', '1970-01-01', '1.2', '', 5000, 6000);
UPDATE store.trace SET event_count = 70;
INSERT INTO store.clock (clock_id, run_id, offset_ns, drift_ppb, reference_ns, method)
VALUES (2, 1, 1000, 0, 0, 'file'), (3, 2, 0, 0, 0, 'none');
INSERT INTO store.host (host_id, run_id, clock_id, hostname)
VALUES (2, 1, 2, 'robot'), (3, 2, 3, 'elsewhere');
INSERT INTO store.trace (trace_id, run_id, host_id, path, event_count)
VALUES (2, 1, 2, 'robot', 30), (3, 2, 3, 'other', 5);
INSERT INTO store.process
    (process_id, run_id, host_id, pid, name, first_seen_ns, last_seen_ns, life)
VALUES (2, 1, 2, 1, 'camera', 50, 900, 2), (3, 2, 3, 1, 'other', 5000, 6000, 1);
INSERT INTO store.thread (thread_id, run_id, process_id, tid, name)
VALUES (2, 1, 2, 2, 'camera'), (3, 1, 1, 3, 'server'), (4, 2, 3, 4, 'other');
INSERT INTO store.node (node_id, run_id, process_id, full_name, created_ns, is_inferred)
VALUES (1, 1, 2, '/camera', 60, false), (2, 1, 1, '/filter', 20, false),
    (3, 1, 1, '/server', 10, false), (4, 2, 3, '/other', 5000, false);
INSERT INTO store.publisher
    (publisher_id, run_id, process_id, node_id, topic_name, created_ns, is_internal, is_inferred)
VALUES (1, 1, 2, 1, '/image', 70, false, false), (2, 1, 1, 2, '/result', 30, false, false),
    (3, 1, 1, 2, '/rosout', 31, true, false), (4, 2, 3, 4, '/image', 5000, false, false);
INSERT INTO store.subscription
    (subscription_id, run_id, process_id, node_id, topic_name, created_ns, is_internal, is_inferred)
VALUES (1, 1, 1, 2, '/image', 40, false, false), (2, 1, 2, 1, '/result', 80, false, false);
INSERT INTO store.timer (timer_id, run_id, process_id, node_id, period_ns, created_ns)
VALUES (1, 1, 2, 1, 12500000, 90);
INSERT INTO store.service
    (service_id, run_id, process_id, node_id, service_name, created_ns, is_internal)
VALUES (1, 1, 1, 3, '/add', 11, false);
INSERT INTO store.client
    (client_id, run_id, process_id, node_id, service_name, created_ns, is_internal)
VALUES (1, 1, 1, 2, '/add', 41, false);
INSERT INTO store.callback
    (callback_id, run_id, process_id, node_id, kind, subscription_id, timer_id, service_id, symbol,
     callback_handle)
VALUES (1, 1, 2, 1, 'timer', NULL, 1, NULL, 'Camera::tick()', 16),
    (2, 1, 1, 2, 'subscription', 1, NULL, NULL, 'Filter::image()', 32),
    (3, 1, 2, 1, 'subscription', 2, NULL, NULL, NULL, 48),
    (4, 1, 1, 3, 'service', NULL, NULL, 1, 'add', 64),
    (5, 1, 1, 2, 'unknown', NULL, NULL, NULL, NULL, 80);
INSERT INTO store.executor (executor_id, run_id, process_id, kind, is_inferred)
VALUES (1, 1, 1, 'single_threaded', false), (2, 1, 2, 'multi_threaded', true);
INSERT INTO store.executor_thread (run_id, executor_id, thread_id) VALUES (1, 1, 1), (1, 2, 2);
INSERT INTO store.executor_state
    (run_id, thread_id, state, start_ns, callback_instance_id, start_event_id)
VALUES (1, 1, 'wait', 100, NULL, 1), (1, 1, 'process', 1240, NULL, 2),
    (1, 1, 'execute', 1290, 20, 4), (1, 1, 'wait', 1510, NULL, 9);
INSERT INTO store.publication
    (publication_id, run_id, trace_id, publisher_id, process_id, thread_id, start_ns, end_ns,
     is_loss_affected, start_event_id, end_event_id)
VALUES (1, 1, 2, 1, 2, 2, 150, 160, false, 1, 2), (2, 1, 1, 2, 1, 1, 1400, 1420, false, 3, 4),
    (3, 1, 1, NULL, 1, 1, 1430, 1440, true, 5, 6), (4, 2, 3, 4, 3, 4, 5100, 5200, false, 7, 8);
INSERT INTO store.take
    (take_id, run_id, trace_id, subscription_id, process_id, thread_id, taken_ns, method,
     is_loss_affected, start_event_id, end_event_id)
VALUES (1, 1, 1, 1, 1, 1, 1250, 'rmw', false, 3, 3), (2, 1, 2, 2, 2, 2, 650, 'rmw', false, 6, 6),
    (3, 1, 1, NULL, 1, 1, 1600, 'rmw', false, 10, 10);
INSERT INTO store.request
    (request_id, run_id, client_id, service_id, sequence_number, sent_ns, taken_ns,
     sender_thread_id, receiver_thread_id)
VALUES (1, 1, 1, 1, 1, 1405, 1445, 1, 3), (2, 1, 1, NULL, 2, 1700, NULL, 1, NULL);
INSERT INTO store.callback_instance
    (callback_instance_id, run_id, trace_id, callback_id, process_id, thread_id, start_ns, end_ns,
     take_id, request_id, is_intra_process, is_loss_affected, depth, parent_id, start_event_id,
     end_event_id, effective_end_event_id)
VALUES (10, 1, 2, 1, 2, 2, 100, 200, NULL, NULL, false, false, 1, NULL, 1, 2, 2),
    (11, 1, 2, 1, 2, 2, 250, 260, NULL, NULL, false, false, 1, NULL, 3, 4, 4),
    (20, 1, 1, 2, 1, 1, 1300, 1500, 1, NULL, false, false, 1, NULL, 5, 8, 8),
    (21, 1, 1, 5, 1, 1, 1350, 1380, NULL, NULL, true, false, 2, 20, 6, 7, 7),
    (30, 1, 2, 3, 2, 2, 700, NULL, 2, NULL, false, true, 1, NULL, 7, NULL, NULL),
    (40, 1, 1, 4, 1, 3, 1450, 1480, NULL, 1, false, false, 1, NULL, 8, 9, 9);
INSERT INTO store.response
    (response_id, run_id, client_id, service_id, sequence_number, sent_ns, taken_ns,
     sender_thread_id, receiver_thread_id, callback_instance_id, request_id)
VALUES (1, 1, 1, 1, 1, 1475, 1490, 3, 1, 40, 1);
INSERT INTO store.link_transport
    (run_id, publication_id, take_id, publisher_id, subscription_id, method, candidate_count,
     is_self_loop, is_loss_affected)
VALUES (1, 1, 1, 1, 1, 'exact', 1, false, false), (1, 2, 2, 2, 2, 'exact', 1, false, true);
INSERT INTO store.link_causal
    (run_id, callback_instance_id, publication_id, kind, candidate_count, is_loss_affected, take_id,
     subscription_id, publisher_id)
VALUES (1, 10, 1, 'direct', 1, false, NULL, NULL, 1), (1, 20, 2, 'direct', 1, false, 1, 1, 2),
    (1, 21, 3, 'periodic_async', 1, false, NULL, NULL, NULL);
INSERT INTO store.link_request
    (run_id, request_id, callback_instance_id)
VALUES (1, 1, 20);
INSERT INTO store.link_response (run_id, response_id, callback_instance_id) VALUES (1, 1, 40);
INSERT INTO store.gap (run_id, trace_id, cpu, kind, start_ns, end_ns, event_count)
VALUES (1, 2, 0, 'loss', 10, 20, 3), (1, 1, NULL, 'pause', 2000, 3000, NULL),
    (2, 3, NULL, 'pause', 5400, 5500, NULL);
