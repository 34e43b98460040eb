-- Tables of the schema `store`: where the rows of runs are.
-- Their one definition, from which databases, public views and `msgflow.schema` are made.
--
-- Above a table stands what one row is, and, if its public view shows it as it is, what that has.
-- Behind a column stand its meaning, [its unit], and marks:
--
-- - {to TABLE}: it refers to rows of that table, by their key. The database does not enforce this:
--   DuckDB's foreign keys would forbid replacing a run in one transaction.
-- - {clock COLUMN}: the view shows this moment on the common time axis; that column leads to the
--   clock that showed it.
-- - {hidden}: the view does not show it.
-- - {sql EXPRESSION}: only the view has it; `self` is the row.

CREATE SCHEMA IF NOT EXISTS store;

-- One row per publish() call
-- view: Messages at the moment they were published, with the time of each layer seen.
CREATE TABLE store.publication (
    publication_id BIGINT NOT NULL,  -- Identity of the publication
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    trace_id BIGINT NOT NULL,  -- Trace it was recorded in {to trace}
    publisher_id BIGINT,  -- Publisher; NULL: the middleware itself {to publisher}
    process_id BIGINT NOT NULL,  -- Process it lives in {to process}
    thread_id BIGINT NOT NULL,  -- Thread it happened on {to thread}
    start_ns BIGINT NOT NULL,  -- First layer seen [epoch ns] {clock process_id}
    end_ns BIGINT NOT NULL,  -- Last layer seen [epoch ns] {clock process_id}
    intra_ns BIGINT,  -- rclcpp_intra_publish [epoch ns] {clock process_id}
    rclcpp_ns BIGINT,  -- rclcpp_publish, or agnocast_publish [epoch ns] {clock process_id}
    rcl_ns BIGINT,  -- rcl_publish [epoch ns] {clock process_id}
    rmw_ns BIGINT,  -- rmw_publish [epoch ns] {clock process_id}
    dds_ns BIGINT,  -- dds:write [epoch ns] {clock process_id}
    source_timestamp_ns BIGINT,  -- Stamp that the middleware gave to the message, clock of ROS
        -- [epoch ns]
    start_event_id BIGINT,  -- First layer seen [event order] {hidden}
    end_event_id BIGINT,  -- Last layer seen [event order] {hidden}
    callback_event_id BIGINT,  -- Last begin or end of a callback before it; NULL: none [event
        -- order] {hidden}
    is_loss_affected BOOLEAN DEFAULT false NOT NULL,  -- A gap right before or after it on its
        -- thread may hide a layer
    next_event_ns BIGINT  -- Next event of the thread, where it has no stamp; NULL: none, or a gap
        -- may hide it [epoch ns] {hidden}
);

-- One row per message handed over to a subscription
-- view: Messages at the moment they were handed over to a subscription.
CREATE TABLE store.take (
    take_id BIGINT NOT NULL,  -- Identity of the take
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    trace_id BIGINT NOT NULL,  -- Trace it was recorded in {to trace}
    subscription_id BIGINT,  -- Subscription {to subscription}
    process_id BIGINT NOT NULL,  -- Process it lives in {to process}
    thread_id BIGINT NOT NULL,  -- Thread it happened on {to thread}
    taken_ns BIGINT NOT NULL,  -- Moment of the hand-over [epoch ns] {clock process_id}
    source_timestamp_ns BIGINT,  -- Stamp that came with the message, clock of ROS [epoch ns]
    method VARCHAR NOT NULL,  -- 'rmw', 'ring_buffer', 'agnocast', 'caret' or 'callback_only'
    start_event_id BIGINT,  -- First layer seen [event order] {hidden}
    end_event_id BIGINT,  -- Last layer seen [event order] {hidden}
    is_loss_affected BOOLEAN DEFAULT false NOT NULL  -- A gap right before or after it on its thread
        -- may hide a layer or its callback
);

-- One row per attempt that took nothing
-- view: Attempts to take from a subscription that got nothing.
CREATE TABLE store.failed_take (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    trace_id BIGINT NOT NULL,  -- Trace it was recorded in {to trace}
    subscription_id BIGINT,  -- Subscription {to subscription}
    process_id BIGINT NOT NULL,  -- Process it lives in {to process}
    thread_id BIGINT NOT NULL,  -- Thread it happened on {to thread}
    failed_ns BIGINT NOT NULL  -- Moment of the attempt [epoch ns] {clock process_id}
);

-- One row per enqueue, dequeue or clearing of an intra-process ring buffer
CREATE TABLE store.ring_buffer_event (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    trace_id BIGINT NOT NULL,  -- Trace it was recorded in {to trace}
    process_id BIGINT NOT NULL,  -- Process it lives in {to process}
    kind VARCHAR NOT NULL,  -- 'enqueue', 'dequeue' or 'clear'
    buffer_handle UBIGINT,  -- Address of the ring buffer; an address, valid in its process until
        -- reused
    slot BIGINT,  -- Index in the buffer; NULL: all
    at_ns BIGINT NOT NULL,  -- Moment of the event [epoch ns]
    publication_id BIGINT,  -- Message put in; NULL: the replay of one kept for late subscriptions
        -- {to publication}
    take_id BIGINT,  -- Message taken out {to take}
    is_overwriting BOOLEAN DEFAULT false NOT NULL,  -- An older message was lost from the slot
    event_id BIGINT  -- The event [event order] {hidden}
);

-- One row per take of a message whose arrival something else than its thread told
-- view: When messages were there before they were taken, as CARET's hook in Fast DDS says. In
-- events executors also: those that their own thread published, and those for which, as a kernel
-- trace shows, the publishing thread woke one of the middleware.
CREATE TABLE store.data_arrival (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    take_id BIGINT NOT NULL,  -- Take of the message {to take}
    waited_ns BIGINT NOT NULL,  -- From there until the take [ns]
    is_ambiguous BOOLEAN DEFAULT false NOT NULL  -- Several readers of the process had a message of
        -- that stamp
);

-- One row per publication or take of Agnocast
-- view: Numbers that Agnocast gave to messages.
CREATE TABLE store.agnocast_entry (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    publication_id BIGINT,  -- Message put in; NULL: of a take {to publication}
    take_id BIGINT,  -- Message handed over; NULL: of a publication {to take}
    entry_id BIGINT NOT NULL  -- Number of the message on its topic and kernel
);

-- One row per service request
-- view: Service requests.
CREATE TABLE store.request (
    request_id BIGINT NOT NULL,  -- Identity of the request
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    client_id BIGINT,  -- Client that sent it {to client}
    service_id BIGINT,  -- Service that took it {to service}
    sequence_number BIGINT,  -- Number given by the client
    sent_ns BIGINT,  -- rmw_send_request [epoch ns] {clock sender_thread_id}
    taken_ns BIGINT,  -- rmw_take_request [epoch ns] {clock receiver_thread_id}
    sender_thread_id BIGINT,  -- Thread that sent it {to thread}
    receiver_thread_id BIGINT,  -- Thread that took it {to thread}
    callback_instance_id BIGINT  -- Service callback it led to {to callback_instance}
);

-- One row per service response
-- view: Service responses.
CREATE TABLE store.response (
    response_id BIGINT NOT NULL,  -- Identity of the response
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    client_id BIGINT,  -- Client that took it {to client}
    service_id BIGINT,  -- Service that sent it {to service}
    sequence_number BIGINT,  -- Number given by the client
    sent_ns BIGINT,  -- rmw_send_response [epoch ns] {clock sender_thread_id}
    taken_ns BIGINT,  -- rmw_take_response [epoch ns] {clock receiver_thread_id}
    sender_thread_id BIGINT,  -- Thread that sent it {to thread}
    receiver_thread_id BIGINT,  -- Thread that took it {to thread}
    callback_instance_id BIGINT,  -- Service callback it came from {to callback_instance}
    request_id BIGINT  -- Request that it answers {to request}
);

-- One row per message of a bag whose publication is known (msgflow bag)
-- view: Messages of a bag that was recorded in the same run: size, stamp and frame.
CREATE TABLE store.bag_message (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    publication_id BIGINT NOT NULL,  -- The publication that it is the message of {to publication}
    topic_name VARCHAR NOT NULL,  -- Name of the topic
    type_name VARCHAR NOT NULL,  -- Type of the message, such as sensor_msgs/msg/Image
    received_ns BIGINT NOT NULL,  -- When the recorder of the bag received it, clock of ROS [epoch
        -- ns]
    size_bytes BIGINT NOT NULL,  -- Size as it was sent (CDR) [bytes]
    stamp_ns BIGINT,  -- header.stamp, clock of ROS; NULL: its type has no header [epoch ns]
    frame_id VARCHAR  -- header.frame_id; NULL: its type has no header
);

-- One row per event whose name a pattern of msgflow ingest --events matches
-- view: Events of the user's own tracepoints.
CREATE TABLE store.user_event (
    user_event_id BIGINT NOT NULL,  -- Identity of the event
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    trace_id BIGINT NOT NULL,  -- Trace it was recorded in {to trace}
    process_id BIGINT NOT NULL,  -- Process it lives in {to process}
    thread_id BIGINT NOT NULL,  -- Thread it happened on {to thread}
    cpu INTEGER,  -- CPU that it happened on
    at_ns BIGINT NOT NULL,  -- When it happened [epoch ns] {clock process_id}
    name VARCHAR NOT NULL,  -- Provider and event, such as my_pkg:frame_done
    callback_instance_id BIGINT,  -- Innermost callback instance inside which it happened, on its
        -- thread; NULL: none {to callback_instance}
    fields VARCHAR NOT NULL,  -- Its fields, a JSON object: fields->>'$.name' is one of them
    is_loss_affected BOOLEAN DEFAULT false NOT NULL  -- A gap may hide that the callback instance
        -- was over
);

-- One row per callback object
-- view: Callback objects and what they belong to.
CREATE TABLE store.callback (
    callback_id BIGINT PRIMARY KEY,  -- Identity of the callback
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    process_id BIGINT NOT NULL,  -- Process it lives in {to process}
    node_id BIGINT,  -- Node it belongs to {to node}
    kind VARCHAR NOT NULL,  -- 'subscription', 'timer', 'service', 'action' (of Python: it executes
        -- goals), 'function' (of Python: a task, or of a client) or 'unknown'
    subscription_id BIGINT,  -- Its subscription {to subscription}
    timer_id BIGINT,  -- Its timer {to timer}
    service_id BIGINT,  -- Its service {to service}
    callback_handle UBIGINT,  -- Address of the callback object; an address, valid in its process
        -- until reused
    symbol VARCHAR,  -- Function registered for it; NULL: none or unresolvable
    source VARCHAR,  -- File and line at which the function begins, in Python; NULL: not known
    created_ns BIGINT  -- First initialisation event [epoch ns] {clock process_id}
);

-- One row per callback group of an executor
-- view: Callback groups, where the trace has them (CARET). Callbacks of a mutually exclusive group
-- never run at the same time.
CREATE TABLE store.callback_group (
    callback_group_id BIGINT PRIMARY KEY,  -- Identity of the callback group
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    process_id BIGINT NOT NULL,  -- Process it lives in {to process}
    executor_id BIGINT,  -- Executor that it was added to {to executor}
    kind VARCHAR NOT NULL  -- 'mutually_exclusive', 'reentrant' or 'unknown', as CARET names it
);

-- One row per callback in a callback group
-- view: Callbacks of the callback groups.
CREATE TABLE store.callback_group_member (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    callback_group_id BIGINT NOT NULL,  -- The callback group {to callback_group}
    callback_id BIGINT NOT NULL  -- The callback {to callback}
);

-- One row per callback instance
-- view: Callback instances.
CREATE TABLE store.callback_instance (
    callback_instance_id BIGINT NOT NULL,  -- Identity of the callback instance
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    trace_id BIGINT NOT NULL,  -- Trace it was recorded in {to trace}
    callback_id BIGINT NOT NULL,  -- Callback that ran {to callback}
    process_id BIGINT NOT NULL,  -- Process it lives in {to process}
    thread_id BIGINT NOT NULL,  -- Thread it happened on {to thread}
    start_ns BIGINT NOT NULL,  -- callback_start [epoch ns] {clock process_id}
    end_ns BIGINT,  -- callback_end, else what is_end_inferred says; NULL: never seen to end [epoch
        -- ns] {clock process_id}
    take_id BIGINT,  -- Message it was called with {to take}
    request_id BIGINT,  -- Request it was called with {to request}
    response_id BIGINT,  -- Response that it follows from, in Python {to response}
    continues_id BIGINT,  -- Callback instance that it is a later step of, in Python; NULL: it is
        -- the first {to callback_instance}
    step_event_id BIGINT,  -- Where the tracer of Python told that it would go on: what a job starts
        -- has that of the job; NULL: it is no later step [event order] {hidden}
    is_intra_process BOOLEAN DEFAULT false NOT NULL,  -- Called with an intra-process message
    parent_id BIGINT,  -- Callback instance that it is nested in {to callback_instance}
    depth INTEGER NOT NULL,  -- Nesting depth on its thread, from 1
    start_event_id BIGINT,  -- callback_start [event order] {hidden}
    end_event_id BIGINT,  -- callback_end; NULL: never seen to end [event order] {hidden}
    effective_end_event_id BIGINT,  -- callback_end, else the first event that cannot be inside
        -- [event order] {hidden}
    is_loss_affected BOOLEAN DEFAULT false NOT NULL,  -- A gap inside or beside it on its thread may
        -- hide its end or what it did
    cpu_ns BIGINT,  -- CPU time that its thread used meanwhile; NULL: not known [ns]
    cpu_source VARCHAR  -- What says so: 'kernel', its scheduler, or 'clock', that of the thread
    -- is_end_inferred BOOLEAN  -- No callback_end: a service callback that answers later (before
        -- Kilted), which was over at the next executor event of its thread at the latest {sql
        -- self.end_ns IS NOT NULL AND self.end_event_id IS NULL}
);

-- One row per executor
-- view: Executors.
CREATE TABLE store.executor (
    executor_id BIGINT PRIMARY KEY,  -- Identity of the executor
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    process_id BIGINT NOT NULL,  -- Process it lives in {to process}
    kind VARCHAR NOT NULL,  -- 'single_threaded', 'multi_threaded', 'events' (without events of its
        -- own, but seen to serve what came first first), 'unknown', or as CARET names it
    is_inferred BOOLEAN DEFAULT false NOT NULL  -- Deduced from the threads that run the same
        -- callbacks
);

-- One row per thread of an executor
-- view: Threads of the executors.
CREATE TABLE store.executor_thread (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    executor_id BIGINT NOT NULL,  -- The executor {to executor}
    thread_id BIGINT NOT NULL  -- The thread {to thread}
);

-- One row per executor event of a thread: a state lasts until the next one
CREATE TABLE store.executor_state (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    thread_id BIGINT NOT NULL,  -- The thread {to thread}
    state VARCHAR NOT NULL,  -- 'wait', 'process' or 'execute'
    start_ns BIGINT NOT NULL,  -- Executor event that began it [epoch ns] {clock thread_id}
    is_behind_gap BOOLEAN DEFAULT false NOT NULL,  -- A gap may hide an executor event between the
        -- one before and this one
    callback_instance_id BIGINT,  -- First callback instance in it {to callback_instance}
    start_event_id BIGINT  -- Executor event that began it [event order] {hidden}
);

-- One row per machine or container
-- view: Machines and containers.
CREATE TABLE store.host (
    host_id BIGINT PRIMARY KEY,  -- Identity of the host
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    clock_id BIGINT NOT NULL,  -- Clock of the host {to clock}
    hostname VARCHAR NOT NULL  -- Name recorded in the trace, or given by the user
);

-- One row per process life
-- view: Process lives: a pid that is used again is another process.
CREATE TABLE store.process (
    process_id BIGINT PRIMARY KEY,  -- Identity of the process life
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    host_id BIGINT NOT NULL,  -- Host it ran on {to host}
    pid INTEGER NOT NULL,  -- Process id; the one inside its PID namespace if the trace has no other
    name VARCHAR,  -- Name of the process (its first thread)
    tracetools_version VARCHAR,  -- Version that rcl_init reported; for display only
    python_version VARCHAR,  -- Version of Python, where callbacks of its nodes are traced (msgflow
        -- record)
    first_seen_ns BIGINT,  -- First event [epoch ns] {clock process_id}
    last_seen_ns BIGINT,  -- Last event [epoch ns] {clock process_id}
    pid_namespace BIGINT,  -- PID namespace, where the trace has it; a negative number if msgflow
        -- gave it, since processes have equal ids
    life INTEGER NOT NULL,  -- Number of this life among those of the pid, from 1
    is_ambiguous BOOLEAN  -- Several processes with equal ids are one here: nothing tells them apart
);

-- One row per thread
-- view: Threads, each with its last name.
CREATE TABLE store.thread (
    thread_id BIGINT PRIMARY KEY,  -- Identity of the thread
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    process_id BIGINT NOT NULL,  -- Process it lives in {to process}
    tid INTEGER NOT NULL,  -- Thread id; the one inside its PID namespace if the trace has no other
    name VARCHAR,  -- Name of the thread
    first_event_id BIGINT,  -- First event [event order] {hidden}
    last_event_id BIGINT,  -- Last event [event order] {hidden}
    first_seen_ns BIGINT,  -- First event [epoch ns] {clock process_id}
    last_seen_ns BIGINT  -- Last event [epoch ns] {clock process_id}
);

-- One row per ROS node
-- view: ROS nodes.
CREATE TABLE store.node (
    node_id BIGINT PRIMARY KEY,  -- Identity of the node
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    process_id BIGINT NOT NULL,  -- Process it lives in {to process}
    name VARCHAR,  -- Name without namespace
    namespace VARCHAR,  -- Namespace, beginning with /
    full_name VARCHAR,  -- Namespace and name; behind @ the host or process, where nodes of several
        -- processes have that name at a time
    node_handle UBIGINT,  -- rcl node handle; an address, valid in its process until reused
    created_ns BIGINT,  -- rcl_node_init [epoch ns] {clock process_id}
    is_inferred BOOLEAN DEFAULT false NOT NULL  -- Its initialisation was not traced
);

-- One row per state change of a managed node
-- view: State changes of managed nodes.
CREATE TABLE store.lifecycle_transition (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    node_id BIGINT,  -- The node {to node}
    at_ns BIGINT NOT NULL,  -- Moment of the change [epoch ns] {clock node_id}
    start_state VARCHAR,  -- State that was left
    goal_state VARCHAR  -- State that was entered
);

-- One row per moment at which the time of a simulation is known
-- view: What time it was in the simulation, as CARET's clock recorder tells about once a second.
-- Between two moments it runs evenly: query --times sim writes times in it.
CREATE TABLE store.simulated_time (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    process_id BIGINT NOT NULL,  -- Process it lives in {to process}
    at_ns BIGINT NOT NULL,  -- When it was recorded [epoch ns] {clock process_id}
    simulated_ns BIGINT NOT NULL  -- Time of the simulation [ns]
);

-- One row per gap in the record of a thread
-- view: Where the record of a thread breaks: events of the thread may be missing before these
-- moments. No executor state reaches across a break, and pairs of events that do are marked.
CREATE TABLE store.thread_break (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    thread_id BIGINT NOT NULL,  -- Thread whose events may be missing {to thread}
    resumed_ns BIGINT NOT NULL,  -- First event of the thread behind the gap [epoch ns] {clock
        -- thread_id}
    resumed_event_id BIGINT,  -- First event of the thread behind the gap [event order] {hidden}
    is_elsewhere BOOLEAN DEFAULT false NOT NULL  -- Events were lost only on other CPUs, which the
        -- thread may have visited meanwhile: pairs may reach across
);

-- One row per declared link
-- view: Declared links: indirect ones, and whether publications answer messages.
CREATE TABLE store.annotation (
    annotation_id BIGINT PRIMARY KEY,  -- Identity of the annotation
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    kind VARCHAR NOT NULL,  -- 'periodic_async', 'partial_sync', 'approximate_sync', 'queue',
        -- 'direct' or 'independent'
    source VARCHAR NOT NULL,  -- 'trace' or 'file'
    process_id BIGINT NOT NULL,  -- Process it lives in {to process}
    queue_depth BIGINT  -- Of a queue: most messages that wait in it; NULL: not limited
);

-- One row per subscription of an annotation
-- view: Subscriptions of the declared indirect links.
CREATE TABLE store.annotation_input (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    annotation_id BIGINT NOT NULL,  -- The annotation {to annotation}
    subscription_id BIGINT NOT NULL  -- Its input {to subscription}
);

-- One row per publisher of an annotation
-- view: Publishers of the declared indirect links.
CREATE TABLE store.annotation_output (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    annotation_id BIGINT NOT NULL,  -- The annotation {to annotation}
    publisher_id BIGINT NOT NULL  -- Its output {to publisher}
);

-- One row per message that one publication or several fit by time
CREATE TABLE store.nearest_message (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    topic_name VARCHAR NOT NULL,  -- Topic of the message
    source_timestamp_ns BIGINT NOT NULL,  -- Stamp of the message, clock of ROS [epoch ns]
    publication_id BIGINT,  -- Where it came from; NULL: several could be it {to publication}
    candidate_count BIGINT  -- Publications that it could have been; NULL: the clock was set about
        -- then
);

-- One row per take whose publication is known
CREATE TABLE store.link_transport (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    publication_id BIGINT NOT NULL,  -- Where the message came from {to publication}
    take_id BIGINT NOT NULL,  -- Where it was received {to take}
    publisher_id BIGINT,  -- Publisher of the message {to publisher}
    subscription_id BIGINT,  -- Subscription that received it {to subscription}
    method VARCHAR NOT NULL,  -- 'exact', 'exact_stamp', 'nearest', 'ring_buffer' or 'agnocast'
    candidate_count BIGINT,  -- Number of publications that are possible
    is_self_loop BOOLEAN DEFAULT false NOT NULL,  -- Received by the publishing node itself
    is_loss_affected BOOLEAN DEFAULT false NOT NULL,  -- A gap of the trace may hide a better
        -- partner
    is_copy BOOLEAN DEFAULT false NOT NULL  -- A ring buffer carries the same message: no callback
        -- gets this one
);

-- One row per network packet and clock that received it from another
CREATE TABLE store.link_packet (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    sent_trace_id BIGINT NOT NULL,  -- Trace of its sender {to trace}
    received_trace_id BIGINT NOT NULL,  -- Trace of its receiver {to trace}
    sent_ns BIGINT NOT NULL,  -- Handed to the network device [epoch ns]
    received_ns BIGINT NOT NULL,  -- Came from the network device [epoch ns]
    protocol VARCHAR NOT NULL,  -- 'tcp' or 'udp'
    source_address VARCHAR NOT NULL,  -- IP address that it was sent from
    source_port INTEGER NOT NULL,  -- Port that it was sent from
    destination_address VARCHAR NOT NULL,  -- IP address that it was sent to
    destination_port INTEGER NOT NULL,  -- Port that it was sent to
    identification INTEGER,  -- Identification of the datagram; NULL: IPv6 has none
    sequence_number BIGINT  -- Sequence number of its first byte; NULL: not TCP
);

-- One row per callback instance, or take without one, and publication that it led to
CREATE TABLE store.link_causal (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    callback_instance_id BIGINT,  -- Cause; NULL: the take itself {to callback_instance}
    publication_id BIGINT NOT NULL,  -- Effect {to publication}
    take_id BIGINT,  -- Message that led to it; NULL: none (timers, services) {to take}
    subscription_id BIGINT,  -- Subscription of that message {to subscription}
    publisher_id BIGINT,  -- Publisher of the effect {to publisher}
    kind VARCHAR NOT NULL,  -- 'direct', 'periodic_async', 'partial_sync', 'approximate_sync',
        -- 'queue', 'take_adjacent' or 'polled'
    annotation_id BIGINT,  -- Annotation that declares it; NULL for links that are not indirect {to
        -- annotation}
    candidate_count BIGINT,  -- Callback instances that it could have been; one more if the message
        -- may have led to nothing: an input of an indirect link that had no message when the
        -- publishing callback began, or a publication after a take without a callback that a timer
        -- may have made. approximate_sync: 2 if the set may be another one
    is_loss_affected BOOLEAN DEFAULT false NOT NULL  -- A gap of the trace may hide a better partner
);

-- One row per request that a callback instance or thread sent
-- view: Requests and what sent them.
CREATE TABLE store.link_request (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    request_id BIGINT NOT NULL,  -- Effect {to request}
    callback_instance_id BIGINT  -- Cause {to callback_instance}
);

-- One row per response and the callback instance that sent it
-- view: Responses and the callback instance that sent them.
CREATE TABLE store.link_response (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    response_id BIGINT NOT NULL,  -- Effect {to response}
    callback_instance_id BIGINT  -- Cause {to callback_instance}
);

-- One row per message that a thread sent after it took a request or response without a callback
-- view: What threads sent after they took a request or response, in no callback.
CREATE TABLE store.link_call (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    taken_request_id BIGINT,  -- Cause: a request {to request}
    taken_response_id BIGINT,  -- Cause: a response {to response}
    publication_id BIGINT,  -- Effect: a publication {to publication}
    publisher_id BIGINT,  -- Its publisher {to publisher}
    request_id BIGINT,  -- Effect: a request {to request}
    response_id BIGINT,  -- Effect: a response {to response}
    candidate_count BIGINT NOT NULL  -- 1; 2 where the thread sends such messages by itself, too; at
        -- least 2 where its process is ambiguous
);

-- One row per publication and subscription of its topic that is not known to have taken it
CREATE TABLE store.undelivered (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    publication_id BIGINT NOT NULL,  -- The message {to publication}
    publisher_id BIGINT NOT NULL,  -- Its publisher {to publisher}
    subscription_id BIGINT NOT NULL,  -- Subscription that did not take it {to subscription}
    reason VARCHAR NOT NULL  -- Why; a closed vocabulary
);

-- One row per take whose publication is not known
CREATE TABLE store.orphan_take (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    take_id BIGINT NOT NULL,  -- The take {to take}
    subscription_id BIGINT,  -- Subscription that received it {to subscription}
    reason VARCHAR NOT NULL  -- Why; a closed vocabulary
);

-- One row per publication caused by a call, callback instance that called, and services in between
CREATE TABLE store.flow_call (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    publication_id BIGINT NOT NULL,  -- What was published {to publication}
    publisher_id BIGINT,  -- Its publisher {to publisher}
    kind VARCHAR NOT NULL,  -- Kind of the causal link to the publication
    callback_instance_id BIGINT,  -- Callback instance of the service; NULL: what was taken led to
        -- it without one {to callback_instance}
    caller_id BIGINT NOT NULL,  -- Callback instance that called {to callback_instance}
    route BIGINT[] NOT NULL,  -- Node (or, negative, process) that called, then services; empty: by
        -- no service
    take_id BIGINT,  -- Message that the caller processed; NULL: none {to take}
    subscription_id BIGINT,  -- Subscription of that message {to subscription}
    taken_request_id BIGINT,  -- Request that the service took {to request}
    taken_response_id BIGINT  -- Response that the caller took {to response}
);

-- One row per publication on a topic of the application, and per take from (not traced)
CREATE TABLE store.flow_root (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    publication_id BIGINT NOT NULL,  -- The message; below 0: its publisher is not traced
    publisher_id BIGINT NOT NULL,  -- Its publisher; below 0: not traced
    is_source BOOLEAN DEFAULT false NOT NULL,  -- Not caused by a taken message
    root_kind VARCHAR NOT NULL,  -- 'callback_instance', 'publication' or 'take'
    root_id BIGINT NOT NULL,  -- Row of that kind where its flow begins
    route BIGINT[] NOT NULL,  -- Node (or, negative, process) that called, then services; empty: by
        -- no service
    before_take_ns BIGINT  -- Of a take: how long before it the flow begins [ns]
);

-- One row per step of the graph: subscription before, route, publisher and subscription
CREATE TABLE store.flow_hop (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    from_subscription_id BIGINT,  -- Subscription whose message led on; NULL: none {to subscription}
    route BIGINT[] NOT NULL,  -- Node (or, negative, process) that called, then services; empty: by
        -- no service
    publisher_id BIGINT NOT NULL,  -- Publisher; below 0: not traced
    subscription_id BIGINT NOT NULL,  -- Subscription that took from it {to subscription}
    is_source BOOLEAN DEFAULT false NOT NULL,  -- At least one of its publications was not caused by
        -- a taken message
    is_cached BOOLEAN DEFAULT false NOT NULL  -- The message may wait in the node for others
);

-- One row per part of the schema that is re-applied rather than migrated
CREATE TABLE store.definition (
    name VARCHAR PRIMARY KEY,  -- 'views': the SQL of all views and macros
    hash VARCHAR NOT NULL,  -- SHA-256 of the SQL that was last applied
    msgflow_version VARCHAR NOT NULL  -- Version of msgflow that applied it
);

-- One row per ingest of traces that belong together
CREATE TABLE store.run (
    run_id BIGINT PRIMARY KEY,  -- Identity of the run
    name VARCHAR NOT NULL,  -- Name given by the user, or the name of the first trace directory
    created_at TIMESTAMP NOT NULL,  -- When the run was ingested, UTC
    msgflow_version VARCHAR NOT NULL,  -- Version of msgflow that ingested the run
    derivation_hash VARCHAR NOT NULL,  -- SHA-256 of the SQL that derived the links
    start_ns BIGINT,  -- First event of any trace [epoch ns]
    end_ns BIGINT,  -- Last event of any trace [epoch ns]
    event_count BIGINT,  -- Events read
    labels VARCHAR[],  -- Labels that users gave to the run, KEY=VALUE each, sorted; NULL: no label
    clock_sync VARCHAR  -- How clocks were to be brought together: 'none', 'messages' or 'file'
);

-- One row per CTF trace read
-- view: CTF traces that were read.
CREATE TABLE store.trace (
    trace_id BIGINT PRIMARY KEY,  -- Identity of the trace
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    host_id BIGINT NOT NULL,  -- Host that was traced {to host}
    path VARCHAR NOT NULL,  -- Directory as it was given
    uuid VARCHAR,  -- UUID of the trace
    tracer VARCHAR,  -- Tracer and its version
    domain VARCHAR,  -- 'ust' or 'kernel'
    start_ns BIGINT,  -- First event or start of a packet [epoch ns] {clock host_id}
    end_ns BIGINT,  -- Last event or end of a packet [epoch ns] {clock host_id}
    event_count BIGINT,  -- Events read
    discarded_event_count BIGINT,  -- Events that the tracer counted as discarded
    has_request_events BOOLEAN  -- Requests would have events in it, if there were any (Kilted and
        -- later)
);

-- One row per packet of a trace; the identity of what was read
CREATE TABLE store.packet (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    trace_id BIGINT NOT NULL,  -- Trace it was recorded in {to trace}
    stream_class_id BIGINT,  -- Stream class (channel) of the packet
    stream_instance_id BIGINT,  -- Stream (buffer) of the packet
    cpu_id INTEGER,  -- CPU that wrote the packet
    position BIGINT,  -- Position in its stream, from 0
    begin_ns BIGINT,  -- Begin of the packet [epoch ns]
    end_ns BIGINT,  -- End of the packet [epoch ns]
    last_event_ns BIGINT,  -- Last event in the packet [epoch ns]
    event_count BIGINT,  -- Events in the packet
    discarded_event_count BIGINT,  -- Events lost in the packet, after its last event
    lost_packet_count BIGINT  -- Packets missing right before it
);

-- One row per gap in a trace
-- view: Gaps in the traces: no two events are paired across one.
CREATE TABLE store.gap (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    trace_id BIGINT NOT NULL,  -- Trace it was recorded in; between two chunks of a recording, the
        -- later {to trace}
    cpu INTEGER,  -- CPU concerned; NULL: all
    kind VARCHAR NOT NULL,  -- 'loss' (discarded events), 'packets' (lost packets) or 'pause' (not
        -- tracing)
    start_ns BIGINT,  -- Last moment before the gap [epoch ns] {clock trace_id}
    end_ns BIGINT,  -- First moment after the gap [epoch ns] {clock trace_id}
    event_count BIGINT  -- Events lost, where the tracer counted them
);

-- One row per place at which something was found
CREATE TABLE store.finding (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    trace_id BIGINT,  -- Trace it is about; NULL: not one trace alone {to trace}
    name VARCHAR NOT NULL,  -- Kind of finding: its file in `schema/health`
    host_id BIGINT,  -- Host it is about; NULL: see below, or not one host alone {to host}
    process_id BIGINT,  -- Process it is about, likewise {to process}
    thread_id BIGINT,  -- Thread it is about, likewise {to thread}
    node_id BIGINT,  -- Node it is about; of two that a topic joins, the one that subscribes {to
        -- node}
    publishing_node_id BIGINT,  -- Of two nodes, the one that publishes {to node}
    topic_name VARCHAR,  -- Topic it is about
    layer VARCHAR,  -- Kind of event that is missing: 'requests', 'goals', …
    subject VARCHAR,  -- Where, in words; NULL: what the columns before say
    count BIGINT,  -- How often
    detail VARCHAR  -- Numbers, and what they mean
);

-- One row per clock: hosts of one clock need no synchronisation
-- view: Clocks and how their times are corrected. Times in the other views are corrected already.
CREATE TABLE store.clock (
    clock_id BIGINT PRIMARY KEY,  -- Identity of the clock
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    uuid VARCHAR,  -- UUID of the clock (LTTng: boot identity)
    offset_ns BIGINT NOT NULL,  -- Added to a time of this clock to correct it [ns]
    drift_ppb BIGINT NOT NULL,  -- Added per unit of time since reference_ns [1e-9]
    reference_ns BIGINT NOT NULL,  -- Moment at which the correction is offset_ns alone [epoch ns]
    uncertainty_ns BIGINT,  -- Bound of the error of the correction at reference_ns [ns]
    method VARCHAR NOT NULL,  -- 'none', 'messages', 'packets' or 'file'
    drift_uncertainty_ppb BIGINT,  -- Growth of the error bound per unit of time from reference_ns;
        -- NULL: the bound holds throughout, or is not known [1e-9]
    reference_clock_id BIGINT  -- Clock that this one is corrected to: times of clocks with the same
        -- one can be compared; NULL: as recorded {to clock}
);

-- One row per clock and moment
-- view: Bounds of the error of each clock's correction: at the moments listed here, uncertainty_ns;
-- between two of them, on the straight line. Times of two clocks with the same reference can be
-- compared to within the sum of both bounds. The reference itself has no error and no rows.
CREATE TABLE store.clock_uncertainty (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    clock_id BIGINT NOT NULL,  -- The clock {to clock}
    at_ns BIGINT NOT NULL,  -- Moment, as the clock showed it [epoch ns]
    uncertainty_ns BIGINT NOT NULL  -- Bound of the error of the correction at that moment [ns]
);

-- One row per time between two steps of the clock that stamps messages, where its course is certain
CREATE TABLE store.stamp_clock (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    clock_id BIGINT NOT NULL,  -- Clock of the traces {to clock}
    start_ns BIGINT,  -- First stamp of the time, by the clock of ROS; NULL: from the begin [epoch
        -- ns]
    end_ns BIGINT,  -- Last stamp; NULL: until the end [epoch ns]
    at_ns BIGINT NOT NULL,  -- Stamp at which the difference holds [epoch ns]
    difference_ns BIGINT NOT NULL,  -- Clock of ROS less clock of the traces, with the shortest
        -- delay of a stamp [ns]
    drift_ppb BIGINT NOT NULL,  -- How fast the difference changes [ppb]
    slack_ns BIGINT NOT NULL  -- The messages fit differences that are up to so much apart [ns]
);

-- One row per publisher
-- view: Publishers, those of ROS itself marked as internal.
CREATE TABLE store.publisher (
    publisher_id BIGINT PRIMARY KEY,  -- Identity of the publisher
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    process_id BIGINT NOT NULL,  -- Process it lives in {to process}
    node_id BIGINT,  -- Node it belongs to {to node}
    topic_name VARCHAR,  -- Fully expanded topic name
    publisher_handle UBIGINT,  -- rcl publisher handle; an address, valid in its process until
        -- reused
    rmw_handle UBIGINT,  -- rmw publisher handle; an address, valid in its process until reused
    gid BLOB,  -- Global identifier, 16 bytes; NULL: none
    queue_depth BIGINT,  -- History depth asked for
    created_ns BIGINT,  -- First initialisation event [epoch ns] {clock process_id}
    is_internal BOOLEAN DEFAULT false NOT NULL,  -- Infrastructure of ROS (/rosout,
        -- /parameter_events, ...)
    is_inferred BOOLEAN DEFAULT false NOT NULL,  -- Its initialisation was not traced
    is_topic_learned BOOLEAN DEFAULT false NOT NULL,  -- Its topic was deduced from a link {hidden}
    is_topic_declared BOOLEAN DEFAULT false NOT NULL,  -- Its topic was given by a file of links
    is_agnocast BOOLEAN DEFAULT false NOT NULL  -- Its messages pass through the shared memory of
        -- Agnocast
);

-- One row per subscription
-- view: Subscriptions, those of ROS itself marked as internal.
CREATE TABLE store.subscription (
    subscription_id BIGINT PRIMARY KEY,  -- Identity of the subscription
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    process_id BIGINT NOT NULL,  -- Process it lives in {to process}
    node_id BIGINT,  -- Node it belongs to {to node}
    topic_name VARCHAR,  -- Fully expanded topic name
    subscription_handle UBIGINT,  -- rcl subscription handle; an address, valid in its process until
        -- reused
    rmw_handle UBIGINT,  -- rmw subscription handle; an address, valid in its process until reused
    gid BLOB,  -- Global identifier, 16 bytes; NULL: none
    queue_depth BIGINT,  -- History depth asked for
    created_ns BIGINT,  -- First initialisation event [epoch ns] {clock process_id}
    is_internal BOOLEAN DEFAULT false NOT NULL,  -- Infrastructure of ROS (/parameter_events,
        -- /clock, ...)
    is_inferred BOOLEAN DEFAULT false NOT NULL,  -- Its initialisation was not traced
    is_topic_learned BOOLEAN DEFAULT false NOT NULL,  -- Its topic was deduced from a link {hidden}
    is_topic_declared BOOLEAN DEFAULT false NOT NULL,  -- Its topic was given by a file of links
    is_agnocast BOOLEAN DEFAULT false NOT NULL  -- Its messages pass through the shared memory of
        -- Agnocast
);

-- One row per reader of DDS that belongs to no traced subscription
-- view: Who else subscribes: readers that an instrumented DDS created for topics of ROS, in
-- processes without a traced subscription of the topic, such as programs without ROS.
CREATE TABLE store.untraced_reader (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    process_id BIGINT NOT NULL,  -- Process it lives in {to process}
    topic_name VARCHAR NOT NULL,  -- Topic of ROS that it reads
    created_ns BIGINT NOT NULL  -- dds:create_reader [epoch ns] {clock process_id}
);

-- One row per timer
-- view: Timers. If the initialisation of a timer was not traced, its period is not known.
CREATE TABLE store.timer (
    timer_id BIGINT PRIMARY KEY,  -- Identity of the timer
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    process_id BIGINT NOT NULL,  -- Process it lives in {to process}
    node_id BIGINT,  -- Node it belongs to {to node}
    period_ns BIGINT,  -- Period; NULL: not known [ns]
    timer_handle UBIGINT,  -- rcl timer handle; an address, valid in its process until reused
    created_ns BIGINT  -- rcl_timer_init [epoch ns] {clock process_id}
    -- is_inferred BOOLEAN  -- Its initialisation was not traced {sql self.created_ns IS NULL}
);

-- One row per service
-- view: Services, those of ROS itself marked as internal.
CREATE TABLE store.service (
    service_id BIGINT PRIMARY KEY,  -- Identity of the service
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    process_id BIGINT NOT NULL,  -- Process it lives in {to process}
    node_id BIGINT,  -- Node it belongs to {to node}
    service_name VARCHAR,  -- Fully expanded service name
    service_handle UBIGINT,  -- rcl service handle; an address, valid in its process until reused
    rmw_handle UBIGINT,  -- rmw service handle; an address, valid in its process until reused
    gid BLOB,  -- Global identifier, 16 bytes; NULL: none
    created_ns BIGINT,  -- rcl_service_init [epoch ns] {clock process_id}
    is_internal BOOLEAN DEFAULT false NOT NULL  -- Infrastructure of ROS (parameter and lifecycle
        -- services)
    -- is_inferred BOOLEAN  -- Its initialisation was not traced {sql self.created_ns IS NULL}
);

-- One row per service client
-- view: Service clients, those of ROS itself marked as internal.
CREATE TABLE store.client (
    client_id BIGINT PRIMARY KEY,  -- Identity of the client
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    process_id BIGINT NOT NULL,  -- Process it lives in {to process}
    node_id BIGINT,  -- Node it belongs to {to node}
    service_name VARCHAR,  -- Fully expanded service name
    client_handle UBIGINT,  -- rcl client handle; an address, valid in its process until reused
    rmw_handle UBIGINT,  -- rmw client handle; an address, valid in its process until reused
    gid BLOB,  -- Identifier that servers see, 16 bytes; NULL: none
    created_ns BIGINT,  -- rcl_client_init [epoch ns] {clock process_id}
    is_internal BOOLEAN DEFAULT false NOT NULL  -- Infrastructure of ROS (parameter and lifecycle
        -- services)
    -- is_inferred BOOLEAN  -- Its initialisation was not traced {sql self.created_ns IS NULL}
);

-- One row per host, tid and name
-- view: Threads without ROS events that took the CPU from one with such events, or woke one.
CREATE TABLE store.other_thread (
    other_thread_id BIGINT PRIMARY KEY,  -- Identity of the thread
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    host_id BIGINT NOT NULL,  -- Host it ran on {to host}
    tid INTEGER NOT NULL,  -- Thread, as the kernel numbers it; 0: idle
    name VARCHAR,  -- Its name
    pid INTEGER,  -- Its process, as the kernel numbers it; NULL: the kernel trace does not have it
    program VARCHAR,  -- Name of the first thread of that process; its own where that is not known
    command VARCHAR,  -- File that the process executed while the recording ran; NULL: not known
    process_id BIGINT  -- Process of ROS whose other threads have events; NULL: none {to process}
    -- is_recorder BOOLEAN  -- It records: without that, it does not run {sql regexp_full_match(
        -- coalesce(self.program, ''), 'lttng-.*|msgflow|perf')}
);

-- One row per interval in which a thread had one state
-- view: States of threads of ROS processes, as the kernel recorded them.
CREATE TABLE store.thread_state (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    thread_id BIGINT NOT NULL,  -- The thread {to thread}
    start_ns BIGINT NOT NULL,  -- Begin [epoch ns] {clock thread_id}
    end_ns BIGINT NOT NULL,  -- End [epoch ns] {clock thread_id}
    state VARCHAR NOT NULL,  -- 'running', 'preempted' (the CPU was taken away), 'runnable' (woken,
        -- waits for a CPU), 'sleeping', 'uninterruptible' (waits for a page or a disk) or 'unknown'
    cpu INTEGER,  -- CPU it ran on; preempted: the one it waits for; else the one that it left
    priority INTEGER,  -- Its priority to the kernel: 0 to 99 real-time, 100 to 139 nice -20 to 19
    preempted_by_thread_id BIGINT,  -- Thread that took the CPU {to thread}
    preempted_by_other_thread_id BIGINT,  -- Thread of another process that took the CPU {to
        -- other_thread}
    preempted_by_priority INTEGER,  -- The priority of what took the CPU
    is_cpu_idle BOOLEAN DEFAULT false NOT NULL,  -- No thread took the CPU: the kernel let it idle,
        -- as with a quota (main.withheld_cpu)
    waker_kind VARCHAR,  -- What ended the sleep: 'thread', 'timer', 'interrupt' or 'softirq'; with
        -- an interrupt the waker is what it interrupted. NULL: not known
    waker_thread_id BIGINT,  -- Thread that woke it {to thread}
    waker_other_thread_id BIGINT,  -- Thread of another process that woke it {to other_thread}
    is_loss_affected BOOLEAN DEFAULT false NOT NULL  -- Kernel events were lost meanwhile
    -- policy VARCHAR  -- How it is scheduled, as its priority tells: 'deadline', 'real_time' or
        -- 'normal' {sql CASE WHEN self.priority < 0 THEN 'deadline' WHEN self.priority < 100 THEN
        -- 'real_time' WHEN self.priority IS NOT NULL THEN 'normal' END}
);

-- One row per wait of a thread for a CPU, and stretch in which another thread had it, or none
-- view: What ran on the CPU for which a thread of a ROS process waited.
CREATE TABLE store.preemptor (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    thread_id BIGINT NOT NULL,  -- The thread that waited {to thread}
    start_ns BIGINT NOT NULL,  -- Begin [epoch ns] {clock thread_id}
    end_ns BIGINT NOT NULL,  -- End [epoch ns] {clock thread_id}
    state VARCHAR NOT NULL,  -- Its state: 'preempted' or 'runnable'
    cpu INTEGER,  -- The CPU
    preemptor_thread_id BIGINT,  -- Thread that had the CPU {to thread}
    preemptor_other_thread_id BIGINT,  -- Thread of another process that had the CPU {to
        -- other_thread}
    preemptor_priority INTEGER,  -- The priority of that thread
    thread_priority INTEGER  -- The priority of the thread that waited
    -- is_cpu_idle BOOLEAN  -- No thread had the CPU: a CPU needs some microseconds until it runs a
        -- thread, longer ones are main.withheld_cpu {sql self.preemptor_thread_id IS NULL AND
        -- self.preemptor_other_thread_id IS NULL}
);

-- One row per callback instance that waited for a CPU, and thread that had it meanwhile, or none
-- view: What ran on the CPU for which callback instances waited, and for how long.
CREATE TABLE store.callback_preemptor (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    callback_instance_id BIGINT NOT NULL,  -- The callback instance that waited {to
        -- callback_instance}
    preemptor_thread_id BIGINT,  -- Thread that had the CPU {to thread}
    preemptor_other_thread_id BIGINT,  -- Thread of another process that had the CPU {to
        -- other_thread}
    preemptor_priority INTEGER,  -- The priority of that thread
    preempted_ns BIGINT NOT NULL,  -- For so long, while it was preempted [ns]
    runnable_ns BIGINT NOT NULL  -- For so long, while it was woken [ns]
    -- is_cpu_idle BOOLEAN  -- No thread had the CPU {sql self.preemptor_thread_id IS NULL AND
        -- self.preemptor_other_thread_id IS NULL}
);

-- One row per callback instance and performance counter that was read at its begin and its end
-- view: What performance counters of the thread counted while callback instances ran.
CREATE TABLE store.callback_counter (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    callback_instance_id BIGINT NOT NULL,  -- The callback instance {to callback_instance}
    name VARCHAR NOT NULL,  -- What was counted, as LTTng names it: 'instructions', 'cache_misses',
        -- 'task_clock' (CPU time in ns)
    value BIGINT NOT NULL  -- How much of it
);

-- One row per garbage collection of a Python node that msgflow record traced
-- view: When the garbage collector of Python ran.
CREATE TABLE store.garbage_collection (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    process_id BIGINT NOT NULL,  -- Process it lives in {to process}
    thread_id BIGINT NOT NULL,  -- Thread it happened on {to thread}
    start_ns BIGINT NOT NULL,  -- Begin [epoch ns] {clock process_id}
    end_ns BIGINT NOT NULL,  -- End [epoch ns] {clock process_id}
    generation INTEGER,  -- Of the objects that it looked at: 0 the youngest, 2 all
    callback_instance_id BIGINT  -- Callback instance that it interrupted; NULL: none {to
        -- callback_instance}
);

-- One row per callback instance that ended, on a thread whose states are known
-- view: How the time of callback instances divides into states of their threads: the parts add up
-- to the duration.
CREATE TABLE store.callback_schedule (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    callback_instance_id BIGINT NOT NULL,  -- The callback instance {to callback_instance}
    running_ns BIGINT NOT NULL,  -- On a CPU [ns]
    preempted_ns BIGINT NOT NULL,  -- Ready, but the CPU was taken away [ns]
    runnable_ns BIGINT NOT NULL,  -- Woken, waiting for a CPU [ns]
    sleeping_ns BIGINT NOT NULL,  -- Waiting for something [ns]
    uninterruptible_ns BIGINT NOT NULL,  -- Waiting for a page or a disk [ns]
    unknown_ns BIGINT NOT NULL,  -- Not known [ns]
    preemption_count BIGINT NOT NULL,  -- How often the CPU was taken away
    migration_count BIGINT NOT NULL,  -- How often it went on on another CPU
    is_loss_affected BOOLEAN DEFAULT false NOT NULL,  -- Kernel events were lost meanwhile
    irq_ns BIGINT,  -- Of the time on a CPU, interrupts; NULL: not recorded [ns]
    softirq_ns BIGINT  -- Of the time on a CPU, what interrupts left for later; NULL: not recorded
        -- [ns]
);

-- One row per CPU, second and thread that ran there
-- view: What ran on each CPU, second by second, threads of processes without ROS included.
CREATE TABLE store.cpu_usage (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    host_id BIGINT NOT NULL,  -- Host {to host}
    cpu INTEGER,  -- CPU
    start_ns BIGINT NOT NULL,  -- Begin of the second [epoch ns] {clock host_id}
    thread_id BIGINT,  -- The thread; NULL: of a process without ROS {to thread}
    tid INTEGER NOT NULL,  -- Its number to the kernel; 0: idle
    name VARCHAR,  -- Its name
    running_ns BIGINT NOT NULL,  -- How long it ran [ns]
    frequency_hz BIGINT  -- Mean frequency of the CPU in the second, as far as it is known; NULL:
        -- not recorded [Hz]
);

-- One row per thread and time between two samples of it
-- view: What threads of ROS processes did, as msgflow record samples them ten times a second. The
-- rows of a thread follow each other; what is neither running_ns nor waiting_ns it slept. Both are
-- exact for the row as a whole. No row is there before the first sample and after the last.
CREATE TABLE store.thread_usage (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    thread_id BIGINT NOT NULL,  -- The thread {to thread}
    start_ns BIGINT NOT NULL,  -- The sample before [epoch ns] {clock thread_id}
    end_ns BIGINT NOT NULL,  -- The sample [epoch ns] {clock thread_id}
    running_ns BIGINT NOT NULL,  -- On a CPU [ns]
    waiting_ns BIGINT NOT NULL,  -- Ready, without a CPU: another thread or a quota kept it from one
        -- [ns]
    state VARCHAR,  -- Its state at the end: 'R' runs or waits for a CPU, 'S' sleeps, 'D' waits for
        -- a page or a disk; others as Linux names them
    minor_faults BIGINT,  -- Page faults that needed no disk
    major_faults BIGINT,  -- Page faults that read from a disk
    io_ns BIGINT,  -- Waiting for a disk, where the kernel accounts it (kernel.task_delayacct); else
        -- 0 [ns]
    voluntary_switches BIGINT,  -- How often it went to sleep, as counted once a second: also those
        -- of up to a second before
    forced_switches BIGINT  -- How often the CPU was taken away, counted likewise
);

-- One row per process that used a CPU, and time between two samples of it
-- view: CPU time of all processes of a host, those without ROS included, as msgflow record samples
-- it once a second. Who used none has no row.
CREATE TABLE store.program_usage (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    host_id BIGINT NOT NULL,  -- Host it ran on {to host}
    process_id BIGINT,  -- The process; NULL: one without ROS events {to process}
    start_ns BIGINT NOT NULL,  -- The sample before [epoch ns] {clock host_id}
    end_ns BIGINT NOT NULL,  -- The sample [epoch ns] {clock host_id}
    pid INTEGER NOT NULL,  -- Process id, as msgflow record sees it
    name VARCHAR,  -- Its name
    command VARCHAR,  -- The begin of its command line
    cpu_ns BIGINT NOT NULL,  -- CPU time of all its threads; counted in hundredths of a second [ns]
    is_recorder BOOLEAN DEFAULT false NOT NULL  -- It makes the recording: msgflow, LTTng or perf
);

-- One row per quota, process in it, and time between two samples in which it held threads up
-- view: Quotas of CPU time (cgroups, as of containers) that held their processes up, as msgflow
-- record samples them ten times a second.
CREATE TABLE store.quota_usage (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    host_id BIGINT NOT NULL,  -- Host {to host}
    process_id BIGINT NOT NULL,  -- A process in it; each has a row {to process}
    name VARCHAR NOT NULL,  -- Its cgroup, as a path
    start_ns BIGINT NOT NULL,  -- The sample before [epoch ns] {clock host_id}
    end_ns BIGINT NOT NULL,  -- The sample [epoch ns] {clock host_id}
    throttled_count BIGINT NOT NULL,  -- How often all of it had to stop, until its next period
    throttled_ns BIGINT NOT NULL,  -- For how long, the sum over CPUs [ns]
    cpus DOUBLE  -- CPUs that it may use; NULL: not known
);

-- One row per host and time between two samples of it
-- view: How busy hosts were, as msgflow record samples them once a second.
CREATE TABLE store.host_usage (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    host_id BIGINT NOT NULL,  -- Host {to host}
    start_ns BIGINT NOT NULL,  -- The sample before [epoch ns] {clock host_id}
    end_ns BIGINT NOT NULL,  -- The sample [epoch ns] {clock host_id}
    cpus INTEGER,  -- CPUs of the machine
    busy_ns BIGINT,  -- CPU time used, the sum over CPUs [ns]
    stolen_ns BIGINT,  -- CPU time that the host of a virtual machine kept, likewise [ns]
    cpu_pressure_ns BIGINT,  -- While a thread waited for a CPU; NULL: the kernel does not say [ns]
    io_pressure_ns BIGINT,  -- While a thread waited for a disk; NULL likewise [ns]
    memory_pressure_ns BIGINT,  -- While a thread waited for memory; NULL likewise [ns]
    frequency_hz BIGINT,  -- Mean frequency of the CPUs at the end; NULL likewise [Hz]
    most_frequency_hz BIGINT,  -- The mean of what they may have; NULL likewise [Hz]
    throttle_count BIGINT  -- How often CPUs were slowed down as they were hot, the sum over
        -- CPUs; NULL likewise
);

-- One row per function and file
-- view: Functions that samples of stacks saw.
CREATE TABLE store.stack_frame (
    stack_frame_id BIGINT PRIMARY KEY,  -- Identity of the function
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    function VARCHAR NOT NULL,  -- Its name; '[unknown]': the file has no symbol for it
    file VARCHAR NOT NULL  -- Library or program that has it, of Python the source file
);

-- One row per different stack
-- view: Stacks of calls that samples saw, each once, with the function that ran.
CREATE TABLE store.stack (
    stack_id BIGINT PRIMARY KEY,  -- Identity of the stack
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    stack_frame_id BIGINT NOT NULL,  -- The function that ran: the innermost one, or the function of
        -- Python that the interpreter ran {to stack_frame}
    depth INTEGER NOT NULL  -- How many calls it has
);

-- One row per stack and call in it
-- view: The calls of each stack.
CREATE TABLE store.stack_call (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    stack_id BIGINT NOT NULL,  -- The stack {to stack}
    position INTEGER NOT NULL,  -- Place of the call, 1: the outermost
    stack_frame_id BIGINT NOT NULL  -- The function that was called {to stack_frame}
);

-- One row per sample of a process with ROS events
-- view: Samples of what threads of ROS processes ran, by perf.
CREATE TABLE store.stack_sample (
    run_id BIGINT NOT NULL,  -- Run that the row belongs to {to run}
    process_id BIGINT NOT NULL,  -- Process it lives in {to process}
    thread_id BIGINT,  -- Thread that ran; NULL: one that recorded no event {to thread}
    tid INTEGER NOT NULL,  -- Thread that ran, as perf numbers it
    at_ns BIGINT NOT NULL,  -- When [epoch ns] {clock process_id}
    cpu INTEGER,  -- CPU it ran on
    callback_instance_id BIGINT,  -- Innermost callback instance that ran on its thread; NULL:
        -- outside of callbacks {to callback_instance}
    stack_id BIGINT NOT NULL,  -- The stack {to stack}
    cpu_ns BIGINT  -- CPU time that it stands for; NULL: perf counted cycles [ns]
);
