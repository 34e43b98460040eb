"""Tables of links: which take is from which publication, what is missing, causes, and flows."""

from __future__ import annotations

from msgflow.db.tables.column import (
    flag,
    integer,
    key,
    moment,
    number,
    process_id,
    reference,
    route,
    table,
    text,
)

table(
    "annotation",
    key("annotation_id", "Identity of the annotation"),
    text(
        "kind",
        "'periodic_async', 'partial_sync', 'approximate_sync', 'queue', 'direct' or 'independent'",
        required=True,
    ),
    text("source", "'trace' or 'file'", required=True),
    process_id(),
    number("queue_depth", "Of a queue: most messages that wait in it; NULL: not limited"),
    comment="One row per declared link",
    view="Declared links: indirect ones, and whether publications answer messages.",
)

table(
    "annotation_input",
    reference("annotation_id", "The annotation", required=True),
    reference("subscription_id", "Its input", required=True),
    comment="One row per subscription of an annotation",
    view="Subscriptions of the declared indirect links.",
)

table(
    "annotation_output",
    reference("annotation_id", "The annotation", required=True),
    reference("publisher_id", "Its output", required=True),
    comment="One row per publisher of an annotation",
    view="Publishers of the declared indirect links.",
)

table(
    "nearest_message",
    text("topic_name", "Topic of the message", required=True),
    moment("source_timestamp_ns", "Stamp of the message, clock of ROS", required=True),
    reference("publication_id", "Where it came from; NULL: several could be it"),
    number(
        "candidate_count",
        "Publications that it could have been; NULL: the clock was set about then",
    ),
    comment="One row per message that one publication or several fit by time",
)

table(
    "link_transport",
    reference("publication_id", "Where the message came from", required=True),
    reference("take_id", "Where it was received", required=True),
    reference("publisher_id", "Publisher of the message"),
    reference("subscription_id", "Subscription that received it"),
    text("method", "'exact', 'exact_stamp', 'nearest', 'ring_buffer' or 'agnocast'", required=True),
    number("candidate_count", "Number of publications that are possible"),
    flag("is_self_loop", "Received by the publishing node itself"),
    flag("is_loss_affected", "A gap of the trace may hide a better partner"),
    flag("is_copy", "A ring buffer carries the same message: no callback gets this one"),
    comment="One row per take whose publication is known",
)

table(
    "link_packet",
    reference("sent_trace_id", "Trace of its sender", to="trace", required=True),
    reference("received_trace_id", "Trace of its receiver", to="trace", required=True),
    moment("sent_ns", "Handed to the network device", required=True),
    moment("received_ns", "Came from the network device", required=True),
    text("protocol", "'tcp' or 'udp'", required=True),
    text("source_address", "IP address that it was sent from", required=True),
    integer("source_port", "Port that it was sent from", required=True),
    text("destination_address", "IP address that it was sent to", required=True),
    integer("destination_port", "Port that it was sent to", required=True),
    integer("identification", "Identification of the datagram; NULL: IPv6 has none"),
    number("sequence_number", "Sequence number of its first byte; NULL: not TCP"),
    comment="One row per network packet and clock that received it from another",
)

table(
    "link_causal",
    reference("callback_instance_id", "Cause; NULL: the take itself"),
    reference("publication_id", "Effect", required=True),
    reference("take_id", "Message that led to it; NULL: none (timers, services)"),
    reference("subscription_id", "Subscription of that message"),
    reference("publisher_id", "Publisher of the effect"),
    text(
        "kind",
        "'direct', 'periodic_async', 'partial_sync', 'approximate_sync', 'queue', 'take_adjacent' "
        "or 'polled'",
        required=True,
    ),
    reference("annotation_id", "Annotation that declares it; NULL for links that are not indirect"),
    number(
        "candidate_count",
        "Callback instances that it could have been; one more if the message may have led to "
        "nothing: an input of an indirect link that had no message when the publishing callback "
        "began, or a publication after a take without a callback that a timer may have made. "
        "approximate_sync: 2 if the set may be another one",
    ),
    flag("is_loss_affected", "A gap of the trace may hide a better partner"),
    comment="One row per callback instance, or take without one, and publication that it led to",
)

table(
    "link_request",
    reference("request_id", "Effect", required=True),
    reference("callback_instance_id", "Cause"),
    comment="One row per request that a callback instance or thread sent",
    view="Requests and what sent them.",
)

table(
    "link_response",
    reference("response_id", "Effect", required=True),
    reference("callback_instance_id", "Cause"),
    comment="One row per response and the callback instance that sent it",
    view="Responses and the callback instance that sent them.",
)

table(
    "link_call",
    reference("taken_request_id", "Cause: a request", to="request"),
    reference("taken_response_id", "Cause: a response", to="response"),
    reference("publication_id", "Effect: a publication"),
    reference("publisher_id", "Its publisher"),
    reference("request_id", "Effect: a request"),
    reference("response_id", "Effect: a response"),
    number(
        "candidate_count",
        "1; 2 where the thread sends such messages by itself, too; at least 2 where its process is "
        "ambiguous",
        required=True,
    ),
    comment=(
        "One row per message that a thread sent after it took a request or response without a "
        "callback"
    ),
    view="What threads sent after they took a request or response, in no callback.",
)

table(
    "undelivered",
    reference("publication_id", "The message", required=True),
    reference("publisher_id", "Its publisher", required=True),
    reference("subscription_id", "Subscription that did not take it", required=True),
    text("reason", "Why; a closed vocabulary", required=True),
    comment=(
        "One row per publication and subscription of its topic that is not known to have taken it"
    ),
)

table(
    "orphan_take",
    reference("take_id", "The take", required=True),
    reference("subscription_id", "Subscription that received it"),
    text("reason", "Why; a closed vocabulary", required=True),
    comment="One row per take whose publication is not known",
)

table(
    "flow_call",
    reference("publication_id", "What was published", required=True),
    reference("publisher_id", "Its publisher"),
    text("kind", "Kind of the causal link to the publication", required=True),
    reference(
        "callback_instance_id",
        "Callback instance of the service; NULL: what was taken led to it without one",
    ),
    reference("caller_id", "Callback instance that called", to="callback_instance", required=True),
    route(),
    reference("take_id", "Message that the caller processed; NULL: none"),
    reference("subscription_id", "Subscription of that message"),
    reference("taken_request_id", "Request that the service took", to="request"),
    reference("taken_response_id", "Response that the caller took", to="response"),
    comment=(
        "One row per publication caused by a call, callback instance that called, and services in "
        "between"
    ),
)

table(
    "flow_root",
    number("publication_id", "The message; below 0: its publisher is not traced", required=True),
    number("publisher_id", "Its publisher; below 0: not traced", required=True),
    flag("is_source", "Not caused by a taken message"),
    text("root_kind", "'callback_instance', 'publication' or 'take'", required=True),
    number("root_id", "Row of that kind where its flow begins", required=True),
    route(),
    number("before_take_ns", "Of a take: how long before it the flow begins", unit="ns"),
    comment="One row per publication on a topic of the application, and per take from (not traced)",
)

table(
    "flow_hop",
    reference(
        "from_subscription_id", "Subscription whose message led on; NULL: none", to="subscription"
    ),
    route(),
    number("publisher_id", "Publisher; below 0: not traced", required=True),
    reference("subscription_id", "Subscription that took from it", required=True),
    flag("is_source", "At least one of its publications was not caused by a taken message"),
    flag("is_cached", "The message may wait in the node for others"),
    comment="One row per step of the graph: subscription before, route, publisher and subscription",
)
