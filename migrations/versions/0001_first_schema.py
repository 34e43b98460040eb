"""The first schema: identity, entities, instances, links.

Frozen: it does not follow later changes of msgflow/db/tables.py.
"""

import sqlalchemy as sa
from alembic import op
from duckdb_engine.datatypes import UBigInteger

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Create every table of the first schema."""
    op.create_table(
        "definition",
        sa.Column(
            "name",
            sa.String(),
            primary_key=True,
            autoincrement=False,
            comment="'views': the SQL of all views and macros",
        ),
        sa.Column(
            "hash", sa.String(), nullable=False, comment="SHA-256 of the SQL that was last applied"
        ),
        sa.Column(
            "msgflow_version",
            sa.String(),
            nullable=False,
            comment="Version of msgflow that applied it",
        ),
        schema="store",
        comment="One row per part of the schema that is re-applied rather than migrated",
    )
    op.create_table(
        "run",
        sa.Column(
            "run_id",
            sa.BigInteger(),
            primary_key=True,
            autoincrement=False,
            comment="Identity of the run",
        ),
        sa.Column(
            "name",
            sa.String(),
            nullable=False,
            comment="Name given by the user, or the name of the first trace directory",
        ),
        sa.Column(
            "created_at", sa.TIMESTAMP(), nullable=False, comment="When the run was ingested, UTC"
        ),
        sa.Column(
            "msgflow_version",
            sa.String(),
            nullable=False,
            comment="Version of msgflow that ingested the run",
        ),
        sa.Column(
            "derivation_hash",
            sa.String(),
            nullable=False,
            comment="SHA-256 of the SQL that derived the links",
        ),
        sa.Column("start_ns", sa.BigInteger(), comment="First event of any trace [epoch ns]"),
        sa.Column("end_ns", sa.BigInteger(), comment="Last event of any trace [epoch ns]"),
        sa.Column("event_count", sa.BigInteger(), comment="Events read"),
        schema="store",
        comment="One row per ingest of traces that belong together",
    )
    op.create_table(
        "trace",
        sa.Column(
            "trace_id",
            sa.BigInteger(),
            primary_key=True,
            autoincrement=False,
            comment="Identity of the trace",
        ),
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("host_id", sa.BigInteger(), nullable=False, comment="Host that was traced"),
        sa.Column("path", sa.String(), nullable=False, comment="Directory as it was given"),
        sa.Column("uuid", sa.String(), comment="UUID of the trace"),
        sa.Column("tracer", sa.String(), comment="Tracer and its version"),
        sa.Column("domain", sa.String(), comment="'ust' or 'kernel'"),
        sa.Column("start_ns", sa.BigInteger(), comment="First event or packet begin [epoch ns]"),
        sa.Column("end_ns", sa.BigInteger(), comment="Last event or packet end [epoch ns]"),
        sa.Column("event_count", sa.BigInteger(), comment="Events read"),
        sa.Column(
            "discarded_event_count",
            sa.BigInteger(),
            comment="Events that the tracer counted as discarded",
        ),
        schema="store",
        comment="One row per CTF trace read",
    )
    op.create_table(
        "packet",
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("trace_id", sa.BigInteger(), nullable=False, comment="Trace it was recorded in"),
        sa.Column(
            "stream_class_id", sa.BigInteger(), comment="Stream class (channel) of the packet"
        ),
        sa.Column("stream_instance_id", sa.BigInteger(), comment="Stream (buffer) of the packet"),
        sa.Column("cpu_id", sa.Integer(), comment="CPU that wrote the packet"),
        sa.Column("position", sa.BigInteger(), comment="Position in its stream, from 0"),
        sa.Column("begin_ns", sa.BigInteger(), comment="Begin of the packet [epoch ns]"),
        sa.Column("end_ns", sa.BigInteger(), comment="End of the packet [epoch ns]"),
        sa.Column("last_event_ns", sa.BigInteger(), comment="Last event in the packet [epoch ns]"),
        sa.Column("event_count", sa.BigInteger(), comment="Events in the packet"),
        sa.Column(
            "discarded_event_count",
            sa.BigInteger(),
            comment="Events lost in the packet, after its last event",
        ),
        sa.Column("lost_packet_count", sa.BigInteger(), comment="Packets missing right before it"),
        schema="store",
        comment="One row per packet of a trace; the identity of what was read",
    )
    op.create_table(
        "loss_interval",
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("trace_id", sa.BigInteger(), nullable=False, comment="Trace it was recorded in"),
        sa.Column("cpu", sa.Integer(), comment="CPU concerned; NULL: all"),
        sa.Column(
            "kind",
            sa.String(),
            nullable=False,
            comment="'loss' (discarded events), 'packets' (lost packets) or 'pause' (not tracing)",
        ),
        sa.Column("start_ns", sa.BigInteger(), comment="Last moment before the gap [epoch ns]"),
        sa.Column("end_ns", sa.BigInteger(), comment="First moment after the gap [epoch ns]"),
        sa.Column(
            "event_count", sa.BigInteger(), comment="Events lost, where the tracer counted them"
        ),
        schema="store",
        comment="One row per gap in a trace",
    )
    op.create_table(
        "clock",
        sa.Column(
            "clock_id",
            sa.BigInteger(),
            primary_key=True,
            autoincrement=False,
            comment="Identity of the clock",
        ),
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("uuid", sa.String(), comment="UUID of the clock (LTTng: boot identity)"),
        sa.Column(
            "offset_ns",
            sa.BigInteger(),
            nullable=False,
            comment="Added to a time of this clock to correct it [ns]",
        ),
        sa.Column(
            "drift_ppb",
            sa.BigInteger(),
            nullable=False,
            comment="Added per elapsed time since reference_ns [1e-9]",
        ),
        sa.Column(
            "reference_ns",
            sa.BigInteger(),
            nullable=False,
            comment="Moment at which the correction is offset_ns alone [epoch ns]",
        ),
        sa.Column(
            "uncertainty_ns", sa.BigInteger(), comment="Bound of the error of the correction [ns]"
        ),
        sa.Column(
            "method", sa.String(), nullable=False, comment="'none', 'messages', 'packets' or 'file'"
        ),
        schema="store",
        comment="One row per clock: hosts of one clock need no synchronisation",
    )
    op.create_table(
        "host",
        sa.Column(
            "host_id",
            sa.BigInteger(),
            primary_key=True,
            autoincrement=False,
            comment="Identity of the host",
        ),
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("clock_id", sa.BigInteger(), nullable=False, comment="Clock of the host"),
        sa.Column(
            "hostname",
            sa.String(),
            nullable=False,
            comment="Name recorded in the trace, or given by the user",
        ),
        schema="store",
        comment="One row per machine or container",
    )
    op.create_table(
        "process",
        sa.Column(
            "process_id",
            sa.BigInteger(),
            primary_key=True,
            autoincrement=False,
            comment="Identity of the process life",
        ),
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("host_id", sa.BigInteger(), nullable=False, comment="Host it ran on"),
        sa.Column(
            "pid",
            sa.Integer(),
            nullable=False,
            comment="Process id, virtual where the trace has no other",
        ),
        sa.Column("name", sa.String(), comment="Name of the process (its first thread)"),
        sa.Column(
            "tracetools_version",
            sa.String(),
            comment="Version that rcl_init stated; for display only",
        ),
        sa.Column("first_seen_ns", sa.BigInteger(), comment="First event [epoch ns]"),
        sa.Column("last_seen_ns", sa.BigInteger(), comment="Last event [epoch ns]"),
        sa.Column(
            "pid_namespace", sa.BigInteger(), comment="PID namespace, where the trace has it"
        ),
        sa.Column(
            "life",
            sa.Integer(),
            nullable=False,
            comment="Number of the life among those of one pid, from 1",
        ),
        schema="store",
        comment="One row per process life",
    )
    op.create_table(
        "thread",
        sa.Column(
            "thread_id",
            sa.BigInteger(),
            primary_key=True,
            autoincrement=False,
            comment="Identity of the thread",
        ),
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("process_id", sa.BigInteger(), nullable=False, comment="Process it lives in"),
        sa.Column(
            "tid",
            sa.Integer(),
            nullable=False,
            comment="Thread id, virtual where the trace has no other",
        ),
        sa.Column("name", sa.String(), comment="Name of the thread"),
        sa.Column("first_event_id", sa.BigInteger(), comment="First event [event order]"),
        sa.Column("last_event_id", sa.BigInteger(), comment="Last event [event order]"),
        sa.Column("first_seen_ns", sa.BigInteger(), comment="First event [epoch ns]"),
        sa.Column("last_seen_ns", sa.BigInteger(), comment="Last event [epoch ns]"),
        schema="store",
        comment="One row per thread",
    )
    op.create_table(
        "node",
        sa.Column(
            "node_id",
            sa.BigInteger(),
            primary_key=True,
            autoincrement=False,
            comment="Identity of the node",
        ),
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("process_id", sa.BigInteger(), nullable=False, comment="Process it lives in"),
        sa.Column("name", sa.String(), comment="Name without namespace"),
        sa.Column("namespace", sa.String(), comment="Namespace, beginning with /"),
        sa.Column("full_name", sa.String(), comment="Namespace and name"),
        sa.Column(
            "node_handle",
            UBigInteger(),
            comment="rcl node handle; an address, valid in its process until reused",
        ),
        sa.Column("created_ns", sa.BigInteger(), comment="rcl_node_init [epoch ns]"),
        sa.Column(
            "is_inferred", sa.Boolean(), nullable=False, comment="Its initialisation was not traced"
        ),
        schema="store",
        comment="One row per ROS node",
    )
    op.create_table(
        "publisher",
        sa.Column(
            "publisher_id",
            sa.BigInteger(),
            primary_key=True,
            autoincrement=False,
            comment="Identity of the publisher",
        ),
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("process_id", sa.BigInteger(), nullable=False, comment="Process it lives in"),
        sa.Column("node_id", sa.BigInteger(), comment="Node it belongs to"),
        sa.Column("topic_name", sa.String(), comment="Fully expanded topic name"),
        sa.Column(
            "publisher_handle",
            UBigInteger(),
            comment="rcl publisher handle; an address, valid in its process until reused",
        ),
        sa.Column(
            "rmw_handle",
            UBigInteger(),
            comment="rmw publisher handle; an address, valid in its process until reused",
        ),
        sa.Column("gid", sa.LargeBinary(), comment="Global identifier, 16 bytes; NULL: none"),
        sa.Column("queue_depth", sa.BigInteger(), comment="History depth asked for"),
        sa.Column("created_ns", sa.BigInteger(), comment="First initialisation event [epoch ns]"),
        sa.Column(
            "is_internal",
            sa.Boolean(),
            nullable=False,
            comment="Infrastructure of ROS (/rosout, /parameter_events, ...)",
        ),
        sa.Column(
            "is_inferred", sa.Boolean(), nullable=False, comment="Its initialisation was not traced"
        ),
        sa.Column(
            "is_topic_learned", sa.Boolean(), comment="Its topic was deduced from a link; NULL: no"
        ),
        schema="store",
        comment="One row per publisher",
    )
    op.create_table(
        "subscription",
        sa.Column(
            "subscription_id",
            sa.BigInteger(),
            primary_key=True,
            autoincrement=False,
            comment="Identity of the subscription",
        ),
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("process_id", sa.BigInteger(), nullable=False, comment="Process it lives in"),
        sa.Column("node_id", sa.BigInteger(), comment="Node it belongs to"),
        sa.Column("topic_name", sa.String(), comment="Fully expanded topic name"),
        sa.Column(
            "subscription_handle",
            UBigInteger(),
            comment="rcl subscription handle; an address, valid in its process until reused",
        ),
        sa.Column(
            "rmw_handle",
            UBigInteger(),
            comment="rmw subscription handle; an address, valid in its process until reused",
        ),
        sa.Column("gid", sa.LargeBinary(), comment="Global identifier, 16 bytes; NULL: none"),
        sa.Column("queue_depth", sa.BigInteger(), comment="History depth asked for"),
        sa.Column("created_ns", sa.BigInteger(), comment="First initialisation event [epoch ns]"),
        sa.Column(
            "is_internal",
            sa.Boolean(),
            nullable=False,
            comment="Infrastructure of ROS (/parameter_events, /clock, ...)",
        ),
        sa.Column(
            "is_inferred", sa.Boolean(), nullable=False, comment="Its initialisation was not traced"
        ),
        sa.Column(
            "is_topic_learned", sa.Boolean(), comment="Its topic was deduced from a link; NULL: no"
        ),
        schema="store",
        comment="One row per subscription",
    )
    op.create_table(
        "timer",
        sa.Column(
            "timer_id",
            sa.BigInteger(),
            primary_key=True,
            autoincrement=False,
            comment="Identity of the timer",
        ),
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("process_id", sa.BigInteger(), nullable=False, comment="Process it lives in"),
        sa.Column("node_id", sa.BigInteger(), comment="Node it belongs to"),
        sa.Column("period_ns", sa.BigInteger(), comment="Period [ns]"),
        sa.Column(
            "timer_handle",
            UBigInteger(),
            comment="rcl timer handle; an address, valid in its process until reused",
        ),
        sa.Column("created_ns", sa.BigInteger(), comment="rcl_timer_init [epoch ns]"),
        schema="store",
        comment="One row per timer",
    )
    op.create_table(
        "service",
        sa.Column(
            "service_id",
            sa.BigInteger(),
            primary_key=True,
            autoincrement=False,
            comment="Identity of the service",
        ),
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("process_id", sa.BigInteger(), nullable=False, comment="Process it lives in"),
        sa.Column("node_id", sa.BigInteger(), comment="Node it belongs to"),
        sa.Column("service_name", sa.String(), comment="Fully expanded service name"),
        sa.Column(
            "service_handle",
            UBigInteger(),
            comment="rcl service handle; an address, valid in its process until reused",
        ),
        sa.Column(
            "rmw_handle",
            UBigInteger(),
            comment="rmw service handle; an address, valid in its process until reused",
        ),
        sa.Column("gid", sa.LargeBinary(), comment="Global identifier, 16 bytes; NULL: none"),
        sa.Column("created_ns", sa.BigInteger(), comment="rcl_service_init [epoch ns]"),
        sa.Column(
            "is_internal",
            sa.Boolean(),
            nullable=False,
            comment="Infrastructure of ROS (parameter and lifecycle services)",
        ),
        schema="store",
        comment="One row per service",
    )
    op.create_table(
        "client",
        sa.Column(
            "client_id",
            sa.BigInteger(),
            primary_key=True,
            autoincrement=False,
            comment="Identity of the client",
        ),
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("process_id", sa.BigInteger(), nullable=False, comment="Process it lives in"),
        sa.Column("node_id", sa.BigInteger(), comment="Node it belongs to"),
        sa.Column("service_name", sa.String(), comment="Fully expanded service name"),
        sa.Column(
            "client_handle",
            UBigInteger(),
            comment="rcl client handle; an address, valid in its process until reused",
        ),
        sa.Column(
            "rmw_handle",
            UBigInteger(),
            comment="rmw client handle; an address, valid in its process until reused",
        ),
        sa.Column(
            "gid", sa.LargeBinary(), comment="Identifier that servers see, 16 bytes; NULL: none"
        ),
        sa.Column("created_ns", sa.BigInteger(), comment="rcl_client_init [epoch ns]"),
        sa.Column(
            "is_internal",
            sa.Boolean(),
            nullable=False,
            comment="Infrastructure of ROS (parameter and lifecycle services)",
        ),
        schema="store",
        comment="One row per service client",
    )
    op.create_table(
        "callback",
        sa.Column(
            "callback_id",
            sa.BigInteger(),
            primary_key=True,
            autoincrement=False,
            comment="Identity of the callback",
        ),
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("process_id", sa.BigInteger(), nullable=False, comment="Process it lives in"),
        sa.Column("node_id", sa.BigInteger(), comment="Node it belongs to"),
        sa.Column(
            "kind",
            sa.String(),
            nullable=False,
            comment="'subscription', 'timer', 'service' or 'unknown'",
        ),
        sa.Column("subscription_id", sa.BigInteger(), comment="Its subscription"),
        sa.Column("timer_id", sa.BigInteger(), comment="Its timer"),
        sa.Column("service_id", sa.BigInteger(), comment="Its service"),
        sa.Column(
            "callback_handle",
            UBigInteger(),
            comment="Address of the callback object; an address, valid in its process until reused",
        ),
        sa.Column(
            "symbol", sa.String(), comment="Function registered for it; NULL: none or unresolvable"
        ),
        sa.Column("created_ns", sa.BigInteger(), comment="First initialisation event [epoch ns]"),
        schema="store",
        comment="One row per callback object",
    )
    op.create_table(
        "executor",
        sa.Column(
            "executor_id",
            sa.BigInteger(),
            primary_key=True,
            autoincrement=False,
            comment="Identity of the executor",
        ),
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("process_id", sa.BigInteger(), nullable=False, comment="Process it lives in"),
        sa.Column(
            "kind",
            sa.String(),
            nullable=False,
            comment="'single_threaded', 'multi_threaded', 'unknown', or as CARET names it",
        ),
        sa.Column(
            "is_inferred",
            sa.Boolean(),
            nullable=False,
            comment="Deduced from the threads that run the same callbacks",
        ),
        schema="store",
        comment="One row per executor",
    )
    op.create_table(
        "executor_thread",
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("executor_id", sa.BigInteger(), nullable=False, comment="The executor"),
        sa.Column("thread_id", sa.BigInteger(), nullable=False, comment="The thread"),
        schema="store",
        comment="One row per thread of an executor",
    )
    op.create_table(
        "annotation",
        sa.Column(
            "annotation_id",
            sa.BigInteger(),
            primary_key=True,
            autoincrement=False,
            comment="Identity of the annotation",
        ),
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column(
            "kind", sa.String(), nullable=False, comment="'periodic_async' or 'partial_sync'"
        ),
        sa.Column("source", sa.String(), nullable=False, comment="'trace' or 'file'"),
        sa.Column("process_id", sa.BigInteger(), nullable=False, comment="Process it lives in"),
        schema="store",
        comment="One row per declared indirect link",
    )
    op.create_table(
        "annotation_input",
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("annotation_id", sa.BigInteger(), nullable=False, comment="The annotation"),
        sa.Column("subscription_id", sa.BigInteger(), nullable=False, comment="Its input"),
        schema="store",
        comment="One row per subscription of an annotation",
    )
    op.create_table(
        "annotation_output",
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("annotation_id", sa.BigInteger(), nullable=False, comment="The annotation"),
        sa.Column("publisher_id", sa.BigInteger(), nullable=False, comment="Its output"),
        schema="store",
        comment="One row per publisher of an annotation",
    )
    op.create_table(
        "lifecycle_transition",
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("node_id", sa.BigInteger(), comment="The node"),
        sa.Column(
            "at_ns", sa.BigInteger(), nullable=False, comment="Moment of the change [epoch ns]"
        ),
        sa.Column("start_state", sa.String(), comment="State that was left"),
        sa.Column("goal_state", sa.String(), comment="State that was entered"),
        schema="store",
        comment="One row per state change of a managed node",
    )
    op.create_table(
        "diagnostic",
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("trace_id", sa.BigInteger(), comment="Trace it was recorded in"),
        sa.Column(
            "name", sa.String(), nullable=False, comment="What was found; a closed vocabulary"
        ),
        sa.Column(
            "severity",
            sa.String(),
            nullable=False,
            comment="'info', 'warning', 'data_loss' or 'error'",
        ),
        sa.Column("count", sa.BigInteger(), comment="How often"),
        sa.Column("detail", sa.String(), comment="Where, and what it means"),
        schema="store",
        comment="One row per thing worth knowing about the input",
    )
    op.create_table(
        "publication",
        sa.Column(
            "publication_id", sa.BigInteger(), nullable=False, comment="Identity of the publication"
        ),
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("trace_id", sa.BigInteger(), nullable=False, comment="Trace it was recorded in"),
        sa.Column(
            "publisher_id", sa.BigInteger(), comment="Publisher; NULL: the middleware itself"
        ),
        sa.Column("process_id", sa.BigInteger(), nullable=False, comment="Process it lives in"),
        sa.Column("thread_id", sa.BigInteger(), nullable=False, comment="Thread it happened on"),
        sa.Column(
            "start_ns", sa.BigInteger(), nullable=False, comment="First layer seen [epoch ns]"
        ),
        sa.Column("end_ns", sa.BigInteger(), nullable=False, comment="Last layer seen [epoch ns]"),
        sa.Column("intra_ns", sa.BigInteger(), comment="rclcpp_intra_publish [epoch ns]"),
        sa.Column("rclcpp_ns", sa.BigInteger(), comment="rclcpp_publish [epoch ns]"),
        sa.Column("rcl_ns", sa.BigInteger(), comment="rcl_publish [epoch ns]"),
        sa.Column("rmw_ns", sa.BigInteger(), comment="rmw_publish [epoch ns]"),
        sa.Column("dds_ns", sa.BigInteger(), comment="dds:write [epoch ns]"),
        sa.Column(
            "source_timestamp_ns",
            sa.BigInteger(),
            comment="Stamp that the middleware sent along, clock of ROS [epoch ns]",
        ),
        sa.Column("start_event_id", sa.BigInteger(), comment="First layer seen [event order]"),
        sa.Column("end_event_id", sa.BigInteger(), comment="Last layer seen [event order]"),
        schema="store",
        comment="One row per publish() call",
    )
    op.create_table(
        "take",
        sa.Column("take_id", sa.BigInteger(), nullable=False, comment="Identity of the take"),
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("trace_id", sa.BigInteger(), nullable=False, comment="Trace it was recorded in"),
        sa.Column("subscription_id", sa.BigInteger(), comment="Subscription"),
        sa.Column("process_id", sa.BigInteger(), nullable=False, comment="Process it lives in"),
        sa.Column("thread_id", sa.BigInteger(), nullable=False, comment="Thread it happened on"),
        sa.Column(
            "taken_ns",
            sa.BigInteger(),
            nullable=False,
            comment="Moment of the hand-over [epoch ns]",
        ),
        sa.Column(
            "source_timestamp_ns",
            sa.BigInteger(),
            comment="Stamp that came with the message, clock of ROS [epoch ns]",
        ),
        sa.Column(
            "method",
            sa.String(),
            nullable=False,
            comment="'rmw', 'ring_buffer', 'caret' or 'callback_only'",
        ),
        sa.Column("start_event_id", sa.BigInteger(), comment="First layer seen [event order]"),
        sa.Column("end_event_id", sa.BigInteger(), comment="Last layer seen [event order]"),
        schema="store",
        comment="One row per message handed over to a subscription",
    )
    op.create_table(
        "callback_instance",
        sa.Column(
            "callback_instance_id", sa.BigInteger(), nullable=False, comment="Identity of the run"
        ),
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("trace_id", sa.BigInteger(), nullable=False, comment="Trace it was recorded in"),
        sa.Column("callback_id", sa.BigInteger(), nullable=False, comment="Callback that ran"),
        sa.Column("process_id", sa.BigInteger(), nullable=False, comment="Process it lives in"),
        sa.Column("thread_id", sa.BigInteger(), nullable=False, comment="Thread it happened on"),
        sa.Column("start_ns", sa.BigInteger(), nullable=False, comment="callback_start [epoch ns]"),
        sa.Column(
            "end_ns", sa.BigInteger(), comment="callback_end; NULL: never seen to end [epoch ns]"
        ),
        sa.Column("take_id", sa.BigInteger(), comment="Message it was called with"),
        sa.Column("request_id", sa.BigInteger(), comment="Request it was called with"),
        sa.Column(
            "is_intra_process",
            sa.Boolean(),
            nullable=False,
            comment="Called with an intra-process message",
        ),
        sa.Column("parent_id", sa.BigInteger(), comment="Run it is nested in"),
        sa.Column(
            "depth", sa.Integer(), nullable=False, comment="Nesting depth on its thread, from 1"
        ),
        sa.Column("start_event_id", sa.BigInteger(), comment="callback_start [event order]"),
        sa.Column(
            "end_event_id",
            sa.BigInteger(),
            comment="callback_end; NULL: never seen to end [event order]",
        ),
        sa.Column(
            "effective_end_event_id",
            sa.BigInteger(),
            comment="callback_end, else the first event that cannot be inside [event order]",
        ),
        schema="store",
        comment="One row per run of a callback",
    )
    op.create_table(
        "request",
        sa.Column("request_id", sa.BigInteger(), nullable=False, comment="Identity of the request"),
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("client_id", sa.BigInteger(), comment="Client that sent it"),
        sa.Column("service_id", sa.BigInteger(), comment="Service that took it"),
        sa.Column("sequence_number", sa.BigInteger(), comment="Number given by the client"),
        sa.Column("sent_ns", sa.BigInteger(), comment="rmw_send_request [epoch ns]"),
        sa.Column("taken_ns", sa.BigInteger(), comment="rmw_take_request [epoch ns]"),
        sa.Column("sender_thread_id", sa.BigInteger(), comment="Thread that sent it"),
        sa.Column("receiver_thread_id", sa.BigInteger(), comment="Thread that took it"),
        sa.Column("callback_instance_id", sa.BigInteger(), comment="Service callback it led to"),
        schema="store",
        comment="One row per service request",
    )
    op.create_table(
        "response",
        sa.Column(
            "response_id", sa.BigInteger(), nullable=False, comment="Identity of the response"
        ),
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("client_id", sa.BigInteger(), comment="Client that took it"),
        sa.Column("service_id", sa.BigInteger(), comment="Service that sent it"),
        sa.Column("sequence_number", sa.BigInteger(), comment="Number given by the client"),
        sa.Column("sent_ns", sa.BigInteger(), comment="rmw_send_response [epoch ns]"),
        sa.Column("taken_ns", sa.BigInteger(), comment="rmw_take_response [epoch ns]"),
        sa.Column("sender_thread_id", sa.BigInteger(), comment="Thread that sent it"),
        sa.Column("receiver_thread_id", sa.BigInteger(), comment="Thread that took it"),
        sa.Column("callback_instance_id", sa.BigInteger(), comment="Service callback it came from"),
        schema="store",
        comment="One row per service response",
    )
    op.create_table(
        "executor_state",
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("executor_id", sa.BigInteger(), comment="Executor"),
        sa.Column("thread_id", sa.BigInteger(), nullable=False, comment="Thread it happened on"),
        sa.Column("state", sa.String(), nullable=False, comment="'wait', 'process' or 'execute'"),
        sa.Column(
            "start_ns",
            sa.BigInteger(),
            nullable=False,
            comment="Executor event that began it [epoch ns]",
        ),
        sa.Column(
            "end_ns",
            sa.BigInteger(),
            comment="Next executor event; NULL: not known (the last, or a gap) [epoch ns]",
        ),
        sa.Column("callback_instance_id", sa.BigInteger(), comment="First callback run in it"),
        sa.Column(
            "start_event_id", sa.BigInteger(), comment="Executor event that began it [event order]"
        ),
        schema="store",
        comment="One row per interval between two executor events of a thread",
    )
    op.create_table(
        "link_transport",
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column(
            "publication_id", sa.BigInteger(), nullable=False, comment="Where the message came from"
        ),
        sa.Column("take_id", sa.BigInteger(), nullable=False, comment="Where it was received"),
        sa.Column("publisher_id", sa.BigInteger(), comment="Publisher of the message"),
        sa.Column("subscription_id", sa.BigInteger(), comment="Subscription that received it"),
        sa.Column(
            "method",
            sa.String(),
            nullable=False,
            comment="'exact', 'exact_stamp', 'nearest' or 'ring_buffer'",
        ),
        sa.Column(
            "candidate_count", sa.BigInteger(), comment="Publications that it could have been"
        ),
        sa.Column(
            "is_self_loop",
            sa.Boolean(),
            nullable=False,
            comment="Received by the publishing node itself",
        ),
        sa.Column(
            "is_loss_affected",
            sa.Boolean(),
            nullable=False,
            comment="A gap of the trace may hide a better partner",
        ),
        schema="store",
        comment="One row per take whose publication is known",
    )
    op.create_table(
        "link_causal",
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("callback_instance_id", sa.BigInteger(), nullable=False, comment="Cause"),
        sa.Column("publication_id", sa.BigInteger(), nullable=False, comment="Effect"),
        sa.Column("take_id", sa.BigInteger(), comment="Message that the cause was called with"),
        sa.Column("subscription_id", sa.BigInteger(), comment="Subscription of that message"),
        sa.Column("publisher_id", sa.BigInteger(), comment="Publisher of the effect"),
        sa.Column(
            "kind",
            sa.String(),
            nullable=False,
            comment="'direct', 'periodic_async', 'partial_sync' or 'take_adjacent'",
        ),
        sa.Column("annotation_id", sa.BigInteger(), comment="Annotation that declares it"),
        sa.Column("candidate_count", sa.BigInteger(), comment="Runs that it could have been"),
        sa.Column(
            "is_loss_affected",
            sa.Boolean(),
            nullable=False,
            comment="A gap of the trace may hide a better partner",
        ),
        schema="store",
        comment="One row per callback run that led to a publication",
    )
    op.create_table(
        "link_request",
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("request_id", sa.BigInteger(), nullable=False, comment="Effect"),
        sa.Column("callback_instance_id", sa.BigInteger(), comment="Cause"),
        schema="store",
        comment="One row per request that a callback run or thread sent",
    )
    op.create_table(
        "link_response",
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("response_id", sa.BigInteger(), nullable=False, comment="Effect"),
        sa.Column("callback_instance_id", sa.BigInteger(), comment="Cause"),
        schema="store",
        comment="One row per response and the callback run that sent it",
    )


def downgrade() -> None:
    """Drop every table of the first schema."""
    for name in (
        "link_response",
        "link_request",
        "link_causal",
        "link_transport",
        "executor_state",
        "response",
        "request",
        "callback_instance",
        "take",
        "publication",
        "diagnostic",
        "lifecycle_transition",
        "annotation_output",
        "annotation_input",
        "annotation",
        "executor_thread",
        "executor",
        "callback",
        "client",
        "service",
        "timer",
        "subscription",
        "publisher",
        "node",
        "thread",
        "process",
        "host",
        "clock",
        "loss_interval",
        "packet",
        "trace",
        "run",
        "definition",
    ):
        op.drop_table(name, schema="store")
