"""Tables of the graph of flows, on which queries walk."""

from __future__ import annotations

from msgflow.db.tables.column import flag, number, reference, route, table, text

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
