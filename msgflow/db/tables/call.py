"""Tables of what programs did: publications, takes, requests, callbacks, events of their own."""

from __future__ import annotations

from sqlalchemy import BOOLEAN

from msgflow.db.tables.column import (
    column,
    event_order,
    flag,
    handle,
    identity,
    integer,
    key,
    moment,
    node_id,
    number,
    process_id,
    reference,
    table,
    text,
    thread_id,
    trace_id,
)

_IS_END_INFERRED = column(
    "is_end_inferred",
    "No callback_end: a service callback that answers later (before Kilted), which was over at "
    "the next executor event of its thread at the latest",
    BOOLEAN,
    sql="self.end_ns IS NOT NULL AND self.end_event_id IS NULL",
)

table(
    "publication",
    identity("publication_id", "Identity of the publication"),
    trace_id(),
    reference("publisher_id", "Publisher; NULL: the middleware itself"),
    process_id(),
    thread_id(),
    moment("start_ns", "First layer seen", required=True, clock="process_id"),
    moment("end_ns", "Last layer seen", required=True, clock="process_id"),
    moment("intra_ns", "rclcpp_intra_publish", clock="process_id"),
    moment("rclcpp_ns", "rclcpp_publish, or agnocast_publish", clock="process_id"),
    moment("rcl_ns", "rcl_publish", clock="process_id"),
    moment("rmw_ns", "rmw_publish", clock="process_id"),
    moment("dds_ns", "dds:write", clock="process_id"),
    moment("source_timestamp_ns", "Stamp that the middleware gave to the message, clock of ROS"),
    event_order("start_event_id", "First layer seen"),
    event_order("end_event_id", "Last layer seen"),
    event_order("callback_event_id", "Last begin or end of a callback before it; NULL: none"),
    flag("is_loss_affected", "A gap right before or after it on its thread may hide a layer"),
    moment(
        "next_event_ns",
        "Next event of the thread, where it has no stamp; NULL: none, or a gap may hide it",
        is_hidden=True,
    ),
    comment="One row per publish() call",
    view="Messages at the moment they were published, with the time of each layer seen.",
)

table(
    "take",
    identity("take_id", "Identity of the take"),
    trace_id(),
    reference("subscription_id", "Subscription"),
    process_id(),
    thread_id(),
    moment("taken_ns", "Moment of the hand-over", required=True, clock="process_id"),
    moment("source_timestamp_ns", "Stamp that came with the message, clock of ROS"),
    text("method", "'rmw', 'ring_buffer', 'agnocast', 'caret' or 'callback_only'", required=True),
    event_order("start_event_id", "First layer seen"),
    event_order("end_event_id", "Last layer seen"),
    flag(
        "is_loss_affected",
        "A gap right before or after it on its thread may hide a layer or its callback",
    ),
    comment="One row per message handed over to a subscription",
    view="Messages at the moment they were handed over to a subscription.",
)

table(
    "failed_take",
    trace_id(),
    reference("subscription_id", "Subscription"),
    process_id(),
    thread_id(),
    moment("failed_ns", "Moment of the attempt", required=True, clock="process_id"),
    comment="One row per attempt that took nothing",
    view="Attempts to take from a subscription that got nothing.",
)

table(
    "ring_buffer_event",
    trace_id(),
    process_id(),
    text("kind", "'enqueue', 'dequeue' or 'clear'", required=True),
    handle("buffer_handle", "Address of the ring buffer"),
    number("slot", "Index in the buffer; NULL: all"),
    moment("at_ns", "Moment of the event", required=True),
    reference(
        "publication_id", "Message put in; NULL: the replay of one kept for late subscriptions"
    ),
    reference("take_id", "Message taken out"),
    flag("is_overwriting", "An older message was lost from the slot"),
    event_order("event_id", "The event"),
    comment="One row per enqueue, dequeue or clearing of an intra-process ring buffer",
)

table(
    "data_arrival",
    reference("take_id", "Take of the message", required=True),
    number("waited_ns", "From there until the take", unit="ns", required=True),
    flag("is_ambiguous", "Several readers of the process had a message of that stamp"),
    comment="One row per take of a message whose arrival something else than its thread told",
    view=(
        "When messages were there before they were taken, as CARET's hook in Fast DDS "
        "says. In events executors also: those that their own thread published, and those for "
        "which, as a kernel trace shows, the publishing thread woke one of the middleware."
    ),
)

table(
    "agnocast_entry",
    reference("publication_id", "Message put in; NULL: of a take"),
    reference("take_id", "Message handed over; NULL: of a publication"),
    number("entry_id", "Number of the message on its topic and kernel", required=True),
    comment="One row per publication or take of Agnocast",
    view="Numbers that Agnocast gave to messages.",
)

table(
    "request",
    identity("request_id", "Identity of the request"),
    reference("client_id", "Client that sent it"),
    reference("service_id", "Service that took it"),
    number("sequence_number", "Number given by the client"),
    moment("sent_ns", "rmw_send_request", clock="sender_thread_id"),
    moment("taken_ns", "rmw_take_request", clock="receiver_thread_id"),
    thread_id("Thread that sent it", "sender_thread_id", required=False),
    thread_id("Thread that took it", "receiver_thread_id", required=False),
    reference("callback_instance_id", "Service callback it led to"),
    comment="One row per service request",
    view="Service requests.",
)

table(
    "response",
    identity("response_id", "Identity of the response"),
    reference("client_id", "Client that took it"),
    reference("service_id", "Service that sent it"),
    number("sequence_number", "Number given by the client"),
    moment("sent_ns", "rmw_send_response", clock="sender_thread_id"),
    moment("taken_ns", "rmw_take_response", clock="receiver_thread_id"),
    thread_id("Thread that sent it", "sender_thread_id", required=False),
    thread_id("Thread that took it", "receiver_thread_id", required=False),
    reference("callback_instance_id", "Service callback it came from"),
    reference("request_id", "Request that it answers"),
    comment="One row per service response",
    view="Service responses.",
)

table(
    "bag_message",
    reference("publication_id", "The publication that it is the message of", required=True),
    text("topic_name", "Name of the topic", required=True),
    text("type_name", "Type of the message, such as sensor_msgs/msg/Image", required=True),
    moment("received_ns", "When the recorder of the bag received it, clock of ROS", required=True),
    number("size_bytes", "Size as it was sent (CDR)", unit="bytes", required=True),
    moment("stamp_ns", "header.stamp, clock of ROS; NULL: its type has no header"),
    text("frame_id", "header.frame_id; NULL: its type has no header"),
    comment="One row per message of a bag whose publication is known (msgflow bag)",
    view="Messages of a bag that was recorded in the same run: size, stamp and frame.",
)

table(
    "user_event",
    identity("user_event_id", "Identity of the event"),
    trace_id(),
    process_id(),
    thread_id(),
    integer("cpu", "CPU that it happened on"),
    moment("at_ns", "When it happened", required=True, clock="process_id"),
    text("name", "Provider and event, such as my_pkg:frame_done", required=True),
    reference(
        "callback_instance_id",
        "Innermost callback instance inside which it happened, on its thread; NULL: none",
    ),
    text("fields", "Its fields, a JSON object: fields->>'$.name' is one of them", required=True),
    flag("is_loss_affected", "A gap may hide that the callback instance was over"),
    comment="One row per event whose name a pattern of msgflow ingest --events matches",
    view="Events of the user's own tracepoints.",
)

table(
    "callback",
    key("callback_id", "Identity of the callback"),
    process_id(),
    node_id(),
    text(
        "kind",
        "'subscription', 'timer', 'service', 'function' (of Python: a task, of an action or client)"
        " or 'unknown'",
        required=True,
    ),
    reference("subscription_id", "Its subscription"),
    reference("timer_id", "Its timer"),
    reference("service_id", "Its service"),
    handle("callback_handle", "Address of the callback object"),
    text("symbol", "Function registered for it; NULL: none or unresolvable"),
    moment("created_ns", "First initialisation event", clock="process_id"),
    comment="One row per callback object",
    view="Callback objects and what they belong to.",
)

table(
    "callback_group",
    key("callback_group_id", "Identity of the callback group"),
    process_id(),
    reference("executor_id", "Executor that it was added to"),
    text(
        "kind", "'mutually_exclusive', 'reentrant' or 'unknown', as CARET names it", required=True
    ),
    comment="One row per callback group of an executor",
    view=(
        "Callback groups, where the trace has them (CARET). Callbacks of a mutually exclusive "
        "group never run at the same time."
    ),
)

table(
    "callback_group_member",
    reference("callback_group_id", "The callback group", required=True),
    reference("callback_id", "The callback", required=True),
    comment="One row per callback in a callback group",
    view="Callbacks of the callback groups.",
)

table(
    "callback_instance",
    identity("callback_instance_id", "Identity of the callback instance"),
    trace_id(),
    reference("callback_id", "Callback that ran", required=True),
    process_id(),
    thread_id(),
    moment("start_ns", "callback_start", required=True, clock="process_id"),
    moment(
        "end_ns",
        "callback_end, else what is_end_inferred says; NULL: never seen to end",
        clock="process_id",
    ),
    reference("take_id", "Message it was called with"),
    reference("request_id", "Request it was called with"),
    reference("response_id", "Response that it follows from, in Python"),
    reference(
        "continues_id",
        "Callback instance that it is a later step of, in Python; NULL: it is the first",
        to="callback_instance",
    ),
    flag("is_intra_process", "Called with an intra-process message"),
    reference("parent_id", "Callback instance that it is nested in", to="callback_instance"),
    integer("depth", "Nesting depth on its thread, from 1", required=True),
    event_order("start_event_id", "callback_start"),
    event_order("end_event_id", "callback_end; NULL: never seen to end"),
    event_order(
        "effective_end_event_id", "callback_end, else the first event that cannot be inside"
    ),
    flag(
        "is_loss_affected",
        "A gap inside or beside it on its thread may hide its end or what it did",
    ),
    comment="One row per callback instance",
    view="Callback instances.",
    computed=(_IS_END_INFERRED,),
)

table(
    "executor",
    key("executor_id", "Identity of the executor"),
    process_id(),
    text(
        "kind",
        "'single_threaded', 'multi_threaded', 'events' (without events of its own, but seen to "
        "serve what came first first), 'unknown', or as CARET names it",
        required=True,
    ),
    flag("is_inferred", "Deduced from the threads that run the same callbacks"),
    comment="One row per executor",
    view="Executors.",
)

table(
    "executor_thread",
    reference("executor_id", "The executor", required=True),
    thread_id("The thread"),
    comment="One row per thread of an executor",
    view="Threads of the executors.",
)

table(
    "executor_state",
    thread_id("The thread"),
    text("state", "'wait', 'process' or 'execute'", required=True),
    moment("start_ns", "Executor event that began it", required=True, clock="thread_id"),
    flag("is_behind_gap", "A gap may hide an executor event between the one before and this one"),
    reference("callback_instance_id", "First callback instance in it"),
    event_order("start_event_id", "Executor event that began it"),
    comment="One row per executor event of a thread: a state lasts until the next one",
)
