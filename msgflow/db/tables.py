"""The one definition of the tables in schema `store`, and of what users see of them.

New databases are made of it (`create.py`), rows are stored in its order (`store.py`), and where a
table says what its public view is, that view is made of it, too, with its comments and its page of
the documentation (`table_view.py`). Other public views over a table are files of `schema/public`;
what their columns share with the table stands only here.

Every table has one comment that states its grain; every column one that states its meaning.
Relations are declared in `references`: DuckDB's foreign keys would forbid replacing a run
in one transaction, so `schema/health/check` proves them instead.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

SCHEMA = "store"
RUN_COMMENT = "Run that the row belongs to"


@dataclass(frozen=True, slots=True)
class Column:
    """A column of a table, or of its public view alone.

    Attributes:
        name: of both.
        type: as DuckDB calls it.
        description: what it means.
        unit: of its values, None where they have none.
        is_key: it tells the rows apart.
        is_required: it is never NULL.
        default: in SQL, where nobody gives a value.
        references: the column of a table that each value stands in.
        is_public: the view shows it.
        clock_of: of a moment, the column that leads to the clock that showed it.
        sql: where only the view has it, what it is made of.
    """

    name: str
    type: str
    description: str
    unit: str | None = None
    is_key: bool = False
    is_required: bool = False
    default: str | None = None
    references: str | None = None
    is_public: bool = True
    clock_of: str | None = None
    sql: str | None = None

    @property
    def comment(self) -> str:
        """What databases say of it."""
        return self.description if self.unit is None else f"{self.description} [{self.unit}]"


@dataclass(frozen=True, slots=True)
class Table:
    """A table of the schema `store`.

    Attributes:
        name: of the table, and of its public view.
        comment: what a row is.
        view: what the public view is, where that shows the table as it is.
        declared: its columns and those of the view alone, in order.
        columns: its columns by name, in order.
    """

    name: str
    comment: str
    view: str | None
    declared: tuple[Column, ...]
    columns: Mapping[str, Column]

    @property
    def full_name(self) -> str:
        """The name with its schema."""
        return f"{SCHEMA}.{self.name}"


TABLES: dict[str, Table] = {}
"""Every table by name, in the order in which rows are stored."""


def _key(name: str, comment: str) -> Column:
    return Column(name, "BIGINT", comment, is_key=True, is_required=True)


def _id(name: str, comment: str) -> Column:
    """Key of an instance or link table: unique, but not worth an index."""
    return Column(name, "BIGINT", comment, is_required=True)


def _reference(name: str, comment: str, *, to: str, required: bool = False) -> Column:
    return Column(name, "BIGINT", comment, is_required=required, references=to)


def _run() -> Column:
    return _reference("run_id", RUN_COMMENT, to="run.run_id", required=True)


def _trace(comment: str = "Trace it was recorded in", required: bool = True) -> Column:
    return _reference("trace_id", comment, to="trace.trace_id", required=required)


def _process() -> Column:
    return _reference("process_id", "Process it lives in", to="process.process_id", required=True)


def _thread(
    comment: str = "Thread it happened on", name: str = "thread_id", required: bool = True
) -> Column:
    return _reference(name, comment, to="thread.thread_id", required=required)


def _time(
    name: str,
    comment: str,
    *,
    clock_of: str | None = None,
    required: bool = False,
    hidden: bool = False,
) -> Column:
    """A moment; `clock_of` is the column of the table that leads to the clock that showed it.

    The view has such times on the common axis, those without as they were recorded.
    """
    return Column(
        name,
        "BIGINT",
        comment,
        unit="epoch ns",
        is_required=required,
        is_public=not hidden,
        clock_of=clock_of,
    )


def _order(name: str, comment: str) -> Column:
    return Column(name, "BIGINT", comment, unit="event order", is_public=False)


def _text(name: str, comment: str, *, required: bool = False) -> Column:
    return Column(name, "VARCHAR", comment, is_required=required)


def _count(name: str, comment: str, *, unit: str | None = None) -> Column:
    return Column(name, "BIGINT", comment, unit=unit)


def _flag(name: str, comment: str, *, hidden: bool = False) -> Column:
    """A truth value, false where nobody says otherwise."""
    return Column(name, "BOOLEAN", comment, is_required=True, default="false", is_public=not hidden)


def _handle(name: str, comment: str) -> Column:
    return Column(name, "UBIGINT", f"{comment}; an address, valid in its process until reused")


def _route() -> Column:
    return Column(
        "route",
        "BIGINT[]",
        "Node (or, negative, process) that called, then services; empty: by no service",
        is_required=True,
    )


def _computed(name: str, type_: str, comment: str, *, sql: str) -> Column:
    """A column of the view alone, from those of the table, which is called `self`."""
    return Column(name, type_, comment, sql=sql)


def _table(name: str, comment: str, *parts: str | Column) -> Table:
    """Declare a table.

    Args:
        name: of the table, and of its public view.
        comment: what a row is.
        parts: what the public view is, where that shows the table as it is: the view is made of
            this declaration then; and the columns in order.
    """
    declared = tuple(part for part in parts if isinstance(part, Column))
    view = next((part for part in parts if isinstance(part, str)), None)
    columns = {column.name: column for column in declared if column.sql is None}
    TABLES[name] = Table(name, comment, view, declared, columns)
    return TABLES[name]


# --- the database itself -------------------------------------------------------------------------

definition = _table(
    "definition",
    "One row per part of the schema that is re-applied rather than migrated",
    Column(
        "name", "VARCHAR", "'views': the SQL of all views and macros", is_key=True, is_required=True
    ),
    _text("hash", "SHA-256 of the SQL that was last applied", required=True),
    _text("msgflow_version", "Version of msgflow that applied it", required=True),
)

# --- what was read -------------------------------------------------------------------------------

run = _table(
    "run",
    "One row per ingest of traces that belong together",
    _key("run_id", "Identity of the run"),
    _text(
        "name", "Name given by the user, or the name of the first trace directory", required=True
    ),
    Column("created_at", "TIMESTAMP", "When the run was ingested, UTC", is_required=True),
    _text("msgflow_version", "Version of msgflow that ingested the run", required=True),
    _text("derivation_hash", "SHA-256 of the SQL that derived the links", required=True),
    _time("start_ns", "First event of any trace"),
    _time("end_ns", "Last event of any trace"),
    _count("event_count", "Events read"),
    Column(
        "labels", "VARCHAR[]", "What users say of the run, KEY=VALUE each, sorted; NULL: nothing"
    ),
)

trace = _table(
    "trace",
    "One row per CTF trace read",
    "CTF traces that were read.",
    _key("trace_id", "Identity of the trace"),
    _run(),
    _reference("host_id", "Host that was traced", to="host.host_id", required=True),
    _text("path", "Directory as it was given", required=True),
    _text("uuid", "UUID of the trace"),
    _text("tracer", "Tracer and its version"),
    _text("domain", "'ust' or 'kernel'"),
    _time("start_ns", "First event or start of a packet", clock_of="host_id"),
    _time("end_ns", "Last event or end of a packet", clock_of="host_id"),
    _count("event_count", "Events read"),
    _count("discarded_event_count", "Events that the tracer counted as discarded"),
)

packet = _table(
    "packet",
    "One row per packet of a trace; the identity of what was read",
    _run(),
    _trace(),
    _count("stream_class_id", "Stream class (channel) of the packet"),
    _count("stream_instance_id", "Stream (buffer) of the packet"),
    Column("cpu_id", "INTEGER", "CPU that wrote the packet"),
    _count("position", "Position in its stream, from 0"),
    _time("begin_ns", "Begin of the packet"),
    _time("end_ns", "End of the packet"),
    _time("last_event_ns", "Last event in the packet"),
    _count("event_count", "Events in the packet"),
    _count("discarded_event_count", "Events lost in the packet, after its last event"),
    _count("lost_packet_count", "Packets missing right before it"),
)

gap = _table(
    "gap",
    "One row per gap in a trace",
    "Gaps in the traces: no two events are paired across one.",
    _run(),
    _trace("Trace it was recorded in; between two chunks of a recording, the later"),
    Column("cpu", "INTEGER", "CPU concerned; NULL: all"),
    _text(
        "kind",
        "'loss' (discarded events), 'packets' (lost packets) or 'pause' (not tracing)",
        required=True,
    ),
    _time("start_ns", "Last moment before the gap", clock_of="trace_id"),
    _time("end_ns", "First moment after the gap", clock_of="trace_id"),
    _count("event_count", "Events lost, where the tracer counted them"),
)

clock = _table(
    "clock",
    "One row per clock: hosts of one clock need no synchronisation",
    "Clocks and how their times are corrected. Times in the other views are corrected already.",
    _key("clock_id", "Identity of the clock"),
    _run(),
    _text("uuid", "UUID of the clock (LTTng: boot identity)"),
    Column(
        "offset_ns",
        "BIGINT",
        "Added to a time of this clock to correct it",
        unit="ns",
        is_required=True,
    ),
    Column(
        "drift_ppb",
        "BIGINT",
        "Added per unit of time since reference_ns",
        unit="1e-9",
        is_required=True,
    ),
    _time("reference_ns", "Moment at which the correction is offset_ns alone", required=True),
    _count("uncertainty_ns", "Bound of the error of the correction at reference_ns", unit="ns"),
    _text("method", "'none', 'messages', 'packets' or 'file'", required=True),
    _count(
        "drift_uncertainty_ppb",
        "Growth of the error bound per unit of time from reference_ns; "
        "NULL: the bound holds throughout, or is not known",
        unit="1e-9",
    ),
    _reference(
        "reference_clock_id",
        "Clock that this one is corrected to: times of clocks with the same one can be compared; "
        "NULL: as recorded",
        to="clock.clock_id",
    ),
)

clock_uncertainty = _table(
    "clock_uncertainty",
    "One row per clock and moment",
    "How wrong the correction of a clock can be at most, at any time: at the moments listed here "
    "by uncertainty_ns, between two of them by what the straight line between them gives. Times "
    "of two clocks with the same reference can be compared to within the sum of both bounds. The "
    "reference itself has no error and no rows.",
    _run(),
    _reference("clock_id", "The clock", to="clock.clock_id", required=True),
    _time("at_ns", "Moment, as the clock showed it", required=True),
    Column(
        "uncertainty_ns",
        "BIGINT",
        "Bound of the error of the correction at that moment",
        unit="ns",
        is_required=True,
    ),
)

host = _table(
    "host",
    "One row per machine or container",
    "Machines and containers.",
    _key("host_id", "Identity of the host"),
    _run(),
    _reference("clock_id", "Clock of the host", to="clock.clock_id", required=True),
    _text("hostname", "Name recorded in the trace, or given by the user", required=True),
)

process = _table(
    "process",
    "One row per process life",
    "Process lives: a pid that is used again is another process.",
    _key("process_id", "Identity of the process life"),
    _run(),
    _reference("host_id", "Host it ran on", to="host.host_id", required=True),
    Column(
        "pid",
        "INTEGER",
        "Process id; the one inside its PID namespace if the trace has no other",
        is_required=True,
    ),
    _text("name", "Name of the process (its first thread)"),
    _text("tracetools_version", "Version that rcl_init reported; for display only"),
    _time("first_seen_ns", "First event", clock_of="process_id"),
    _time("last_seen_ns", "Last event", clock_of="process_id"),
    Column("pid_namespace", "BIGINT", "PID namespace, where the trace has it"),
    Column(
        "life", "INTEGER", "Number of this life among those of the pid, from 1", is_required=True
    ),
)

thread = _table(
    "thread",
    "One row per thread",
    "Threads, each with its last name.",
    _key("thread_id", "Identity of the thread"),
    _run(),
    _process(),
    Column(
        "tid",
        "INTEGER",
        "Thread id; the one inside its PID namespace if the trace has no other",
        is_required=True,
    ),
    _text("name", "Name of the thread"),
    _order("first_event_id", "First event"),
    _order("last_event_id", "Last event"),
    _time("first_seen_ns", "First event", clock_of="process_id"),
    _time("last_seen_ns", "Last event", clock_of="process_id"),
)

# --- entities ------------------------------------------------------------------------------------


def _node_reference() -> Column:
    return _reference("node_id", "Node it belongs to", to="node.node_id")


node = _table(
    "node",
    "One row per ROS node",
    "ROS nodes.",
    _key("node_id", "Identity of the node"),
    _run(),
    _process(),
    _text("name", "Name without namespace"),
    _text("namespace", "Namespace, beginning with /"),
    _text("full_name", "Namespace and name"),
    _handle("node_handle", "rcl node handle"),
    _time("created_ns", "rcl_node_init", clock_of="process_id"),
    _flag("is_inferred", "Its initialisation was not traced"),
)

publisher = _table(
    "publisher",
    "One row per publisher",
    "Publishers, those of ROS itself marked as internal.",
    _key("publisher_id", "Identity of the publisher"),
    _run(),
    _process(),
    _node_reference(),
    _text("topic_name", "Fully expanded topic name"),
    _handle("publisher_handle", "rcl publisher handle"),
    _handle("rmw_handle", "rmw publisher handle"),
    Column("gid", "BLOB", "Global identifier, 16 bytes; NULL: none"),
    _count("queue_depth", "History depth asked for"),
    _time("created_ns", "First initialisation event", clock_of="process_id"),
    _flag("is_internal", "Infrastructure of ROS (/rosout, /parameter_events, ...)"),
    _flag("is_inferred", "Its initialisation was not traced"),
    _flag("is_topic_learned", "Its topic was deduced from a link", hidden=True),
)

subscription = _table(
    "subscription",
    "One row per subscription",
    "Subscriptions, those of ROS itself marked as internal.",
    _key("subscription_id", "Identity of the subscription"),
    _run(),
    _process(),
    _node_reference(),
    _text("topic_name", "Fully expanded topic name"),
    _handle("subscription_handle", "rcl subscription handle"),
    _handle("rmw_handle", "rmw subscription handle"),
    Column("gid", "BLOB", "Global identifier, 16 bytes; NULL: none"),
    _count("queue_depth", "History depth asked for"),
    _time("created_ns", "First initialisation event", clock_of="process_id"),
    _flag("is_internal", "Infrastructure of ROS (/parameter_events, /clock, ...)"),
    _flag("is_inferred", "Its initialisation was not traced"),
    _flag("is_topic_learned", "Its topic was deduced from a link", hidden=True),
)

timer = _table(
    "timer",
    "One row per timer",
    "Timers. If the initialisation of a timer was not traced, its period is not known.",
    _key("timer_id", "Identity of the timer"),
    _run(),
    _process(),
    _node_reference(),
    _count("period_ns", "Period; NULL: not known", unit="ns"),
    _handle("timer_handle", "rcl timer handle"),
    _time("created_ns", "rcl_timer_init", clock_of="process_id"),
    _computed(
        "is_inferred", "BOOLEAN", "Its initialisation was not traced", sql="self.created_ns IS NULL"
    ),
)

service = _table(
    "service",
    "One row per service",
    "Services, those of ROS itself marked as internal.",
    _key("service_id", "Identity of the service"),
    _run(),
    _process(),
    _node_reference(),
    _text("service_name", "Fully expanded service name"),
    _handle("service_handle", "rcl service handle"),
    _handle("rmw_handle", "rmw service handle"),
    Column("gid", "BLOB", "Global identifier, 16 bytes; NULL: none"),
    _time("created_ns", "rcl_service_init", clock_of="process_id"),
    _flag("is_internal", "Infrastructure of ROS (parameter and lifecycle services)"),
    _computed(
        "is_inferred", "BOOLEAN", "Its initialisation was not traced", sql="self.created_ns IS NULL"
    ),
)

client = _table(
    "client",
    "One row per service client",
    "Service clients, those of ROS itself marked as internal.",
    _key("client_id", "Identity of the client"),
    _run(),
    _process(),
    _node_reference(),
    _text("service_name", "Fully expanded service name"),
    _handle("client_handle", "rcl client handle"),
    _handle("rmw_handle", "rmw client handle"),
    Column("gid", "BLOB", "Identifier that servers see, 16 bytes; NULL: none"),
    _time("created_ns", "rcl_client_init", clock_of="process_id"),
    _flag("is_internal", "Infrastructure of ROS (parameter and lifecycle services)"),
    _computed(
        "is_inferred", "BOOLEAN", "Its initialisation was not traced", sql="self.created_ns IS NULL"
    ),
)

callback = _table(
    "callback",
    "One row per callback object",
    "Callback objects and what they belong to.",
    _key("callback_id", "Identity of the callback"),
    _run(),
    _process(),
    _node_reference(),
    _text("kind", "'subscription', 'timer', 'service' or 'unknown'", required=True),
    _reference("subscription_id", "Its subscription", to="subscription.subscription_id"),
    _reference("timer_id", "Its timer", to="timer.timer_id"),
    _reference("service_id", "Its service", to="service.service_id"),
    _handle("callback_handle", "Address of the callback object"),
    _text("symbol", "Function registered for it; NULL: none or unresolvable"),
    _time("created_ns", "First initialisation event", clock_of="process_id"),
)

executor = _table(
    "executor",
    "One row per executor",
    "Executors.",
    _key("executor_id", "Identity of the executor"),
    _run(),
    _process(),
    _text(
        "kind",
        "'single_threaded', 'multi_threaded', 'unknown', or as CARET names it",
        required=True,
    ),
    _flag("is_inferred", "Deduced from the threads that run the same callbacks"),
)

executor_thread = _table(
    "executor_thread",
    "One row per thread of an executor",
    "Threads of the executors.",
    _run(),
    _reference("executor_id", "The executor", to="executor.executor_id", required=True),
    _thread("The thread"),
)

callback_group = _table(
    "callback_group",
    "One row per callback group of an executor",
    "Callback groups, where the trace has them (CARET). Callbacks of a mutually exclusive group "
    "never run at the same time.",
    _key("callback_group_id", "Identity of the callback group"),
    _run(),
    _process(),
    _reference("executor_id", "Executor that it was added to", to="executor.executor_id"),
    _text(
        "kind", "'mutually_exclusive', 'reentrant' or 'unknown', as CARET names it", required=True
    ),
)

callback_group_member = _table(
    "callback_group_member",
    "One row per callback in a callback group",
    "Callbacks of the callback groups.",
    _run(),
    _reference(
        "callback_group_id",
        "The callback group",
        to="callback_group.callback_group_id",
        required=True,
    ),
    _reference("callback_id", "The callback", to="callback.callback_id", required=True),
)

annotation = _table(
    "annotation",
    "One row per declared indirect link",
    "Declared indirect links.",
    _key("annotation_id", "Identity of the annotation"),
    _run(),
    _text("kind", "'periodic_async' or 'partial_sync'", required=True),
    _text("source", "'trace' or 'file'", required=True),
    _process(),
)

annotation_input = _table(
    "annotation_input",
    "One row per subscription of an annotation",
    "Subscriptions of the declared indirect links.",
    _run(),
    _reference("annotation_id", "The annotation", to="annotation.annotation_id", required=True),
    _reference("subscription_id", "Its input", to="subscription.subscription_id", required=True),
)

annotation_output = _table(
    "annotation_output",
    "One row per publisher of an annotation",
    "Publishers of the declared indirect links.",
    _run(),
    _reference("annotation_id", "The annotation", to="annotation.annotation_id", required=True),
    _reference("publisher_id", "Its output", to="publisher.publisher_id", required=True),
)

lifecycle_transition = _table(
    "lifecycle_transition",
    "One row per state change of a managed node",
    "State changes of managed nodes.",
    _run(),
    _reference("node_id", "The node", to="node.node_id"),
    _time("at_ns", "Moment of the change", required=True, clock_of="node_id"),
    _text("start_state", "State that was left"),
    _text("goal_state", "State that was entered"),
)

diagnostic = _table(
    "diagnostic",
    "One row per finding",
    _run(),
    _trace("Trace it was recorded in; NULL: not one trace alone", required=False),
    _text("name", "What was found", required=True),
    _text("severity", "'info', 'warning', 'data_loss' or 'error'", required=True),
    _count("count", "How often"),
    _text("detail", "Where, and what it means"),
)

# --- instances -----------------------------------------------------------------------------------

publication = _table(
    "publication",
    "One row per publish() call",
    "Messages at the moment they were published, with the time of each layer seen.",
    _id("publication_id", "Identity of the publication"),
    _run(),
    _trace(),
    _reference(
        "publisher_id", "Publisher; NULL: the middleware itself", to="publisher.publisher_id"
    ),
    _process(),
    _thread(),
    _time("start_ns", "First layer seen", required=True, clock_of="process_id"),
    _time("end_ns", "Last layer seen", required=True, clock_of="process_id"),
    _time("intra_ns", "rclcpp_intra_publish", clock_of="process_id"),
    _time("rclcpp_ns", "rclcpp_publish", clock_of="process_id"),
    _time("rcl_ns", "rcl_publish", clock_of="process_id"),
    _time("rmw_ns", "rmw_publish", clock_of="process_id"),
    _time("dds_ns", "dds:write", clock_of="process_id"),
    _time("source_timestamp_ns", "Stamp that the middleware gave to the message, clock of ROS"),
    _order("start_event_id", "First layer seen"),
    _order("end_event_id", "Last layer seen"),
    _order("callback_event_id", "Last begin or end of a callback before it; NULL: none"),
    _flag("is_loss_affected", "A gap right before or after it on its thread may hide a layer"),
    _time(
        "next_event_ns",
        "Next event of the thread, where it has no stamp; NULL: none, or a gap may hide it",
        hidden=True,
    ),
)

take = _table(
    "take",
    "One row per message handed over to a subscription",
    "Messages at the moment they were handed over to a subscription.",
    _id("take_id", "Identity of the take"),
    _run(),
    _trace(),
    _reference("subscription_id", "Subscription", to="subscription.subscription_id"),
    _process(),
    _thread(),
    _time("taken_ns", "Moment of the hand-over", required=True, clock_of="process_id"),
    _time("source_timestamp_ns", "Stamp that came with the message, clock of ROS"),
    _text("method", "'rmw', 'ring_buffer', 'caret' or 'callback_only'", required=True),
    _order("start_event_id", "First layer seen"),
    _order("end_event_id", "Last layer seen"),
    _flag(
        "is_loss_affected",
        "A gap right before or after it on its thread may hide a layer or its callback",
    ),
)

failed_take = _table(
    "failed_take",
    "One row per attempt that took nothing",
    "Attempts to take from a subscription that got nothing.",
    _run(),
    _trace(),
    _reference("subscription_id", "Subscription", to="subscription.subscription_id"),
    _process(),
    _thread(),
    _time("failed_ns", "Moment of the attempt", required=True, clock_of="process_id"),
)

ring_buffer_event = _table(
    "ring_buffer_event",
    "One row per enqueue, dequeue or clearing of an intra-process ring buffer",
    _run(),
    _trace(),
    _process(),
    _text("kind", "'enqueue', 'dequeue' or 'clear'", required=True),
    _handle("buffer_handle", "Address of the ring buffer"),
    _count("slot", "Index in the buffer; NULL: all"),
    _time("at_ns", "Moment of the event", required=True),
    _reference(
        "publication_id",
        "Message put in; NULL: the replay of one kept for late subscriptions",
        to="publication.publication_id",
    ),
    _reference("take_id", "Message taken out", to="take.take_id"),
    _flag("is_overwriting", "An older message was lost from the slot"),
    _order("event_id", "The event"),
)

callback_instance = _table(
    "callback_instance",
    "One row per callback instance",
    "Callback instances.",
    _id("callback_instance_id", "Identity of the callback instance"),
    _run(),
    _trace(),
    _reference("callback_id", "Callback that ran", to="callback.callback_id", required=True),
    _process(),
    _thread(),
    _time("start_ns", "callback_start", required=True, clock_of="process_id"),
    _time("end_ns", "callback_end; NULL: never seen to end", clock_of="process_id"),
    _reference("take_id", "Message it was called with", to="take.take_id"),
    _reference("request_id", "Request it was called with", to="request.request_id"),
    _flag("is_intra_process", "Called with an intra-process message"),
    _reference(
        "parent_id",
        "Callback instance that it is nested in",
        to="callback_instance.callback_instance_id",
    ),
    Column("depth", "INTEGER", "Nesting depth on its thread, from 1", is_required=True),
    _order("start_event_id", "callback_start"),
    _order("end_event_id", "callback_end; NULL: never seen to end"),
    _order("effective_end_event_id", "callback_end, else the first event that cannot be inside"),
    _flag(
        "is_loss_affected",
        "A gap inside or beside it on its thread may hide its end or what it did",
    ),
)

request = _table(
    "request",
    "One row per service request",
    "Service requests.",
    _id("request_id", "Identity of the request"),
    _run(),
    _reference("client_id", "Client that sent it", to="client.client_id"),
    _reference("service_id", "Service that took it", to="service.service_id"),
    _count("sequence_number", "Number given by the client"),
    _time("sent_ns", "rmw_send_request", clock_of="sender_thread_id"),
    _time("taken_ns", "rmw_take_request", clock_of="receiver_thread_id"),
    _thread("Thread that sent it", "sender_thread_id", required=False),
    _thread("Thread that took it", "receiver_thread_id", required=False),
    _reference(
        "callback_instance_id",
        "Service callback it led to",
        to="callback_instance.callback_instance_id",
    ),
)

response = _table(
    "response",
    "One row per service response",
    "Service responses.",
    _id("response_id", "Identity of the response"),
    _run(),
    _reference("client_id", "Client that took it", to="client.client_id"),
    _reference("service_id", "Service that sent it", to="service.service_id"),
    _count("sequence_number", "Number given by the client"),
    _time("sent_ns", "rmw_send_response", clock_of="sender_thread_id"),
    _time("taken_ns", "rmw_take_response", clock_of="receiver_thread_id"),
    _thread("Thread that sent it", "sender_thread_id", required=False),
    _thread("Thread that took it", "receiver_thread_id", required=False),
    _reference(
        "callback_instance_id",
        "Service callback it came from",
        to="callback_instance.callback_instance_id",
    ),
    _reference("request_id", "Request that it answers", to="request.request_id"),
)

executor_state = _table(
    "executor_state",
    "One row per interval between two executor events of a thread",
    "What executor threads did, as their three events literally say.",
    _run(),
    _reference("executor_id", "Executor", to="executor.executor_id"),
    _thread(),
    _text("state", "'wait', 'process' or 'execute'", required=True),
    _time("start_ns", "Executor event that began it", required=True, clock_of="thread_id"),
    _time(
        "end_ns",
        "Next executor event of the thread; NULL: not known (the last, or a gap follows)",
        clock_of="thread_id",
    ),
    _reference(
        "callback_instance_id",
        "First callback instance in it",
        to="callback_instance.callback_instance_id",
    ),
    _order("start_event_id", "Executor event that began it"),
)

thread_break = _table(
    "thread_break",
    "One row per gap in the record of a thread",
    "Where the record of a thread breaks: events of the thread may be missing before these "
    "moments. No executor state reaches across a break, and pairs of events that do are marked.",
    _run(),
    _thread("Thread whose events may be missing"),
    _time(
        "resumed_ns",
        "First event of the thread behind the gap",
        required=True,
        clock_of="thread_id",
    ),
    _order("resumed_event_id", "First event of the thread behind the gap"),
    _flag(
        "is_elsewhere",
        "Only other CPUs lost events, which the thread may have visited meanwhile: "
        "pairs may reach across",
    ),
)

# --- links ---------------------------------------------------------------------------------------

stamp_clock = _table(
    "stamp_clock",
    "One row per stretch of time in which stamps run along a clock of the traces",
    _run(),
    _reference("clock_id", "Clock of the traces", to="clock.clock_id", required=True),
    _time("at_ns", "Middle of the stretch, time of the traces", required=True),
    _time("start_ns", "Begin of the stretch", required=True),
    _time("end_ns", "End of the stretch, exclusive", required=True),
    Column(
        "difference_ns",
        "BIGINT",
        "Clock of ROS less clock of the traces, with the shortest delay of a stamp",
        unit="ns",
        is_required=True,
    ),
    _count("drift_ppb", "Change of the difference in the stretch", unit="ppb"),
    _count("message_count", "Messages that agree with it"),
    _count("segment", "Number of jumps of the clock before it"),
    Column(
        "is_sharp",
        "BOOLEAN",
        "The drift is known: publications microseconds apart are told apart; NULL: yes",
    ),
)

nearest_message = _table(
    "nearest_message",
    "One row per message whose publication was found, or could not be told, by time",
    _run(),
    _text("topic_name", "Topic of the message", required=True),
    _time("source_timestamp_ns", "Stamp of the message, clock of ROS", required=True),
    _reference(
        "publication_id",
        "Where it came from; NULL: several could be it",
        to="publication.publication_id",
    ),
    _count("candidate_count", "Publications that it could have been"),
)

link_transport = _table(
    "link_transport",
    "One row per take whose publication is known",
    _run(),
    _reference(
        "publication_id",
        "Where the message came from",
        to="publication.publication_id",
        required=True,
    ),
    _reference("take_id", "Where it was received", to="take.take_id", required=True),
    _reference("publisher_id", "Publisher of the message", to="publisher.publisher_id"),
    _reference(
        "subscription_id",
        "Subscription that received it",
        to="subscription.subscription_id",
    ),
    _text("method", "'exact', 'exact_stamp', 'nearest' or 'ring_buffer'", required=True),
    _count("candidate_count", "Number of publications that are possible"),
    _flag("is_self_loop", "Received by the publishing node itself"),
    _flag("is_loss_affected", "A gap of the trace may hide a better partner"),
    _flag("is_copy", "A ring buffer carries the same message: no callback gets this one"),
)

link_packet = _table(
    "link_packet",
    "One row per network packet and clock that received it from another",
    _run(),
    _reference("sent_trace_id", "Trace of its sender", to="trace.trace_id", required=True),
    _reference("received_trace_id", "Trace of its receiver", to="trace.trace_id", required=True),
    _time("sent_ns", "Handed to the network device", required=True),
    _time("received_ns", "Came from the network device", required=True),
    _text("protocol", "'tcp' or 'udp'", required=True),
    _text("source_address", "IP address that it was sent from", required=True),
    Column("source_port", "INTEGER", "Port that it was sent from", is_required=True),
    _text("destination_address", "IP address that it was sent to", required=True),
    Column("destination_port", "INTEGER", "Port that it was sent to", is_required=True),
    Column("identification", "INTEGER", "Identification of the datagram; NULL: IPv6 has none"),
    _count("sequence_number", "Sequence number of its first byte; NULL: not TCP"),
)

link_causal = _table(
    "link_causal",
    "One row per callback instance, or take outside of any, and publication that it led to",
    _run(),
    _reference(
        "callback_instance_id",
        "Cause; NULL: the take itself",
        to="callback_instance.callback_instance_id",
    ),
    _reference("publication_id", "Effect", to="publication.publication_id", required=True),
    _reference(
        "take_id", "Message that led to it; NULL: none (timers, services)", to="take.take_id"
    ),
    _reference(
        "subscription_id", "Subscription of that message", to="subscription.subscription_id"
    ),
    _reference("publisher_id", "Publisher of the effect", to="publisher.publisher_id"),
    _text("kind", "'direct', 'periodic_async', 'partial_sync' or 'take_adjacent'", required=True),
    _reference(
        "annotation_id",
        "Annotation that declares it; NULL for direct links",
        to="annotation.annotation_id",
    ),
    _count(
        "candidate_count",
        "Callback instances that it could have been; one more if it is the input of an indirect "
        "link and had no message when the publishing callback began",
    ),
    _flag("is_loss_affected", "A gap of the trace may hide a better partner"),
)

link_request = _table(
    "link_request",
    "One row per request that a callback instance or thread sent",
    "Requests and what sent them.",
    _run(),
    _reference("request_id", "Effect", to="request.request_id", required=True),
    _reference("callback_instance_id", "Cause", to="callback_instance.callback_instance_id"),
)

link_response = _table(
    "link_response",
    "One row per response and the callback instance that sent it",
    "Responses and the callback instance that sent them.",
    _run(),
    _reference("response_id", "Effect", to="response.response_id", required=True),
    _reference("callback_instance_id", "Cause", to="callback_instance.callback_instance_id"),
)

# --- what is missing -----------------------------------------------------------------------------

undelivered = _table(
    "undelivered",
    "One row per publication and subscription of its topic that is not known to have taken it",
    _run(),
    _reference(
        "publication_id",
        "The message",
        to="publication.publication_id",
        required=True,
    ),
    _reference("publisher_id", "Its publisher", to="publisher.publisher_id", required=True),
    _reference(
        "subscription_id",
        "Who did not take it",
        to="subscription.subscription_id",
        required=True,
    ),
    _text("reason", "Why; a closed vocabulary", required=True),
)

orphan_take = _table(
    "orphan_take",
    "One row per take whose publication is not known",
    _run(),
    _reference("take_id", "The take", to="take.take_id", required=True),
    _reference(
        "subscription_id", "Subscription that received it", to="subscription.subscription_id"
    ),
    _text("reason", "Why; a closed vocabulary", required=True),
)
# --- the graph of flows --------------------------------------------------------------------------

flow_call = _table(
    "flow_call",
    "One row per publication of a service, callback instance that called for it, and way it did so",
    _run(),
    _reference(
        "publication_id", "What was published", to="publication.publication_id", required=True
    ),
    _reference("publisher_id", "Its publisher", to="publisher.publisher_id"),
    _text("kind", "Kind of the causal link to the publication", required=True),
    _reference(
        "callback_instance_id",
        "Callback instance of the service",
        to="callback_instance.callback_instance_id",
        required=True,
    ),
    _reference(
        "caller_id",
        "Callback instance that called",
        to="callback_instance.callback_instance_id",
        required=True,
    ),
    _route(),
    _reference("take_id", "Message that the caller was for; NULL: none", to="take.take_id"),
    _reference(
        "subscription_id", "Subscription of that message", to="subscription.subscription_id"
    ),
)

flow_root = _table(
    "flow_root",
    "One row per publication on a topic of the application",
    _run(),
    _reference("publication_id", "The message", to="publication.publication_id", required=True),
    _reference("publisher_id", "Its publisher", to="publisher.publisher_id", required=True),
    _flag("is_source", "No message that was taken led to it"),
    _text("root_kind", "'callback_instance' or 'publication'", required=True),
    Column(
        "root_id", "BIGINT", "Where its flow can be said to begin, of that kind", is_required=True
    ),
    _route(),
)

flow_hop = _table(
    "flow_hop",
    "One row per step of the graph: subscription before, route, publisher and subscription",
    _run(),
    _reference(
        "from_subscription_id",
        "Subscription whose message led on; NULL: none",
        to="subscription.subscription_id",
    ),
    _route(),
    _reference("publisher_id", "Publisher", to="publisher.publisher_id", required=True),
    _reference(
        "subscription_id",
        "Subscription that took from it",
        to="subscription.subscription_id",
        required=True,
    ),
    _flag("is_source", "Some publication of it was led to by no message"),
    _flag("is_cached", "The message may wait in the node for others"),
)
