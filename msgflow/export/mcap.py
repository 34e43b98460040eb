"""MCAP file of measured values and losses, for programs that show recordings of robots.

It has messages of ROS 2 (CDR), as a bag has: Foxglove, Lichtblick, PlotJuggler and Rerun all decode
these, while not all of them decode JSON, or plot messages of protobuf without configuration.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgflow.errors import UsageError
from msgflow.files.atomic import replacing
from msgflow.sql.failure import format_errors
from msgflow.sql.statement import internal_sql
from msgflow.text.installation import install_command
from msgflow.version import __version__

if TYPE_CHECKING:
    import duckdb

    from msgflow.run.choice import Run
    from msgflow.run.slice import Slice

LOG_TOPIC = "/msgflow/log"
_NS_IN_S = 1_000_000_000
_VALUE = ("std_msgs/msg/Float64", "float64 data")
_LOG = (
    "rcl_interfaces/msg/Log",
    """builtin_interfaces/Time stamp
uint8 level
string name
string msg
string file
string function
uint32 line
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec""",
)
_WARNING = 30
_ERROR = 40


@dataclass(frozen=True)
class ExportedMcap:
    """An MCAP file that was written.

    Attributes:
        path: the file.
        run: what it is of.
        topics: topics with values.
        values: measured values, a message each.
        losses: messages about messages that were dropped or lost.
        violations: messages about requirements that are not met.
    """

    path: Path
    run: Run
    topics: int
    values: int
    losses: int
    violations: int


def write_mcap(
    connection: duckdb.DuckDBPyConnection,
    path: Path,
    part: Slice,
    violations: Sequence[tuple[int | None, str, str]] = (),
) -> ExportedMcap:
    """Write values and losses of a run as an MCAP file, batch by batch.

    A violation is when its worst case began (epoch ns; None if it has none, such as a rate), its
    subject, and what was required and measured.
    """
    run = part.one_run(connection, "an MCAP file")
    bindings = {"runs": [run.run_id], **part.window([run]).bindings}
    try:
        from mcap_ros2.writer import Writer
    except ImportError:
        raise UsageError(
            "the package that writes MCAP files is not installed — mcap-ros2-support",
            install_command("mcap-ros2-support"),
        ) from None
    topics: set[str] = set()
    values = losses = 0
    end_ns = run.start_ns or 0
    with format_errors(run.name), replacing(path) as temporary, temporary.open("wb") as file:
        writer: Any = Writer(file)
        writer.add_metadata("msgflow", {"run": run.name, "version": __version__})
        schema = writer.register_msgdef(*_VALUE)
        for row in internal_sql().rows(connection, "mcap_value", bindings):
            topics.add(row["topic"])
            message = {"data": row["value_ms"]}
            writer.write_message(row["topic"], schema, message, row["at_ns"], sequence=values)
            values += 1
            end_ns = row["at_ns"]
        schema = writer.register_msgdef(*_LOG)
        for row in internal_sql().rows(connection, "mcap_loss", bindings):
            message = _log(row["at_ns"], _WARNING, row["node"], row["message"])
            writer.write_message(LOG_TOPIC, schema, message, row["at_ns"])
            losses += 1
        for began_ns, subject, text in violations:
            at_ns = end_ns if began_ns is None else began_ns
            message = _log(at_ns, _ERROR, subject, text)
            writer.write_message(LOG_TOPIC, schema, message, at_ns)
        writer.finish()
    return ExportedMcap(path, run, len(topics), values, losses, len(violations))


def _log(at_ns: int, level: int, name: str, text: str) -> dict[str, Any]:
    seconds, nanoseconds = divmod(at_ns, _NS_IN_S)
    return {
        "stamp": {"sec": seconds, "nanosec": nanoseconds},
        "level": level, "name": name, "msg": text, "file": "", "function": "", "line": 0,
    }  # fmt: skip
