-- Generated from msgflow/db/tables.py by `python -m msgflow.db.render`; do not edit.
-- The tables behind the public views. Users read the views of schema main, not these.

-- One row per part of the schema that is re-applied rather than migrated.
CREATE TABLE store.definition (
    name            VARCHAR PRIMARY KEY,         -- 'views': the SQL of all views and macros
    hash            VARCHAR NOT NULL,            -- SHA-256 of the SQL that was last applied
    msgflow_version VARCHAR NOT NULL             -- Version of msgflow that applied it
);

-- One row per ingest of traces that belong together.
CREATE TABLE store.run (
    run_id          BIGINT PRIMARY KEY,          -- Identity of the run
    name            VARCHAR NOT NULL,            -- Name given by the user, or the name of the first trace directory
    created_at      TIMESTAMP NOT NULL,          -- When the run was ingested, UTC
    msgflow_version VARCHAR NOT NULL,            -- Version of msgflow that ingested the run
    derivation_hash VARCHAR NOT NULL,            -- SHA-256 of the SQL that derived the links
    start_ns        BIGINT,                      -- First event of any trace [epoch ns]
    end_ns          BIGINT,                      -- Last event of any trace [epoch ns]
    event_count     BIGINT,                      -- Events read
    labels          VARCHAR[]                    -- What users say of the run, KEY=VALUE each, sorted; NULL: nothing
);

-- One row per CTF trace read.
CREATE TABLE store.trace (
    trace_id              BIGINT PRIMARY KEY,    -- Identity of the trace
    run_id                BIGINT NOT NULL,       -- Run that the row belongs to -> run.run_id
    host_id               BIGINT NOT NULL,       -- Host that was traced -> host.host_id
    path                  VARCHAR NOT NULL,      -- Directory as it was given
    uuid                  VARCHAR,               -- UUID of the trace
    tracer                VARCHAR,               -- Tracer and its version
    domain                VARCHAR,               -- 'ust' or 'kernel'
    start_ns              BIGINT,                -- First event or packet begin [epoch ns]
    end_ns                BIGINT,                -- Last event or packet end [epoch ns]
    event_count           BIGINT,                -- Events read
    discarded_event_count BIGINT                 -- Events that the tracer counted as discarded
);

-- One row per packet of a trace; the identity of what was read.
CREATE TABLE store.packet (
    run_id                BIGINT NOT NULL,       -- Run that the row belongs to -> run.run_id
    trace_id              BIGINT NOT NULL,       -- Trace it was recorded in -> trace.trace_id
    stream_class_id       BIGINT,                -- Stream class (channel) of the packet
    stream_instance_id    BIGINT,                -- Stream (buffer) of the packet
    cpu_id                INTEGER,               -- CPU that wrote the packet
    position              BIGINT,                -- Position in its stream, from 0
    begin_ns              BIGINT,                -- Begin of the packet [epoch ns]
    end_ns                BIGINT,                -- End of the packet [epoch ns]
    last_event_ns         BIGINT,                -- Last event in the packet [epoch ns]
    event_count           BIGINT,                -- Events in the packet
    discarded_event_count BIGINT,                -- Events lost in the packet, after its last event
    lost_packet_count     BIGINT                 -- Packets missing right before it
);

-- One row per gap in a trace.
CREATE TABLE store.loss_interval (
    run_id      BIGINT NOT NULL,                 -- Run that the row belongs to -> run.run_id
    trace_id    BIGINT NOT NULL,                 -- Trace it was recorded in -> trace.trace_id
    cpu         INTEGER,                         -- CPU concerned; NULL: all
    kind        VARCHAR NOT NULL,                -- 'loss' (discarded events), 'packets' (lost packets) or 'pause' (not tracing)
    start_ns    BIGINT,                          -- Last moment before the gap [epoch ns]
    end_ns      BIGINT,                          -- First moment after the gap [epoch ns]
    event_count BIGINT                           -- Events lost, where the tracer counted them
);

-- One row per clock: hosts of one clock need no synchronisation.
CREATE TABLE store.clock (
    clock_id              BIGINT PRIMARY KEY,    -- Identity of the clock
    run_id                BIGINT NOT NULL,       -- Run that the row belongs to -> run.run_id
    uuid                  VARCHAR,               -- UUID of the clock (LTTng: boot identity)
    offset_ns             BIGINT NOT NULL,       -- Added to a time of this clock to correct it [ns]
    drift_ppb             BIGINT NOT NULL,       -- Added per elapsed time since reference_ns [1e-9]
    reference_ns          BIGINT NOT NULL,       -- Moment at which the correction is offset_ns alone [epoch ns]
    uncertainty_ns        BIGINT,                -- Bound of the error of the correction [ns]
    method                VARCHAR NOT NULL,      -- 'none', 'messages', 'packets' or 'file'
    drift_uncertainty_ppb BIGINT,                -- What its bound grows by per time elapsed since reference_ns or before it; NULL: none, or not known [1e-9]
    reference_clock_id    BIGINT                 -- Clock whose times its times become; NULL: not brought together with others -> clock.clock_id
);

-- One row per clock and moment; between two the bound is a straight line.
CREATE TABLE store.clock_uncertainty (
    run_id         BIGINT NOT NULL,              -- Run that the row belongs to -> run.run_id
    clock_id       BIGINT NOT NULL,              -- The clock -> clock.clock_id
    at_ns          BIGINT NOT NULL,              -- Moment, as the clock showed it [epoch ns]
    uncertainty_ns BIGINT NOT NULL               -- Bound of the error of the correction at that moment [ns]
);

-- One row per machine or container.
CREATE TABLE store.host (
    host_id  BIGINT PRIMARY KEY,                 -- Identity of the host
    run_id   BIGINT NOT NULL,                    -- Run that the row belongs to -> run.run_id
    clock_id BIGINT NOT NULL,                    -- Clock of the host -> clock.clock_id
    hostname VARCHAR NOT NULL                    -- Name recorded in the trace, or given by the user
);

-- One row per process life.
CREATE TABLE store.process (
    process_id         BIGINT PRIMARY KEY,       -- Identity of the process life
    run_id             BIGINT NOT NULL,          -- Run that the row belongs to -> run.run_id
    host_id            BIGINT NOT NULL,          -- Host it ran on -> host.host_id
    pid                INTEGER NOT NULL,         -- Process id, virtual where the trace has no other
    name               VARCHAR,                  -- Name of the process (its first thread)
    tracetools_version VARCHAR,                  -- Version that rcl_init stated; for display only
    first_seen_ns      BIGINT,                   -- First event [epoch ns]
    last_seen_ns       BIGINT,                   -- Last event [epoch ns]
    pid_namespace      BIGINT,                   -- PID namespace, where the trace has it
    life               INTEGER NOT NULL          -- Number of the life among those of one pid, from 1
);

-- One row per thread.
CREATE TABLE store.thread (
    thread_id      BIGINT PRIMARY KEY,           -- Identity of the thread
    run_id         BIGINT NOT NULL,              -- Run that the row belongs to -> run.run_id
    process_id     BIGINT NOT NULL,              -- Process it lives in -> process.process_id
    tid            INTEGER NOT NULL,             -- Thread id, virtual where the trace has no other
    name           VARCHAR,                      -- Name of the thread
    first_event_id BIGINT,                       -- First event [event order]
    last_event_id  BIGINT,                       -- Last event [event order]
    first_seen_ns  BIGINT,                       -- First event [epoch ns]
    last_seen_ns   BIGINT                        -- Last event [epoch ns]
);

-- One row per ROS node.
CREATE TABLE store.node (
    node_id     BIGINT PRIMARY KEY,              -- Identity of the node
    run_id      BIGINT NOT NULL,                 -- Run that the row belongs to -> run.run_id
    process_id  BIGINT NOT NULL,                 -- Process it lives in -> process.process_id
    name        VARCHAR,                         -- Name without namespace
    namespace   VARCHAR,                         -- Namespace, beginning with /
    full_name   VARCHAR,                         -- Namespace and name
    node_handle UBIGINT,                         -- rcl node handle; an address, valid in its process until reused
    created_ns  BIGINT,                          -- rcl_node_init [epoch ns]
    is_inferred BOOLEAN NOT NULL                 -- Its initialisation was not traced
);

-- One row per publisher.
CREATE TABLE store.publisher (
    publisher_id     BIGINT PRIMARY KEY,         -- Identity of the publisher
    run_id           BIGINT NOT NULL,            -- Run that the row belongs to -> run.run_id
    process_id       BIGINT NOT NULL,            -- Process it lives in -> process.process_id
    node_id          BIGINT,                     -- Node it belongs to -> node.node_id
    topic_name       VARCHAR,                    -- Fully expanded topic name
    publisher_handle UBIGINT,                    -- rcl publisher handle; an address, valid in its process until reused
    rmw_handle       UBIGINT,                    -- rmw publisher handle; an address, valid in its process until reused
    gid              BLOB,                       -- Global identifier, 16 bytes; NULL: none
    queue_depth      BIGINT,                     -- History depth asked for
    created_ns       BIGINT,                     -- First initialisation event [epoch ns]
    is_internal      BOOLEAN NOT NULL,           -- Infrastructure of ROS (/rosout, /parameter_events, ...)
    is_inferred      BOOLEAN NOT NULL,           -- Its initialisation was not traced
    is_topic_learned BOOLEAN                     -- Its topic was deduced from a link; NULL: no
);

-- One row per subscription.
CREATE TABLE store.subscription (
    subscription_id     BIGINT PRIMARY KEY,      -- Identity of the subscription
    run_id              BIGINT NOT NULL,         -- Run that the row belongs to -> run.run_id
    process_id          BIGINT NOT NULL,         -- Process it lives in -> process.process_id
    node_id             BIGINT,                  -- Node it belongs to -> node.node_id
    topic_name          VARCHAR,                 -- Fully expanded topic name
    subscription_handle UBIGINT,                 -- rcl subscription handle; an address, valid in its process until reused
    rmw_handle          UBIGINT,                 -- rmw subscription handle; an address, valid in its process until reused
    gid                 BLOB,                    -- Global identifier, 16 bytes; NULL: none
    queue_depth         BIGINT,                  -- History depth asked for
    created_ns          BIGINT,                  -- First initialisation event [epoch ns]
    is_internal         BOOLEAN NOT NULL,        -- Infrastructure of ROS (/parameter_events, /clock, ...)
    is_inferred         BOOLEAN NOT NULL,        -- Its initialisation was not traced
    is_topic_learned    BOOLEAN                  -- Its topic was deduced from a link; NULL: no
);

-- One row per timer.
CREATE TABLE store.timer (
    timer_id     BIGINT PRIMARY KEY,             -- Identity of the timer
    run_id       BIGINT NOT NULL,                -- Run that the row belongs to -> run.run_id
    process_id   BIGINT NOT NULL,                -- Process it lives in -> process.process_id
    node_id      BIGINT,                         -- Node it belongs to -> node.node_id
    period_ns    BIGINT,                         -- Period [ns]
    timer_handle UBIGINT,                        -- rcl timer handle; an address, valid in its process until reused
    created_ns   BIGINT                          -- rcl_timer_init [epoch ns]
);

-- One row per service.
CREATE TABLE store.service (
    service_id     BIGINT PRIMARY KEY,           -- Identity of the service
    run_id         BIGINT NOT NULL,              -- Run that the row belongs to -> run.run_id
    process_id     BIGINT NOT NULL,              -- Process it lives in -> process.process_id
    node_id        BIGINT,                       -- Node it belongs to -> node.node_id
    service_name   VARCHAR,                      -- Fully expanded service name
    service_handle UBIGINT,                      -- rcl service handle; an address, valid in its process until reused
    rmw_handle     UBIGINT,                      -- rmw service handle; an address, valid in its process until reused
    gid            BLOB,                         -- Global identifier, 16 bytes; NULL: none
    created_ns     BIGINT,                       -- rcl_service_init [epoch ns]
    is_internal    BOOLEAN NOT NULL              -- Infrastructure of ROS (parameter and lifecycle services)
);

-- One row per service client.
CREATE TABLE store.client (
    client_id     BIGINT PRIMARY KEY,            -- Identity of the client
    run_id        BIGINT NOT NULL,               -- Run that the row belongs to -> run.run_id
    process_id    BIGINT NOT NULL,               -- Process it lives in -> process.process_id
    node_id       BIGINT,                        -- Node it belongs to -> node.node_id
    service_name  VARCHAR,                       -- Fully expanded service name
    client_handle UBIGINT,                       -- rcl client handle; an address, valid in its process until reused
    rmw_handle    UBIGINT,                       -- rmw client handle; an address, valid in its process until reused
    gid           BLOB,                          -- Identifier that servers see, 16 bytes; NULL: none
    created_ns    BIGINT,                        -- rcl_client_init [epoch ns]
    is_internal   BOOLEAN NOT NULL               -- Infrastructure of ROS (parameter and lifecycle services)
);

-- One row per callback object.
CREATE TABLE store.callback (
    callback_id     BIGINT PRIMARY KEY,          -- Identity of the callback
    run_id          BIGINT NOT NULL,             -- Run that the row belongs to -> run.run_id
    process_id      BIGINT NOT NULL,             -- Process it lives in -> process.process_id
    node_id         BIGINT,                      -- Node it belongs to -> node.node_id
    kind            VARCHAR NOT NULL,            -- 'subscription', 'timer', 'service' or 'unknown'
    subscription_id BIGINT,                      -- Its subscription -> subscription.subscription_id
    timer_id        BIGINT,                      -- Its timer -> timer.timer_id
    service_id      BIGINT,                      -- Its service -> service.service_id
    callback_handle UBIGINT,                     -- Address of the callback object; an address, valid in its process until reused
    symbol          VARCHAR,                     -- Function registered for it; NULL: none or unresolvable
    created_ns      BIGINT                       -- First initialisation event [epoch ns]
);

-- One row per executor.
CREATE TABLE store.executor (
    executor_id BIGINT PRIMARY KEY,              -- Identity of the executor
    run_id      BIGINT NOT NULL,                 -- Run that the row belongs to -> run.run_id
    process_id  BIGINT NOT NULL,                 -- Process it lives in -> process.process_id
    kind        VARCHAR NOT NULL,                -- 'single_threaded', 'multi_threaded', 'unknown', or as CARET names it
    is_inferred BOOLEAN NOT NULL                 -- Deduced from the threads that run the same callbacks
);

-- One row per thread of an executor.
CREATE TABLE store.executor_thread (
    run_id      BIGINT NOT NULL,                 -- Run that the row belongs to -> run.run_id
    executor_id BIGINT NOT NULL,                 -- The executor -> executor.executor_id
    thread_id   BIGINT NOT NULL                  -- The thread -> thread.thread_id
);

-- One row per callback group of an executor, where the trace tells (CARET).
CREATE TABLE store.callback_group (
    callback_group_id BIGINT PRIMARY KEY,        -- Identity of the callback group
    run_id            BIGINT NOT NULL,           -- Run that the row belongs to -> run.run_id
    process_id        BIGINT NOT NULL,           -- Process it lives in -> process.process_id
    executor_id       BIGINT,                    -- Executor that it was added to -> executor.executor_id
    kind              VARCHAR NOT NULL           -- 'mutually_exclusive', 'reentrant' or 'unknown', as CARET names it
);

-- One row per callback in a callback group.
CREATE TABLE store.callback_group_member (
    run_id            BIGINT NOT NULL,           -- Run that the row belongs to -> run.run_id
    callback_group_id BIGINT NOT NULL,           -- The callback group -> callback_group.callback_group_id
    callback_id       BIGINT NOT NULL            -- The callback -> callback.callback_id
);

-- One row per declared indirect link.
CREATE TABLE store.annotation (
    annotation_id BIGINT PRIMARY KEY,            -- Identity of the annotation
    run_id        BIGINT NOT NULL,               -- Run that the row belongs to -> run.run_id
    kind          VARCHAR NOT NULL,              -- 'periodic_async' or 'partial_sync'
    source        VARCHAR NOT NULL,              -- 'trace' or 'file'
    process_id    BIGINT NOT NULL                -- Process it lives in -> process.process_id
);

-- One row per subscription of an annotation.
CREATE TABLE store.annotation_input (
    run_id          BIGINT NOT NULL,             -- Run that the row belongs to -> run.run_id
    annotation_id   BIGINT NOT NULL,             -- The annotation -> annotation.annotation_id
    subscription_id BIGINT NOT NULL              -- Its input -> subscription.subscription_id
);

-- One row per publisher of an annotation.
CREATE TABLE store.annotation_output (
    run_id        BIGINT NOT NULL,               -- Run that the row belongs to -> run.run_id
    annotation_id BIGINT NOT NULL,               -- The annotation -> annotation.annotation_id
    publisher_id  BIGINT NOT NULL                -- Its output -> publisher.publisher_id
);

-- One row per state change of a managed node.
CREATE TABLE store.lifecycle_transition (
    run_id      BIGINT NOT NULL,                 -- Run that the row belongs to -> run.run_id
    node_id     BIGINT,                          -- The node -> node.node_id
    at_ns       BIGINT NOT NULL,                 -- Moment of the change [epoch ns]
    start_state VARCHAR,                         -- State that was left
    goal_state  VARCHAR                          -- State that was entered
);

-- One row per thing worth knowing about the input.
CREATE TABLE store.diagnostic (
    run_id   BIGINT NOT NULL,                    -- Run that the row belongs to -> run.run_id
    trace_id BIGINT,                             -- Trace it was recorded in -> trace.trace_id
    name     VARCHAR NOT NULL,                   -- What was found; a closed vocabulary
    severity VARCHAR NOT NULL,                   -- 'info', 'warning', 'data_loss' or 'error'
    count    BIGINT,                             -- How often
    detail   VARCHAR                             -- Where, and what it means
);

-- One row per publish() call.
CREATE TABLE store.publication (
    publication_id      BIGINT NOT NULL,         -- Identity of the publication
    run_id              BIGINT NOT NULL,         -- Run that the row belongs to -> run.run_id
    trace_id            BIGINT NOT NULL,         -- Trace it was recorded in -> trace.trace_id
    publisher_id        BIGINT,                  -- Publisher; NULL: the middleware itself -> publisher.publisher_id
    process_id          BIGINT NOT NULL,         -- Process it lives in -> process.process_id
    thread_id           BIGINT NOT NULL,         -- Thread it happened on -> thread.thread_id
    start_ns            BIGINT NOT NULL,         -- First layer seen [epoch ns]
    end_ns              BIGINT NOT NULL,         -- Last layer seen [epoch ns]
    intra_ns            BIGINT,                  -- rclcpp_intra_publish [epoch ns]
    rclcpp_ns           BIGINT,                  -- rclcpp_publish [epoch ns]
    rcl_ns              BIGINT,                  -- rcl_publish [epoch ns]
    rmw_ns              BIGINT,                  -- rmw_publish [epoch ns]
    dds_ns              BIGINT,                  -- dds:write [epoch ns]
    source_timestamp_ns BIGINT,                  -- Stamp that the middleware sent along, clock of ROS [epoch ns]
    start_event_id      BIGINT,                  -- First layer seen [event order]
    end_event_id        BIGINT,                  -- Last layer seen [event order]
    callback_event_id   BIGINT,                  -- Last begin or end of a callback before it; NULL: none [event order]
    is_loss_affected    BOOLEAN,                 -- A gap right before or after it on its thread may hide a layer; NULL: not known
    next_event_ns       BIGINT                   -- Next event of the thread, where it has no stamp; NULL: none, or a gap may hide it [epoch ns]
);

-- One row per message handed over to a subscription.
CREATE TABLE store.take (
    take_id             BIGINT NOT NULL,         -- Identity of the take
    run_id              BIGINT NOT NULL,         -- Run that the row belongs to -> run.run_id
    trace_id            BIGINT NOT NULL,         -- Trace it was recorded in -> trace.trace_id
    subscription_id     BIGINT,                  -- Subscription -> subscription.subscription_id
    process_id          BIGINT NOT NULL,         -- Process it lives in -> process.process_id
    thread_id           BIGINT NOT NULL,         -- Thread it happened on -> thread.thread_id
    taken_ns            BIGINT NOT NULL,         -- Moment of the hand-over [epoch ns]
    source_timestamp_ns BIGINT,                  -- Stamp that came with the message, clock of ROS [epoch ns]
    method              VARCHAR NOT NULL,        -- 'rmw', 'ring_buffer', 'caret' or 'callback_only'
    start_event_id      BIGINT,                  -- First layer seen [event order]
    end_event_id        BIGINT,                  -- Last layer seen [event order]
    is_loss_affected    BOOLEAN                  -- A gap right before or after it on its thread may hide a layer or its callback; NULL: not known
);

-- One row per attempt to take from a subscription that took nothing.
CREATE TABLE store.failed_take (
    run_id          BIGINT NOT NULL,             -- Run that the row belongs to -> run.run_id
    trace_id        BIGINT NOT NULL,             -- Trace it was recorded in -> trace.trace_id
    subscription_id BIGINT,                      -- Subscription -> subscription.subscription_id
    process_id      BIGINT NOT NULL,             -- Process it lives in -> process.process_id
    thread_id       BIGINT NOT NULL,             -- Thread it happened on -> thread.thread_id
    failed_ns       BIGINT NOT NULL              -- Moment of the attempt [epoch ns]
);

-- One row per enqueue, dequeue or clearing of an intra-process ring buffer.
CREATE TABLE store.ring_buffer_event (
    run_id         BIGINT NOT NULL,              -- Run that the row belongs to -> run.run_id
    trace_id       BIGINT NOT NULL,              -- Trace it was recorded in -> trace.trace_id
    process_id     BIGINT NOT NULL,              -- Process it lives in -> process.process_id
    kind           VARCHAR NOT NULL,             -- 'enqueue', 'dequeue' or 'clear'
    buffer_handle  UBIGINT,                      -- Address of the ring buffer; an address, valid in its process until reused
    slot           BIGINT,                       -- Index in the buffer; NULL: all
    at_ns          BIGINT NOT NULL,              -- Moment of the event [epoch ns]
    publication_id BIGINT,                       -- Message put in; NULL: the replay of one kept for late subscriptions -> publication.publication_id
    take_id        BIGINT,                       -- Message taken out -> take.take_id
    is_overwriting BOOLEAN NOT NULL,             -- An older message was lost from the slot
    event_id       BIGINT                        -- The event [event order]
);

-- One row per callback instance.
CREATE TABLE store.callback_instance (
    callback_instance_id   BIGINT NOT NULL,      -- Identity of the callback instance
    run_id                 BIGINT NOT NULL,      -- Run that the row belongs to -> run.run_id
    trace_id               BIGINT NOT NULL,      -- Trace it was recorded in -> trace.trace_id
    callback_id            BIGINT NOT NULL,      -- Callback that ran -> callback.callback_id
    process_id             BIGINT NOT NULL,      -- Process it lives in -> process.process_id
    thread_id              BIGINT NOT NULL,      -- Thread it happened on -> thread.thread_id
    start_ns               BIGINT NOT NULL,      -- callback_start [epoch ns]
    end_ns                 BIGINT,               -- callback_end; NULL: never seen to end [epoch ns]
    take_id                BIGINT,               -- Message it was called with -> take.take_id
    request_id             BIGINT,               -- Request it was called with -> request.request_id
    is_intra_process       BOOLEAN NOT NULL,     -- Called with an intra-process message
    parent_id              BIGINT,               -- Run it is nested in -> callback_instance.callback_instance_id
    depth                  INTEGER NOT NULL,     -- Nesting depth on its thread, from 1
    start_event_id         BIGINT,               -- callback_start [event order]
    end_event_id           BIGINT,               -- callback_end; NULL: never seen to end [event order]
    effective_end_event_id BIGINT,               -- callback_end, else the first event that cannot be inside [event order]
    is_loss_affected       BOOLEAN               -- A gap inside or beside it on its thread may hide its end or what it did; NULL: not known
);

-- One row per service request.
CREATE TABLE store.request (
    request_id           BIGINT NOT NULL,        -- Identity of the request
    run_id               BIGINT NOT NULL,        -- Run that the row belongs to -> run.run_id
    client_id            BIGINT,                 -- Client that sent it -> client.client_id
    service_id           BIGINT,                 -- Service that took it -> service.service_id
    sequence_number      BIGINT,                 -- Number given by the client
    sent_ns              BIGINT,                 -- rmw_send_request [epoch ns]
    taken_ns             BIGINT,                 -- rmw_take_request [epoch ns]
    sender_thread_id     BIGINT,                 -- Thread that sent it -> thread.thread_id
    receiver_thread_id   BIGINT,                 -- Thread that took it -> thread.thread_id
    callback_instance_id BIGINT                  -- Service callback it led to -> callback_instance.callback_instance_id
);

-- One row per service response.
CREATE TABLE store.response (
    response_id          BIGINT NOT NULL,        -- Identity of the response
    run_id               BIGINT NOT NULL,        -- Run that the row belongs to -> run.run_id
    client_id            BIGINT,                 -- Client that took it -> client.client_id
    service_id           BIGINT,                 -- Service that sent it -> service.service_id
    sequence_number      BIGINT,                 -- Number given by the client
    sent_ns              BIGINT,                 -- rmw_send_response [epoch ns]
    taken_ns             BIGINT,                 -- rmw_take_response [epoch ns]
    sender_thread_id     BIGINT,                 -- Thread that sent it -> thread.thread_id
    receiver_thread_id   BIGINT,                 -- Thread that took it -> thread.thread_id
    callback_instance_id BIGINT,                 -- Service callback it came from -> callback_instance.callback_instance_id
    request_id           BIGINT                  -- Request that it answers -> request.request_id
);

-- One row per interval between two executor events of a thread.
CREATE TABLE store.executor_state (
    run_id               BIGINT NOT NULL,        -- Run that the row belongs to -> run.run_id
    executor_id          BIGINT,                 -- Executor -> executor.executor_id
    thread_id            BIGINT NOT NULL,        -- Thread it happened on -> thread.thread_id
    state                VARCHAR NOT NULL,       -- 'wait', 'process' or 'execute'
    start_ns             BIGINT NOT NULL,        -- Executor event that began it [epoch ns]
    end_ns               BIGINT,                 -- Next executor event; NULL: not known (the last, or a gap) [epoch ns]
    callback_instance_id BIGINT,                 -- First callback instance in it -> callback_instance.callback_instance_id
    start_event_id       BIGINT                  -- Executor event that began it [event order]
);

-- One row per gap in the record of a thread.
CREATE TABLE store.thread_break (
    run_id           BIGINT NOT NULL,            -- Run that the row belongs to -> run.run_id
    thread_id        BIGINT NOT NULL,            -- Thread whose events may be missing -> thread.thread_id
    resumed_ns       BIGINT NOT NULL,            -- First event of the thread behind the gap [epoch ns]
    resumed_event_id BIGINT,                     -- First event of the thread behind the gap [event order]
    is_elsewhere     BOOLEAN                     -- Only other CPUs lost events, which it may have visited; NULL: no
);

-- One row per stretch of time in which stamps run along a clock of the traces.
CREATE TABLE store.stamp_clock (
    run_id        BIGINT NOT NULL,               -- Run that the row belongs to -> run.run_id
    clock_id      BIGINT NOT NULL,               -- Clock of the traces -> clock.clock_id
    at_ns         BIGINT NOT NULL,               -- Middle of the stretch, time of the traces [epoch ns]
    start_ns      BIGINT NOT NULL,               -- Begin of the stretch [epoch ns]
    end_ns        BIGINT NOT NULL,               -- End of the stretch, exclusive [epoch ns]
    difference_ns BIGINT NOT NULL,               -- Clock of ROS less clock of the traces, with the shortest delay of a stamp [ns]
    drift_ppb     BIGINT,                        -- Change of the difference in the stretch [ppb]
    message_count BIGINT,                        -- Messages that agree with it
    segment       BIGINT,                        -- Number of jumps of the clock before it
    is_sharp      BOOLEAN                        -- The drift is known: publications microseconds apart are told apart; NULL: yes
);

-- One row per message whose publication was found, or could not be told, by time.
CREATE TABLE store.nearest_message (
    run_id              BIGINT NOT NULL,         -- Run that the row belongs to -> run.run_id
    topic_name          VARCHAR NOT NULL,        -- Topic of the message
    source_timestamp_ns BIGINT NOT NULL,         -- Stamp of the message, clock of ROS [epoch ns]
    publication_id      BIGINT,                  -- Where it came from; NULL: several could be it -> publication.publication_id
    candidate_count     BIGINT                   -- Publications that it could have been
);

-- One row per take whose publication is known.
CREATE TABLE store.link_transport (
    run_id           BIGINT NOT NULL,            -- Run that the row belongs to -> run.run_id
    publication_id   BIGINT NOT NULL,            -- Where the message came from -> publication.publication_id
    take_id          BIGINT NOT NULL,            -- Where it was received -> take.take_id
    publisher_id     BIGINT,                     -- Publisher of the message -> publisher.publisher_id
    subscription_id  BIGINT,                     -- Subscription that received it -> subscription.subscription_id
    method           VARCHAR NOT NULL,           -- 'exact', 'exact_stamp', 'nearest' or 'ring_buffer'
    candidate_count  BIGINT,                     -- Publications that it could have been
    is_self_loop     BOOLEAN NOT NULL,           -- Received by the publishing node itself
    is_loss_affected BOOLEAN NOT NULL,           -- A gap of the trace may hide a better partner
    is_copy          BOOLEAN                     -- Of what a ring buffer carries as well: no callback gets it; NULL: no
);

-- One row per network packet and clock that received it from another.
CREATE TABLE store.link_packet (
    run_id              BIGINT NOT NULL,         -- Run that the row belongs to -> run.run_id
    sent_trace_id       BIGINT NOT NULL,         -- Trace of its sender -> trace.trace_id
    received_trace_id   BIGINT NOT NULL,         -- Trace of its receiver -> trace.trace_id
    sent_ns             BIGINT NOT NULL,         -- Handed to the network device [epoch ns]
    received_ns         BIGINT NOT NULL,         -- Came from the network device [epoch ns]
    protocol            VARCHAR NOT NULL,        -- 'tcp' or 'udp'
    source_address      VARCHAR NOT NULL,        -- IP address that it was sent from
    source_port         INTEGER NOT NULL,        -- Port that it was sent from
    destination_address VARCHAR NOT NULL,        -- IP address that it was sent to
    destination_port    INTEGER NOT NULL,        -- Port that it was sent to
    identification      INTEGER,                 -- Identification of the datagram; NULL: IPv6 has none
    sequence_number     BIGINT                   -- Sequence number of its first byte; NULL: not TCP
);

-- One row per callback instance, or take outside of any, that led to a publication.
CREATE TABLE store.link_causal (
    run_id               BIGINT NOT NULL,        -- Run that the row belongs to -> run.run_id
    callback_instance_id BIGINT,                 -- Cause; NULL: the take itself -> callback_instance.callback_instance_id
    publication_id       BIGINT NOT NULL,        -- Effect -> publication.publication_id
    take_id              BIGINT,                 -- Message that led to it -> take.take_id
    subscription_id      BIGINT,                 -- Subscription of that message -> subscription.subscription_id
    publisher_id         BIGINT,                 -- Publisher of the effect -> publisher.publisher_id
    kind                 VARCHAR NOT NULL,       -- 'direct', 'periodic_async', 'partial_sync' or 'take_adjacent'
    annotation_id        BIGINT,                 -- Annotation that declares it -> annotation.annotation_id
    candidate_count      BIGINT,                 -- Callback instances that it could have been
    is_loss_affected     BOOLEAN NOT NULL        -- A gap of the trace may hide a better partner
);

-- One row per request that a callback instance or thread sent.
CREATE TABLE store.link_request (
    run_id               BIGINT NOT NULL,        -- Run that the row belongs to -> run.run_id
    request_id           BIGINT NOT NULL,        -- Effect -> request.request_id
    callback_instance_id BIGINT                  -- Cause -> callback_instance.callback_instance_id
);

-- One row per response and the callback instance that sent it.
CREATE TABLE store.link_response (
    run_id               BIGINT NOT NULL,        -- Run that the row belongs to -> run.run_id
    response_id          BIGINT NOT NULL,        -- Effect -> response.response_id
    callback_instance_id BIGINT                  -- Cause -> callback_instance.callback_instance_id
);

-- One row per publication and subscription of its topic that is not known to have taken it.
CREATE TABLE store.undelivered (
    run_id          BIGINT NOT NULL,             -- Run that the row belongs to -> run.run_id
    publication_id  BIGINT NOT NULL,             -- The message -> publication.publication_id
    publisher_id    BIGINT NOT NULL,             -- Its publisher -> publisher.publisher_id
    subscription_id BIGINT NOT NULL,             -- Who did not take it -> subscription.subscription_id
    reason          VARCHAR NOT NULL             -- Why; a closed vocabulary
);

-- One row per take whose publication is not known.
CREATE TABLE store.orphan_take (
    run_id          BIGINT NOT NULL,             -- Run that the row belongs to -> run.run_id
    take_id         BIGINT NOT NULL,             -- The take -> take.take_id
    subscription_id BIGINT,                      -- Subscription that received it -> subscription.subscription_id
    reason          VARCHAR NOT NULL             -- Why; a closed vocabulary
);
