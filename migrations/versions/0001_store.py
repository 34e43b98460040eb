"""Where the history of the tables begins: all of them, as the first release has them.

New databases are made of `schema/store.sql`, not of revisions. Each later change of a table is a
revision after this one, with literal operations that do not follow later changes. Its name is that
of its file. Comments, views and macros need no revision: an upgrade writes them anew.
"""

from alembic import op

revision = "0001_store"
down_revision = None
branch_labels = None
depends_on = None

TABLES = """
CREATE TABLE store.bag_message (
    run_id BIGINT NOT NULL, publication_id BIGINT NOT NULL, topic_name VARCHAR NOT NULL,
    type_name VARCHAR NOT NULL, received_ns BIGINT NOT NULL, size_bytes BIGINT NOT NULL,
    stamp_ns BIGINT, frame_id VARCHAR
);
CREATE TABLE store.publication (
    publication_id BIGINT NOT NULL, run_id BIGINT NOT NULL, trace_id BIGINT NOT NULL,
    publisher_id BIGINT, process_id BIGINT NOT NULL, thread_id BIGINT NOT NULL,
    start_ns BIGINT NOT NULL, end_ns BIGINT NOT NULL, intra_ns BIGINT, rclcpp_ns BIGINT,
    rcl_ns BIGINT, rmw_ns BIGINT, dds_ns BIGINT, source_timestamp_ns BIGINT, start_event_id BIGINT,
    end_event_id BIGINT, callback_event_id BIGINT, is_loss_affected BOOLEAN DEFAULT false NOT NULL,
    next_event_ns BIGINT
);
CREATE TABLE store.take (
    take_id BIGINT NOT NULL, run_id BIGINT NOT NULL, trace_id BIGINT NOT NULL,
    subscription_id BIGINT, process_id BIGINT NOT NULL, thread_id BIGINT NOT NULL,
    taken_ns BIGINT NOT NULL, source_timestamp_ns BIGINT, method VARCHAR NOT NULL,
    start_event_id BIGINT, end_event_id BIGINT, is_loss_affected BOOLEAN DEFAULT false NOT NULL
);
CREATE TABLE store.failed_take (
    run_id BIGINT NOT NULL, trace_id BIGINT NOT NULL, subscription_id BIGINT,
    process_id BIGINT NOT NULL, thread_id BIGINT NOT NULL, failed_ns BIGINT NOT NULL
);
CREATE TABLE store.ring_buffer_event (
    run_id BIGINT NOT NULL, trace_id BIGINT NOT NULL, process_id BIGINT NOT NULL,
    kind VARCHAR NOT NULL, buffer_handle UBIGINT, slot BIGINT, at_ns BIGINT NOT NULL,
    publication_id BIGINT, take_id BIGINT, is_overwriting BOOLEAN DEFAULT false NOT NULL,
    event_id BIGINT
);
CREATE TABLE store.data_arrival (
    run_id BIGINT NOT NULL, take_id BIGINT NOT NULL, waited_ns BIGINT NOT NULL,
    is_ambiguous BOOLEAN DEFAULT false NOT NULL
);
CREATE TABLE store.agnocast_entry (
    run_id BIGINT NOT NULL, publication_id BIGINT, take_id BIGINT, entry_id BIGINT NOT NULL
);
CREATE TABLE store.request (
    request_id BIGINT NOT NULL, run_id BIGINT NOT NULL, client_id BIGINT, service_id BIGINT,
    sequence_number BIGINT, sent_ns BIGINT, taken_ns BIGINT, sender_thread_id BIGINT,
    receiver_thread_id BIGINT, callback_instance_id BIGINT
);
CREATE TABLE store.response (
    response_id BIGINT NOT NULL, run_id BIGINT NOT NULL, client_id BIGINT, service_id BIGINT,
    sequence_number BIGINT, sent_ns BIGINT, taken_ns BIGINT, sender_thread_id BIGINT,
    receiver_thread_id BIGINT, callback_instance_id BIGINT, request_id BIGINT
);
CREATE TABLE store.callback (
    callback_id BIGINT NOT NULL, run_id BIGINT NOT NULL, process_id BIGINT NOT NULL, node_id BIGINT,
    kind VARCHAR NOT NULL, subscription_id BIGINT, timer_id BIGINT, service_id BIGINT,
    callback_handle UBIGINT, symbol VARCHAR, created_ns BIGINT, PRIMARY KEY (callback_id)
);
CREATE TABLE store.callback_group (
    callback_group_id BIGINT NOT NULL, run_id BIGINT NOT NULL, process_id BIGINT NOT NULL,
    executor_id BIGINT, kind VARCHAR NOT NULL, PRIMARY KEY (callback_group_id)
);
CREATE TABLE store.callback_group_member (
    run_id BIGINT NOT NULL, callback_group_id BIGINT NOT NULL, callback_id BIGINT NOT NULL
);
CREATE TABLE store.callback_instance (
    callback_instance_id BIGINT NOT NULL, run_id BIGINT NOT NULL, trace_id BIGINT NOT NULL,
    callback_id BIGINT NOT NULL, process_id BIGINT NOT NULL, thread_id BIGINT NOT NULL,
    start_ns BIGINT NOT NULL, end_ns BIGINT, take_id BIGINT, request_id BIGINT,
    response_id BIGINT, continues_id BIGINT, is_intra_process BOOLEAN DEFAULT false NOT NULL,
    parent_id BIGINT, depth INTEGER NOT NULL,
    start_event_id BIGINT, end_event_id BIGINT, effective_end_event_id BIGINT,
    is_loss_affected BOOLEAN DEFAULT false NOT NULL
);
CREATE TABLE store.clock (
    clock_id BIGINT NOT NULL, run_id BIGINT NOT NULL, uuid VARCHAR, offset_ns BIGINT NOT NULL,
    drift_ppb BIGINT NOT NULL, reference_ns BIGINT NOT NULL, uncertainty_ns BIGINT,
    method VARCHAR NOT NULL, drift_uncertainty_ppb BIGINT, reference_clock_id BIGINT,
    PRIMARY KEY (clock_id)
);
CREATE TABLE store.clock_uncertainty (
    run_id BIGINT NOT NULL, clock_id BIGINT NOT NULL, at_ns BIGINT NOT NULL,
    uncertainty_ns BIGINT NOT NULL
);
CREATE TABLE store.simulated_time (
    run_id BIGINT NOT NULL, process_id BIGINT NOT NULL, at_ns BIGINT NOT NULL,
    simulated_ns BIGINT NOT NULL
);
CREATE TABLE store.stamp_clock (
    run_id BIGINT NOT NULL, clock_id BIGINT NOT NULL, start_ns BIGINT, end_ns BIGINT,
    at_ns BIGINT NOT NULL, difference_ns BIGINT NOT NULL, drift_ppb BIGINT NOT NULL,
    slack_ns BIGINT NOT NULL
);
CREATE TABLE store.executor (
    executor_id BIGINT NOT NULL, run_id BIGINT NOT NULL, process_id BIGINT NOT NULL,
    kind VARCHAR NOT NULL, is_inferred BOOLEAN DEFAULT false NOT NULL, PRIMARY KEY (executor_id)
);
CREATE TABLE store.executor_thread (
    run_id BIGINT NOT NULL, executor_id BIGINT NOT NULL, thread_id BIGINT NOT NULL
);
CREATE TABLE store.executor_state (
    run_id BIGINT NOT NULL, thread_id BIGINT NOT NULL, state VARCHAR NOT NULL,
    start_ns BIGINT NOT NULL, is_behind_gap BOOLEAN DEFAULT false NOT NULL,
    callback_instance_id BIGINT, start_event_id BIGINT
);
CREATE TABLE store.flow_call (
    run_id BIGINT NOT NULL, publication_id BIGINT NOT NULL, publisher_id BIGINT,
    kind VARCHAR NOT NULL, callback_instance_id BIGINT, caller_id BIGINT NOT NULL,
    route BIGINT[] NOT NULL, take_id BIGINT, subscription_id BIGINT, taken_request_id BIGINT,
    taken_response_id BIGINT
);
CREATE TABLE store.flow_root (
    run_id BIGINT NOT NULL, publication_id BIGINT NOT NULL, publisher_id BIGINT NOT NULL,
    is_source BOOLEAN DEFAULT false NOT NULL, root_kind VARCHAR NOT NULL, root_id BIGINT NOT NULL,
    route BIGINT[] NOT NULL, before_take_ns BIGINT
);
CREATE TABLE store.flow_hop (
    run_id BIGINT NOT NULL, from_subscription_id BIGINT, route BIGINT[] NOT NULL,
    publisher_id BIGINT NOT NULL, subscription_id BIGINT NOT NULL,
    is_source BOOLEAN DEFAULT false NOT NULL, is_cached BOOLEAN DEFAULT false NOT NULL
);
CREATE TABLE store.host (
    host_id BIGINT NOT NULL, run_id BIGINT NOT NULL, clock_id BIGINT NOT NULL,
    hostname VARCHAR NOT NULL, PRIMARY KEY (host_id)
);
CREATE TABLE store.process (
    process_id BIGINT NOT NULL, run_id BIGINT NOT NULL, host_id BIGINT NOT NULL,
    pid INTEGER NOT NULL, name VARCHAR, tracetools_version VARCHAR, python_version VARCHAR,
    first_seen_ns BIGINT, last_seen_ns BIGINT, pid_namespace BIGINT, life INTEGER NOT NULL,
    is_ambiguous BOOLEAN,
    PRIMARY KEY (process_id)
);
CREATE TABLE store.thread (
    thread_id BIGINT NOT NULL, run_id BIGINT NOT NULL, process_id BIGINT NOT NULL,
    tid INTEGER NOT NULL, name VARCHAR, first_event_id BIGINT, last_event_id BIGINT,
    first_seen_ns BIGINT, last_seen_ns BIGINT, PRIMARY KEY (thread_id)
);
CREATE TABLE store.node (
    node_id BIGINT NOT NULL, run_id BIGINT NOT NULL, process_id BIGINT NOT NULL, name VARCHAR,
    namespace VARCHAR, full_name VARCHAR, node_handle UBIGINT, created_ns BIGINT,
    is_inferred BOOLEAN DEFAULT false NOT NULL, PRIMARY KEY (node_id)
);
CREATE TABLE store.lifecycle_transition (
    run_id BIGINT NOT NULL, node_id BIGINT, at_ns BIGINT NOT NULL, start_state VARCHAR,
    goal_state VARCHAR
);
CREATE TABLE store.thread_break (
    run_id BIGINT NOT NULL, thread_id BIGINT NOT NULL, resumed_ns BIGINT NOT NULL,
    resumed_event_id BIGINT, is_elsewhere BOOLEAN DEFAULT false NOT NULL
);
CREATE TABLE store.annotation (
    annotation_id BIGINT NOT NULL, run_id BIGINT NOT NULL, kind VARCHAR NOT NULL,
    source VARCHAR NOT NULL, process_id BIGINT NOT NULL, queue_depth BIGINT,
    PRIMARY KEY (annotation_id)
);
CREATE TABLE store.annotation_input (
    run_id BIGINT NOT NULL, annotation_id BIGINT NOT NULL, subscription_id BIGINT NOT NULL
);
CREATE TABLE store.annotation_output (
    run_id BIGINT NOT NULL, annotation_id BIGINT NOT NULL, publisher_id BIGINT NOT NULL
);
CREATE TABLE store.nearest_message (
    run_id BIGINT NOT NULL, topic_name VARCHAR NOT NULL, source_timestamp_ns BIGINT NOT NULL,
    publication_id BIGINT, candidate_count BIGINT
);
CREATE TABLE store.link_transport (
    run_id BIGINT NOT NULL, publication_id BIGINT NOT NULL, take_id BIGINT NOT NULL,
    publisher_id BIGINT, subscription_id BIGINT, method VARCHAR NOT NULL, candidate_count BIGINT,
    is_self_loop BOOLEAN DEFAULT false NOT NULL, is_loss_affected BOOLEAN DEFAULT false NOT NULL,
    is_copy BOOLEAN DEFAULT false NOT NULL
);
CREATE TABLE store.link_packet (
    run_id BIGINT NOT NULL, sent_trace_id BIGINT NOT NULL, received_trace_id BIGINT NOT NULL,
    sent_ns BIGINT NOT NULL, received_ns BIGINT NOT NULL, protocol VARCHAR NOT NULL,
    source_address VARCHAR NOT NULL, source_port INTEGER NOT NULL,
    destination_address VARCHAR NOT NULL, destination_port INTEGER NOT NULL, identification INTEGER,
    sequence_number BIGINT
);
CREATE TABLE store.link_causal (
    run_id BIGINT NOT NULL, callback_instance_id BIGINT, publication_id BIGINT NOT NULL,
    take_id BIGINT, subscription_id BIGINT, publisher_id BIGINT, kind VARCHAR NOT NULL,
    annotation_id BIGINT, candidate_count BIGINT, is_loss_affected BOOLEAN DEFAULT false NOT NULL
);
CREATE TABLE store.link_request (
    run_id BIGINT NOT NULL, request_id BIGINT NOT NULL, callback_instance_id BIGINT
);
CREATE TABLE store.link_response (
    run_id BIGINT NOT NULL, response_id BIGINT NOT NULL, callback_instance_id BIGINT
);
CREATE TABLE store.link_call (
    run_id BIGINT NOT NULL, taken_request_id BIGINT, taken_response_id BIGINT,
    publication_id BIGINT, publisher_id BIGINT, request_id BIGINT, response_id BIGINT,
    candidate_count BIGINT NOT NULL
);
CREATE TABLE store.undelivered (
    run_id BIGINT NOT NULL, publication_id BIGINT NOT NULL, publisher_id BIGINT NOT NULL,
    subscription_id BIGINT NOT NULL, reason VARCHAR NOT NULL
);
CREATE TABLE store.orphan_take (
    run_id BIGINT NOT NULL, take_id BIGINT NOT NULL, subscription_id BIGINT, reason VARCHAR NOT NULL
);
CREATE TABLE store.definition (
    name VARCHAR NOT NULL, hash VARCHAR NOT NULL, msgflow_version VARCHAR NOT NULL,
    PRIMARY KEY (name)
);
CREATE TABLE store.run (
    run_id BIGINT NOT NULL, name VARCHAR NOT NULL, created_at TIMESTAMP NOT NULL,
    msgflow_version VARCHAR NOT NULL, derivation_hash VARCHAR NOT NULL, start_ns BIGINT,
    end_ns BIGINT, event_count BIGINT, labels VARCHAR[], clock_sync VARCHAR, PRIMARY KEY (run_id)
);
CREATE TABLE store.trace (
    trace_id BIGINT NOT NULL, run_id BIGINT NOT NULL, host_id BIGINT NOT NULL,
    path VARCHAR NOT NULL, uuid VARCHAR, tracer VARCHAR, domain VARCHAR, start_ns BIGINT,
    end_ns BIGINT, event_count BIGINT, discarded_event_count BIGINT, has_request_events BOOLEAN,
    PRIMARY KEY (trace_id)
);
CREATE TABLE store.packet (
    run_id BIGINT NOT NULL, trace_id BIGINT NOT NULL, stream_class_id BIGINT,
    stream_instance_id BIGINT, cpu_id INTEGER, position BIGINT, begin_ns BIGINT, end_ns BIGINT,
    last_event_ns BIGINT, event_count BIGINT, discarded_event_count BIGINT, lost_packet_count BIGINT
);
CREATE TABLE store.gap (
    run_id BIGINT NOT NULL, trace_id BIGINT NOT NULL, cpu INTEGER, kind VARCHAR NOT NULL,
    start_ns BIGINT, end_ns BIGINT, event_count BIGINT
);
CREATE TABLE store.finding (
    run_id BIGINT NOT NULL, trace_id BIGINT, name VARCHAR NOT NULL, subject VARCHAR, count BIGINT,
    detail VARCHAR
);
CREATE TABLE store.publisher (
    publisher_id BIGINT NOT NULL, run_id BIGINT NOT NULL, process_id BIGINT NOT NULL,
    node_id BIGINT, topic_name VARCHAR, publisher_handle UBIGINT, rmw_handle UBIGINT, gid BLOB,
    queue_depth BIGINT, created_ns BIGINT, is_internal BOOLEAN DEFAULT false NOT NULL,
    is_inferred BOOLEAN DEFAULT false NOT NULL, is_topic_learned BOOLEAN DEFAULT false NOT NULL,
    is_topic_declared BOOLEAN DEFAULT false NOT NULL,
    is_agnocast BOOLEAN DEFAULT false NOT NULL, PRIMARY KEY (publisher_id)
);
CREATE TABLE store.subscription (
    subscription_id BIGINT NOT NULL, run_id BIGINT NOT NULL, process_id BIGINT NOT NULL,
    node_id BIGINT, topic_name VARCHAR, subscription_handle UBIGINT, rmw_handle UBIGINT, gid BLOB,
    queue_depth BIGINT, created_ns BIGINT, is_internal BOOLEAN DEFAULT false NOT NULL,
    is_inferred BOOLEAN DEFAULT false NOT NULL, is_topic_learned BOOLEAN DEFAULT false NOT NULL,
    is_topic_declared BOOLEAN DEFAULT false NOT NULL,
    is_agnocast BOOLEAN DEFAULT false NOT NULL, PRIMARY KEY (subscription_id)
);
CREATE TABLE store.untraced_reader (
    run_id BIGINT NOT NULL, process_id BIGINT NOT NULL, topic_name VARCHAR NOT NULL,
    created_ns BIGINT NOT NULL
);
CREATE TABLE store.timer (
    timer_id BIGINT NOT NULL, run_id BIGINT NOT NULL, process_id BIGINT NOT NULL, node_id BIGINT,
    period_ns BIGINT, timer_handle UBIGINT, created_ns BIGINT, PRIMARY KEY (timer_id)
);
CREATE TABLE store.service (
    service_id BIGINT NOT NULL, run_id BIGINT NOT NULL, process_id BIGINT NOT NULL, node_id BIGINT,
    service_name VARCHAR, service_handle UBIGINT, rmw_handle UBIGINT, gid BLOB, created_ns BIGINT,
    is_internal BOOLEAN DEFAULT false NOT NULL, PRIMARY KEY (service_id)
);
CREATE TABLE store.client (
    client_id BIGINT NOT NULL, run_id BIGINT NOT NULL, process_id BIGINT NOT NULL, node_id BIGINT,
    service_name VARCHAR, client_handle UBIGINT, rmw_handle UBIGINT, gid BLOB, created_ns BIGINT,
    is_internal BOOLEAN DEFAULT false NOT NULL, PRIMARY KEY (client_id)
);
CREATE TABLE store.other_thread (
    other_thread_id BIGINT NOT NULL, run_id BIGINT NOT NULL, host_id BIGINT NOT NULL,
    tid INTEGER NOT NULL, name VARCHAR, PRIMARY KEY (other_thread_id)
);
CREATE TABLE store.thread_state (
    run_id BIGINT NOT NULL, thread_id BIGINT NOT NULL, start_ns BIGINT NOT NULL,
    end_ns BIGINT NOT NULL, state VARCHAR NOT NULL, cpu INTEGER, priority INTEGER,
    preempted_by_thread_id BIGINT, preempted_by_other_thread_id BIGINT,
    preempted_by_priority INTEGER, waker_kind VARCHAR, waker_thread_id BIGINT,
    waker_other_thread_id BIGINT, is_loss_affected BOOLEAN DEFAULT false NOT NULL
);
CREATE TABLE store.preemptor (
    run_id BIGINT NOT NULL, thread_id BIGINT NOT NULL, start_ns BIGINT NOT NULL,
    end_ns BIGINT NOT NULL, state VARCHAR NOT NULL, cpu INTEGER, preemptor_thread_id BIGINT,
    preemptor_other_thread_id BIGINT, preemptor_priority INTEGER, thread_priority INTEGER
);
CREATE TABLE store.callback_preemptor (
    run_id BIGINT NOT NULL, callback_instance_id BIGINT NOT NULL, preemptor_thread_id BIGINT,
    preemptor_other_thread_id BIGINT, preemptor_priority INTEGER, preempted_ns BIGINT NOT NULL,
    runnable_ns BIGINT NOT NULL
);
CREATE TABLE store.callback_schedule (
    run_id BIGINT NOT NULL, callback_instance_id BIGINT NOT NULL, running_ns BIGINT NOT NULL,
    preempted_ns BIGINT NOT NULL, runnable_ns BIGINT NOT NULL, sleeping_ns BIGINT NOT NULL,
    uninterruptible_ns BIGINT NOT NULL, unknown_ns BIGINT NOT NULL,
    preemption_count BIGINT NOT NULL, migration_count BIGINT NOT NULL,
    is_loss_affected BOOLEAN DEFAULT false NOT NULL, irq_ns BIGINT, softirq_ns BIGINT
);
CREATE TABLE store.cpu_usage (
    run_id BIGINT NOT NULL, host_id BIGINT NOT NULL, cpu INTEGER, start_ns BIGINT NOT NULL,
    thread_id BIGINT, tid INTEGER NOT NULL, name VARCHAR, running_ns BIGINT NOT NULL,
    frequency_hz BIGINT
);
CREATE TABLE store.user_event (
    user_event_id BIGINT NOT NULL, run_id BIGINT NOT NULL, trace_id BIGINT NOT NULL,
    process_id BIGINT NOT NULL, thread_id BIGINT NOT NULL, cpu INTEGER, at_ns BIGINT NOT NULL,
    name VARCHAR NOT NULL, callback_instance_id BIGINT, fields VARCHAR NOT NULL,
    is_loss_affected BOOLEAN DEFAULT false NOT NULL
);
CREATE TABLE store.stack_frame (
    stack_frame_id BIGINT NOT NULL, run_id BIGINT NOT NULL, function VARCHAR NOT NULL,
    file VARCHAR NOT NULL, PRIMARY KEY (stack_frame_id)
);
CREATE TABLE store.stack (
    stack_id BIGINT NOT NULL, run_id BIGINT NOT NULL, stack_frame_id BIGINT NOT NULL,
    depth INTEGER NOT NULL, PRIMARY KEY (stack_id)
);
CREATE TABLE store.stack_call (
    run_id BIGINT NOT NULL, stack_id BIGINT NOT NULL, position INTEGER NOT NULL,
    stack_frame_id BIGINT NOT NULL
);
CREATE TABLE store.stack_sample (
    run_id BIGINT NOT NULL, process_id BIGINT NOT NULL, thread_id BIGINT, tid INTEGER NOT NULL,
    at_ns BIGINT NOT NULL, cpu INTEGER, callback_instance_id BIGINT, stack_id BIGINT NOT NULL,
    cpu_ns BIGINT
);
"""


def upgrade() -> None:
    """Create the tables."""
    op.execute(TABLES)
