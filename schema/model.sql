-- The tables of the model. `python docs/generate.py` writes this from `schema/alignment`,
-- `schema/model`, `schema/kernel` and `schema/arrival`; do not edit.
-- An ingest makes those with it that cannot have a row in a recording.

CREATE TABLE staging.agnocast_entry (publication_id BIGINT, take_id BIGINT, entry_id BIGINT,
    event_id BIGINT);
CREATE TABLE staging.annotation (annotation_id BIGINT, kind VARCHAR, source VARCHAR,
    process_id BIGINT, queue_depth BIGINT, event_id BIGINT);
CREATE TABLE staging.annotation_input (annotation_id BIGINT, subscription_id BIGINT);
CREATE TABLE staging.annotation_object (event_id BIGINT, process_id BIGINT, kind VARCHAR,
    side VARCHAR, handle UBIGINT, object_id BIGINT);
CREATE TABLE staging.annotation_output (annotation_id BIGINT, publisher_id BIGINT);
CREATE TABLE staging.callback (callback_id BIGINT, process_id BIGINT, node_id BIGINT, kind VARCHAR,
    subscription_id BIGINT, timer_id BIGINT, service_id BIGINT, callback_handle UBIGINT,
    symbol VARCHAR, source VARCHAR, created_ns BIGINT, event_id BIGINT);
CREATE TABLE staging.callback_binding (start_event_id BIGINT, process_id BIGINT,
    callback_handle UBIGINT, is_intra_process BOOLEAN, callback_event_id BIGINT, kind VARCHAR,
    take_event_id BIGINT, subscription_event_id BIGINT, request_event_id BIGINT,
    call_event_id BIGINT, response_event_id BIGINT, step_event_id BIGINT);
CREATE TABLE staging.callback_counter (callback_instance_id BIGINT, name VARCHAR, value HUGEINT);
CREATE TABLE staging.callback_cpu (callback_instance_id BIGINT, cpu_ns HUGEINT, cpu_source VARCHAR);
CREATE TABLE staging.callback_end_alone (event_id BIGINT, trace_index INTEGER,
    previous_event_id BIGINT);
CREATE TABLE staging.callback_group (callback_group_id BIGINT, process_id BIGINT,
    executor_id BIGINT, kind VARCHAR, event_id BIGINT);
CREATE TABLE staging.callback_group_member (callback_group_id BIGINT, callback_id BIGINT,
    executor_event_id BIGINT);
CREATE TABLE staging.callback_group_owner (callback_group_id BIGINT, event_id BIGINT,
    process_id BIGINT, callback_group_addr UBIGINT, executor_event_id BIGINT, kind VARCHAR);
CREATE TABLE staging.callback_known (event_id BIGINT, created_ns BIGINT, process_id BIGINT,
    callback_handle UBIGINT, kind VARCHAR, subscription_event_id BIGINT, timer_event_id BIGINT,
    service_event_id BIGINT, service_handle UBIGINT, symbol VARCHAR);
CREATE TABLE staging.callback_number (start_event_id BIGINT, callback_instance_id BIGINT,
    callback_id BIGINT, take_id BIGINT);
CREATE TABLE staging.callback_object (callback_id BIGINT, event_id BIGINT, created_ns BIGINT,
    process_id BIGINT, callback_handle UBIGINT, kind VARCHAR, subscription_event_id BIGINT,
    timer_event_id BIGINT, service_event_id BIGINT, service_handle UBIGINT, symbol VARCHAR);
CREATE TABLE staging.callback_owner (process_id BIGINT, callback_event_id BIGINT, kind VARCHAR,
    handle UBIGINT, owner_event_id BIGINT, is_inferred BOOLEAN, is_eliminated BOOLEAN);
CREATE TABLE staging.callback_preemptor (callback_instance_id BIGINT, preemptor_thread_id BIGINT,
    preemptor_other_thread_id BIGINT, preemptor_priority INTEGER, preempted_ns BIGINT,
    runnable_ns BIGINT);
CREATE TABLE staging.callback_run (start_event_id BIGINT, end_event_id BIGINT, start_ns BIGINT,
    end_ns BIGINT, trace_index INTEGER, thread_id BIGINT, process_id BIGINT,
    callback_handle UBIGINT, is_intra_process BOOLEAN, previous_event_id BIGINT,
    previous_callback_event_id BIGINT, previous_executor_event_id BIGINT, executor_event_id BIGINT,
    is_plain BOOLEAN, effective_end_event_id BIGINT, depth INTEGER, parent_event_id BIGINT,
    is_agnocast BOOLEAN);
CREATE TABLE staging.callback_schedule (callback_instance_id BIGINT, running_ns BIGINT,
    preempted_ns BIGINT, runnable_ns BIGINT, sleeping_ns BIGINT, uninterruptible_ns BIGINT,
    unknown_ns BIGINT, irq_ns BIGINT, softirq_ns BIGINT, preemption_count BIGINT,
    migration_count BIGINT, is_loss_affected BOOLEAN);
CREATE TABLE staging.callback_state (callback_instance_id BIGINT, state_number BIGINT,
    start_ns BIGINT, end_ns BIGINT, is_begin BOOLEAN);
CREATE TABLE staging.client (client_id BIGINT, process_id BIGINT, node_id BIGINT,
    service_name VARCHAR, client_handle UBIGINT, rmw_handle UBIGINT, gid BLOB, created_ns BIGINT,
    is_internal BOOLEAN, event_id BIGINT);
CREATE TABLE staging.client_event (event_id BIGINT, ts_ns BIGINT, thread_id BIGINT,
    process_id BIGINT, is_request BOOLEAN, rmw_handle UBIGINT, sequence_number BIGINT,
    source_timestamp_ns BIGINT, client_event_id BIGINT, is_inferred BOOLEAN);
CREATE TABLE staging.client_gid (client_event_id BIGINT, gid BLOB, is_single BOOLEAN);
CREATE TABLE staging.client_known (event_id BIGINT, process_id BIGINT, service_name VARCHAR,
    client_handle UBIGINT, rmw_handle UBIGINT, gid BLOB, created_ns BIGINT);
CREATE TABLE staging.clock (clock_id BIGINT, uuid VARCHAR, clock_key VARCHAR, offset_ns BIGINT,
    drift_ppb BIGINT, reference_ns BIGINT, uncertainty_ns BIGINT, method VARCHAR,
    drift_uncertainty_ppb BIGINT, reference_clock_id BIGINT);
CREATE TABLE staging.clock_beside (hostname VARCHAR, boot_id VARCHAR, known_hostname VARCHAR,
    clock_key VARCHAR, origin_ns BIGINT);
CREATE TABLE staging.cpu_schedule (number INTEGER, trace_index INTEGER, cpu INTEGER,
    length_ns BIGINT, known_ns BIGINT, start_ns BIGINT, end_ns BIGINT);
CREATE TABLE staging.cpu_taken (thread_id BIGINT, state_start_ns BIGINT, wait_start_ns BIGINT,
    start_ns BIGINT, end_ns BIGINT, state VARCHAR, cpu INTEGER, clock_key VARCHAR, tid INTEGER,
    name VARCHAR, priority INTEGER, thread_priority INTEGER);
CREATE TABLE staging.cpu_usage (host_id BIGINT, cpu INTEGER, start_ns BIGINT, thread_id BIGINT,
    tid INTEGER, name VARCHAR, running_ns BIGINT, frequency_hz BIGINT);
CREATE TABLE staging.cpu_wait (number BIGINT, thread_id BIGINT, tid INTEGER, state_start_ns BIGINT,
    start_ns BIGINT, end_ns BIGINT, state VARCHAR, trace_index INTEGER, cpu INTEGER,
    priority INTEGER);
CREATE TABLE staging.data_arrival (take_id BIGINT, waited_ns BIGINT, is_ambiguous BOOLEAN);
CREATE TABLE staging.deferred_end (start_event_id BIGINT, end_ns BIGINT);
CREATE TABLE staging.exchange (is_request BOOLEAN, event_at_client BIGINT, event_at_service BIGINT,
    client_event_id BIGINT, service_event_id BIGINT);
CREATE TABLE staging.executor (executor_id BIGINT, process_id BIGINT, kind VARCHAR,
    is_inferred BOOLEAN, thread_ids BIGINT[], executor_event_id BIGINT);
CREATE TABLE staging.executor_callback (executor_event_id BIGINT, callback_instance_id BIGINT);
CREATE TABLE staging.executor_first (thread_id BIGINT, process_id BIGINT, event_id BIGINT,
    waits BIGINT, polls BIGINT, is_undelimited BOOLEAN);
CREATE TABLE staging.executor_named (event_id BIGINT, process_id BIGINT, executor_addr UBIGINT,
    kind VARCHAR);
CREATE TABLE staging.executor_thread (executor_id BIGINT, thread_id BIGINT);
CREATE TABLE staging.failed_take (trace_id INTEGER, subscription_id BIGINT, process_id BIGINT,
    thread_id BIGINT, failed_ns BIGINT);
CREATE TABLE staging.finding (run_id BIGINT, trace_id BIGINT, name VARCHAR, host_id BIGINT,
    process_id BIGINT, thread_id BIGINT, node_id BIGINT, publishing_node_id BIGINT,
    topic_name VARCHAR, layer VARCHAR, subject VARCHAR, count BIGINT, detail VARCHAR);
CREATE TABLE staging.gap (trace_id INTEGER, cpu INTEGER, kind VARCHAR, start_ns BIGINT,
    end_ns BIGINT, event_count BIGINT, recording_index INTEGER, cpu_id INTEGER,
    covered_until_ns BIGINT, any_covered_until_ns BIGINT);
CREATE TABLE staging.garbage_collection (process_id BIGINT, thread_id BIGINT, start_ns BIGINT,
    end_ns BIGINT, generation INTEGER, callback_instance_id BIGINT);
CREATE TABLE staging.host (host_id BIGINT, clock_id BIGINT, hostname VARCHAR);
CREATE TABLE staging.host_usage (host_id BIGINT, start_ns BIGINT, end_ns BIGINT, cpus INTEGER,
    busy_ns BIGINT, stolen_ns BIGINT, cpu_pressure_ns BIGINT, io_pressure_ns BIGINT,
    memory_pressure_ns BIGINT, frequency_hz BIGINT, most_frequency_hz BIGINT,
    throttle_count BIGINT);
CREATE TABLE staging.lifecycle_transition (node_id BIGINT, at_ns BIGINT, start_state VARCHAR,
    goal_state VARCHAR);
CREATE TABLE staging.link_packet (sent_trace_id INTEGER, received_trace_id INTEGER,
    sent_event_id BIGINT, received_event_id BIGINT, sent_ns BIGINT, received_ns BIGINT,
    protocol VARCHAR, source_address VARCHAR, source_port INTEGER, destination_address VARCHAR,
    destination_port INTEGER, identification INTEGER, sequence_number BIGINT);
CREATE TABLE staging.link_request (request_id BIGINT, callback_instance_id BIGINT);
CREATE TABLE staging.link_response (response_id BIGINT, callback_instance_id BIGINT);
CREATE TABLE staging.loss_affected (kind VARCHAR, start_event_id BIGINT);
CREATE TABLE staging.near_gap (event_id BIGINT, thread_id BIGINT, sequence VARCHAR, ts_ns BIGINT,
    is_between BOOLEAN, is_behind BOOLEAN);
CREATE TABLE staging.network_packet (event_id BIGINT, trace_id INTEGER, clock_id BIGINT,
    ts_ns BIGINT, is_sent BOOLEAN, key UBIGINT);
CREATE TABLE staging.node (node_id BIGINT, process_id BIGINT, name VARCHAR, namespace VARCHAR,
    full_name VARCHAR, node_handle UBIGINT, created_ns BIGINT, is_inferred BOOLEAN,
    event_id BIGINT);
CREATE TABLE staging.object_node (event_id BIGINT, process_id BIGINT, node_handle UBIGINT,
    node_event_id BIGINT, is_inferred BOOLEAN, node_id BIGINT);
CREATE TABLE staging.other_thread (other_thread_id BIGINT, host_id BIGINT, tid INTEGER,
    name VARCHAR, pid INTEGER, program VARCHAR, command VARCHAR, process_id BIGINT,
    clock_key VARCHAR);
CREATE TABLE staging.packet (trace_index INTEGER, stream_index INTEGER, stream_class_id BIGINT,
    stream_instance_id BIGINT, cpu_id INTEGER, position BIGINT, begin_ns BIGINT, end_ns BIGINT,
    last_event_ns BIGINT, event_count BIGINT, discarded_event_count BIGINT,
    lost_packet_count BIGINT, is_numbered BOOLEAN, recording_index INTEGER, domain VARCHAR,
    known_end_ns BIGINT, is_ended_early BOOLEAN, trace_id INTEGER, previous_end_ns BIGINT,
    stream_end_ns BIGINT, recording_last_event_ns BIGINT, covered_until_ns BIGINT,
    last_begin_ns BIGINT);
CREATE TABLE staging.placed_source (trace_index INTEGER, path VARCHAR, uuid VARCHAR, domain VARCHAR,
    hostname VARCHAR, tracer VARCHAR, clock_uuid VARCHAR, clock_key VARCHAR, begin_ns BIGINT,
    end_ns BIGINT, clock_correction_ns BIGINT, clock_origin_ns BIGINT, shift_ns BIGINT,
    recording_index INTEGER, clock_id BIGINT, host_id BIGINT);
CREATE TABLE staging.preemptor (thread_id BIGINT, state_start_ns BIGINT, wait_start_ns BIGINT,
    start_ns BIGINT, end_ns BIGINT, state VARCHAR, cpu INTEGER, preemptor_thread_id BIGINT,
    preemptor_other_thread_id BIGINT, preemptor_priority INTEGER, thread_priority INTEGER);
CREATE TABLE staging.process (process_id BIGINT, host_id BIGINT, pid INTEGER, name VARCHAR,
    tracetools_version VARCHAR, python_version VARCHAR, first_seen_ns BIGINT, last_seen_ns BIGINT,
    pid_namespace BIGINT, life INTEGER, is_ambiguous BOOLEAN);
CREATE TABLE staging.program_usage (host_id BIGINT, process_id BIGINT, start_ns BIGINT,
    end_ns BIGINT, pid INTEGER, name VARCHAR, command VARCHAR, cpu_ns BIGINT, is_recorder BOOLEAN);
CREATE TABLE staging.publication_call (start_event_id BIGINT, end_event_id BIGINT,
    trace_index INTEGER, thread_id BIGINT, process_id BIGINT, start_ns BIGINT, end_ns BIGINT,
    intra_ns BIGINT, rclcpp_ns BIGINT, rcl_ns BIGINT, rmw_ns BIGINT, dds_ns BIGINT,
    publisher_handle UBIGINT, rmw_handle UBIGINT, writer UBIGINT, source_timestamp_ns BIGINT,
    callback_event_id BIGINT);
CREATE TABLE staging.publication_next (start_event_id BIGINT, next_event_ns BIGINT);
CREATE TABLE staging.publication_number (start_event_id BIGINT, publisher_event_id BIGINT,
    is_rosout BOOLEAN, process_id BIGINT, unknown_handle UBIGINT, publication_id BIGINT);
CREATE TABLE staging.publisher (publisher_id BIGINT, process_id BIGINT, node_id BIGINT,
    topic_name VARCHAR, publisher_handle UBIGINT, rmw_handle UBIGINT, gid BLOB, queue_depth BIGINT,
    created_ns BIGINT, is_internal BOOLEAN, is_inferred BOOLEAN, is_topic_learned BOOLEAN,
    is_topic_declared BOOLEAN, is_agnocast BOOLEAN, event_id BIGINT);
CREATE TABLE staging.publisher_known (event_id BIGINT, process_id BIGINT, topic_name VARCHAR,
    publisher_handle UBIGINT, rmw_handle UBIGINT, writer UBIGINT, gid BLOB, queue_depth BIGINT,
    created_ns BIGINT, is_internal BOOLEAN, is_agnocast BOOLEAN);
CREATE TABLE staging.python_mark (event_id BIGINT, ts_ns BIGINT, thread_id BIGINT,
    process_id BIGINT, number UBIGINT, kind VARCHAR, text VARCHAR,
    previous_callback_event_id BIGINT, previous_executor_event_id BIGINT);
CREATE TABLE staging.queued_message (start_event_id BIGINT, take_id BIGINT, subscription_id BIGINT,
    thread_id BIGINT, process_id BIGINT, taken_ns BIGINT, publishing_thread_id BIGINT,
    published_ns BIGINT, end_ns BIGINT, next_ns BIGINT, is_in_order BOOLEAN);
CREATE TABLE staging.quota_usage (host_id BIGINT, process_id BIGINT, name VARCHAR, start_ns BIGINT,
    end_ns BIGINT, throttled_count BIGINT, throttled_ns BIGINT, cpus DOUBLE);
CREATE TABLE staging.request (request_id BIGINT, client_id BIGINT, service_id BIGINT,
    sequence_number BIGINT, sent_ns BIGINT, taken_ns BIGINT, sender_thread_id BIGINT,
    receiver_thread_id BIGINT, callback_instance_id BIGINT, send_event_id BIGINT,
    take_event_id BIGINT, callback_start_event_id BIGINT);
CREATE TABLE staging.response (response_id BIGINT, client_id BIGINT, service_id BIGINT,
    request_id BIGINT, sequence_number BIGINT, sent_ns BIGINT, taken_ns BIGINT,
    sender_thread_id BIGINT, receiver_thread_id BIGINT, callback_instance_id BIGINT,
    send_event_id BIGINT, take_event_id BIGINT);
CREATE TABLE staging.ring_buffer_event (trace_id INTEGER, process_id BIGINT, kind VARCHAR,
    buffer_handle UBIGINT, slot BIGINT, at_ns BIGINT, publication_id BIGINT, take_id BIGINT,
    is_overwriting BOOLEAN, event_id BIGINT);
CREATE TABLE staging.sample_text (is_of_time BOOLEAN, pid INTEGER, tid INTEGER, cpu INTEGER,
    clock_key VARCHAR, hostname VARCHAR, is_monotonic BOOLEAN, at_ns BIGINT, cpu_ns BIGINT,
    stack VARCHAR);
CREATE TABLE staging.schedule (candidate_number BIGINT, trace_index INTEGER, clock_key VARCHAR,
    shift_ns BIGINT, event_count BIGINT, agreeing_count BIGINT, unknown_count BIGINT,
    is_joined BOOLEAN, has_cpus BOOLEAN, is_placed BOOLEAN, placed_clock_key VARCHAR,
    placed_hostname VARCHAR, placed_shift_ns BIGINT);
CREATE TABLE staging.schedule_candidate (candidate_number BIGINT, trace_index INTEGER,
    clock_key VARCHAR, shift_ns BIGINT, has_cpus BOOLEAN);
CREATE TABLE staging.schedule_interval (thread_id BIGINT, tid INTEGER, start_ns BIGINT,
    end_ns BIGINT, state VARCHAR, trace_index INTEGER, cpu INTEGER, next_cpu INTEGER,
    priority INTEGER, waking_event_id BIGINT);
CREATE TABLE staging.schedule_moment (candidate_number BIGINT, event_id BIGINT,
    thread_index INTEGER, at_ns BIGINT, tid INTEGER, contradiction_id BIGINT);
CREATE TABLE staging.sender_run (event_id BIGINT, callback_instance_id BIGINT);
CREATE TABLE staging.service (service_id BIGINT, process_id BIGINT, node_id BIGINT,
    service_name VARCHAR, service_handle UBIGINT, rmw_handle UBIGINT, gid BLOB, created_ns BIGINT,
    is_internal BOOLEAN, event_id BIGINT);
CREATE TABLE staging.service_event (event_id BIGINT, ts_ns BIGINT, thread_id BIGINT,
    process_id BIGINT, is_request BOOLEAN, rmw_handle UBIGINT, gid BLOB, sequence_number BIGINT,
    source_timestamp_ns BIGINT, service_event_id BIGINT, is_inferred BOOLEAN);
CREATE TABLE staging.simulated_time (process_id BIGINT, at_ns BIGINT, simulated_ns BIGINT);
CREATE TABLE staging.single_packet (event_id BIGINT, trace_id INTEGER, clock_id BIGINT,
    ts_ns BIGINT, is_sent BOOLEAN, key UBIGINT);
CREATE TABLE staging.stack (stack_id BIGINT, stack_frame_id BIGINT, depth INTEGER,
    calls STRUCT("function" VARCHAR, file VARCHAR)[]);
CREATE TABLE staging.stack_call (stack_id BIGINT, position INTEGER, stack_frame_id BIGINT);
CREATE TABLE staging.stack_frame (stack_frame_id BIGINT, function VARCHAR, file VARCHAR,
    call STRUCT("function" VARCHAR, file VARCHAR));
CREATE TABLE staging.stack_sample (process_id BIGINT, thread_id BIGINT, tid INTEGER, at_ns BIGINT,
    cpu INTEGER, callback_instance_id BIGINT, stack_id BIGINT, cpu_ns BIGINT);
CREATE TABLE staging.stack_text (stack VARCHAR, calls STRUCT("function" VARCHAR, file VARCHAR)[],
    ran BIGINT, is_cut BOOLEAN);
CREATE TABLE staging.subscription (subscription_id BIGINT, process_id BIGINT, node_id BIGINT,
    topic_name VARCHAR, subscription_handle UBIGINT, rmw_handle UBIGINT, gid BLOB,
    queue_depth BIGINT, created_ns BIGINT, is_internal BOOLEAN, is_inferred BOOLEAN,
    is_topic_learned BOOLEAN, is_topic_declared BOOLEAN, is_agnocast BOOLEAN, event_id BIGINT);
CREATE TABLE staging.subscription_known (event_id BIGINT, process_id BIGINT, thread_id BIGINT,
    topic_name VARCHAR, subscription_handle UBIGINT, rmw_handle UBIGINT, gid BLOB,
    queue_depth BIGINT, created_ns BIGINT, is_internal BOOLEAN, is_agnocast BOOLEAN);
CREATE TABLE staging.subscription_object (event_id BIGINT, subscription_event_id BIGINT);
CREATE TABLE staging.take_chain (start_event_id BIGINT, end_event_id BIGINT, trace_index INTEGER,
    thread_id BIGINT, process_id BIGINT, taken_ns BIGINT, method VARCHAR, rmw_handle UBIGINT,
    source_timestamp_ns BIGINT, subscription_event_id BIGINT, is_known BOOLEAN,
    buffer_handle UBIGINT);
CREATE TABLE staging.take_number (start_event_id BIGINT, process_id BIGINT, rmw_handle UBIGINT,
    callback_start_event_id BIGINT, subscription_event_id BIGINT, is_inferred BOOLEAN,
    take_id BIGINT);
CREATE TABLE staging.take_subscription (start_event_id BIGINT, take_id BIGINT,
    callback_start_event_id BIGINT, subscription_id BIGINT);
CREATE TABLE staging.thread (thread_index INTEGER, host_id BIGINT, pid_ns BIGINT, vpid INTEGER,
    life BIGINT, from_event_id BIGINT, until_event_id BIGINT, tid INTEGER, name VARCHAR,
    first_event_id BIGINT, last_event_id BIGINT, first_seen_ns BIGINT, last_seen_ns BIGINT,
    thread_id BIGINT, process_id BIGINT);
CREATE TABLE staging.thread_break (thread_id BIGINT, resumed_event_id BIGINT, resumed_ns BIGINT,
    is_elsewhere BOOLEAN);
CREATE TABLE staging.thread_state (number BIGINT, thread_id BIGINT, start_ns BIGINT, end_ns BIGINT,
    state VARCHAR, cpu INTEGER, priority INTEGER, preempted_by_thread_id BIGINT,
    preempted_by_other_thread_id BIGINT, preempted_by_priority INTEGER, is_cpu_idle BOOLEAN,
    waker_kind VARCHAR, waker_thread_id BIGINT, waker_other_thread_id BIGINT,
    is_loss_affected BOOLEAN);
CREATE TABLE staging.thread_switch (thread_id BIGINT, tid INTEGER, trace_index INTEGER,
    event_id BIGINT, at_ns BIGINT, cpu INTEGER, is_on BOOLEAN, unseen_since_ns BIGINT,
    priority INTEGER, prev_state BIGINT);
CREATE TABLE staging.thread_tid (thread_id BIGINT, clock_key VARCHAR, tid INTEGER, from_ns BIGINT,
    until_ns BIGINT);
CREATE TABLE staging.thread_usage (thread_id BIGINT, start_ns BIGINT, end_ns BIGINT,
    running_ns BIGINT, waiting_ns BIGINT, state VARCHAR, minor_faults BIGINT, major_faults BIGINT,
    io_ns BIGINT, voluntary_switches BIGINT, forced_switches BIGINT);
CREATE TABLE staging.thread_waking (thread_id BIGINT, tid INTEGER, event_id BIGINT, at_ns BIGINT,
    kind VARCHAR, clock_key VARCHAR, target_cpu INTEGER, waker_tid INTEGER, waker_name VARCHAR);
CREATE TABLE staging.timer (timer_id BIGINT, process_id BIGINT, node_id BIGINT, period_ns BIGINT,
    timer_handle UBIGINT, created_ns BIGINT, event_id BIGINT);
CREATE TABLE staging.timer_use (event_id BIGINT, process_id BIGINT, timer_handle UBIGINT,
    timer_event_id BIGINT, is_inferred BOOLEAN, has_callback BOOLEAN);
CREATE TABLE staging.trace (trace_id INTEGER, host_id BIGINT, path VARCHAR, uuid VARCHAR,
    tracer VARCHAR, domain VARCHAR, start_ns BIGINT, end_ns BIGINT, event_count BIGINT,
    discarded_event_count BIGINT, has_request_events BOOLEAN);
CREATE TABLE staging.untraced_reader (process_id BIGINT, topic_name VARCHAR, created_ns BIGINT);
CREATE TABLE staging.usage_file (file INTEGER, recorder VARCHAR, lines BIGINT, clock_id BIGINT,
    origin_ns BIGINT, hostname VARCHAR, host_id BIGINT, ticks BIGINT, cpus INTEGER,
    recorders VARCHAR[]);
CREATE TABLE staging.usage_line (file INTEGER, number BIGINT, kind VARCHAR, subject BIGINT,
    line VARCHAR, at_ns BIGINT, before_ns BIGINT);
CREATE TABLE staging.usage_thread (file INTEGER, subject BIGINT, process BIGINT, last_ns BIGINT,
    thread_id BIGINT, process_id BIGINT);
CREATE TABLE staging.user_event (user_event_id BIGINT, trace_id INTEGER, process_id BIGINT,
    thread_id BIGINT, cpu INTEGER, at_ns BIGINT, name VARCHAR, callback_instance_id BIGINT,
    fields VARCHAR, is_loss_affected BOOLEAN);
