"""Tables of what was read: runs, traces, packets, gaps, findings, and clocks."""

from __future__ import annotations

from sqlalchemy import ARRAY, BOOLEAN, TIMESTAMP, VARCHAR, Column

from msgflow.db.tables.column import (
    column,
    integer,
    key,
    moment,
    number,
    reference,
    table,
    text,
    trace_id,
)

table(
    "definition",
    Column("name", VARCHAR, primary_key=True, comment="'views': the SQL of all views and macros"),
    text("hash", "SHA-256 of the SQL that was last applied", required=True),
    text("msgflow_version", "Version of msgflow that applied it", required=True),
    comment="One row per part of the schema that is re-applied rather than migrated",
    of_run=False,
)

table(
    "run",
    key("run_id", "Identity of the run"),
    text("name", "Name given by the user, or the name of the first trace directory", required=True),
    column("created_at", "When the run was ingested, UTC", TIMESTAMP, required=True),
    text("msgflow_version", "Version of msgflow that ingested the run", required=True),
    text("derivation_hash", "SHA-256 of the SQL that derived the links", required=True),
    moment("start_ns", "First event of any trace"),
    moment("end_ns", "Last event of any trace"),
    number("event_count", "Events read"),
    column(
        "labels",
        "Labels that users gave to the run, KEY=VALUE each, sorted; NULL: no label",
        ARRAY(VARCHAR),
    ),
    text("clock_sync", "How clocks were to be brought together: 'none', 'messages' or 'file'"),
    comment="One row per ingest of traces that belong together",
    of_run=False,
)

table(
    "trace",
    key("trace_id", "Identity of the trace"),
    reference("host_id", "Host that was traced", required=True),
    text("path", "Directory as it was given", required=True),
    text("uuid", "UUID of the trace"),
    text("tracer", "Tracer and its version"),
    text("domain", "'ust' or 'kernel'"),
    moment("start_ns", "First event or start of a packet", clock="host_id"),
    moment("end_ns", "Last event or end of a packet", clock="host_id"),
    number("event_count", "Events read"),
    number("discarded_event_count", "Events that the tracer counted as discarded"),
    column(
        "has_request_events",
        "Requests would have events in it, if there were any (Kilted and later)",
        BOOLEAN,
    ),
    comment="One row per CTF trace read",
    view="CTF traces that were read.",
)

table(
    "packet",
    trace_id(),
    number("stream_class_id", "Stream class (channel) of the packet"),
    number("stream_instance_id", "Stream (buffer) of the packet"),
    integer("cpu_id", "CPU that wrote the packet"),
    number("position", "Position in its stream, from 0"),
    moment("begin_ns", "Begin of the packet"),
    moment("end_ns", "End of the packet"),
    moment("last_event_ns", "Last event in the packet"),
    number("event_count", "Events in the packet"),
    number("discarded_event_count", "Events lost in the packet, after its last event"),
    number("lost_packet_count", "Packets missing right before it"),
    comment="One row per packet of a trace; the identity of what was read",
)

table(
    "gap",
    trace_id("Trace it was recorded in; between two chunks of a recording, the later"),
    integer("cpu", "CPU concerned; NULL: all"),
    text(
        "kind",
        "'loss' (discarded events), 'packets' (lost packets) or 'pause' (not tracing)",
        required=True,
    ),
    moment("start_ns", "Last moment before the gap", clock="trace_id"),
    moment("end_ns", "First moment after the gap", clock="trace_id"),
    number("event_count", "Events lost, where the tracer counted them"),
    comment="One row per gap in a trace",
    view="Gaps in the traces: no two events are paired across one.",
)

table(
    "finding",
    trace_id("Trace it is about; NULL: not one trace alone", required=False),
    text("name", "Kind of finding: its file in `schema/health`", required=True),
    text("subject", "Where: a trace, process, host, topic; NULL: the trace, or all of the phase"),
    number("count", "How often"),
    text("detail", "Numbers, and what they mean"),
    comment="One row per place at which something was found",
)

table(
    "clock",
    key("clock_id", "Identity of the clock"),
    text("uuid", "UUID of the clock (LTTng: boot identity)"),
    number("offset_ns", "Added to a time of this clock to correct it", unit="ns", required=True),
    number("drift_ppb", "Added per unit of time since reference_ns", unit="1e-9", required=True),
    moment("reference_ns", "Moment at which the correction is offset_ns alone", required=True),
    number("uncertainty_ns", "Bound of the error of the correction at reference_ns", unit="ns"),
    text("method", "'none', 'messages', 'packets' or 'file'", required=True),
    number(
        "drift_uncertainty_ppb",
        "Growth of the error bound per unit of time from reference_ns; NULL: the bound holds "
        "throughout, or is not known",
        unit="1e-9",
    ),
    reference(
        "reference_clock_id",
        "Clock that this one is corrected to: times of clocks with the same one can be "
        "compared; NULL: as recorded",
        to="clock",
    ),
    comment="One row per clock: hosts of one clock need no synchronisation",
    view=(
        "Clocks and how their times are corrected. Times in the other views are corrected already."
    ),
)

table(
    "clock_uncertainty",
    reference("clock_id", "The clock", required=True),
    moment("at_ns", "Moment, as the clock showed it", required=True),
    number(
        "uncertainty_ns",
        "Bound of the error of the correction at that moment",
        unit="ns",
        required=True,
    ),
    comment="One row per clock and moment",
    view=(
        "Bounds of the error of each clock's correction: at the moments listed here, "
        "uncertainty_ns; between two of them, on the straight line. Times of two clocks with "
        "the same reference can be compared to within the sum of both bounds. The reference "
        "itself has no error and no rows."
    ),
)

table(
    "stamp_clock",
    reference("clock_id", "Clock of the traces", required=True),
    moment("start_ns", "First stamp of the time, by the clock of ROS; NULL: from the begin"),
    moment("end_ns", "Last stamp; NULL: until the end"),
    moment("at_ns", "Stamp at which the difference holds", required=True),
    number(
        "difference_ns",
        "Clock of ROS less clock of the traces, with the shortest delay of a stamp",
        unit="ns",
        required=True,
    ),
    number("drift_ppb", "How fast the difference changes", unit="ppb", required=True),
    number(
        "slack_ns",
        "The messages fit differences that are up to so much apart",
        unit="ns",
        required=True,
    ),
    comment=(
        "One row per time between two steps of the clock that stamps messages, as far as it is "
        "certain how it runs along a clock of the traces"
    ),
)
