"""Tables of clocks: how their times are corrected, and how stamps of messages run along them."""

from __future__ import annotations

from sqlalchemy import BOOLEAN

from msgflow.db.tables.column import column, key, moment, number, reference, table, text

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
    moment("at_ns", "Middle of the stretch, time of the traces", required=True),
    moment("start_ns", "Begin of the stretch", required=True),
    moment("end_ns", "End of the stretch, exclusive", required=True),
    number(
        "difference_ns",
        "Clock of ROS less clock of the traces, with the shortest delay of a stamp",
        unit="ns",
        required=True,
    ),
    number("drift_ppb", "Change of the difference in the stretch", unit="ppb"),
    number("message_count", "Messages that agree with it"),
    number("segment", "Number of jumps of the clock before it"),
    column("is_sharp", BOOLEAN, "Publications microseconds apart can be distinguished; NULL: yes"),
    comment="One row per stretch of time in which stamps run along a clock of the traces",
)
