"""Verdicts on targets as ROS 2 diagnostics: for rqt_robot_monitor, aggregators and loggers."""

from __future__ import annotations

import socket
from typing import Any

from msgflow.errors import UsageError
from msgflow.text.values import format_duration
from msgflow.verify.verify import Verdict
from msgflow.watch.alarm import violation_line
from msgflow.watch.window_report import WindowReport

TOPIC = "/diagnostics"
NODE = "msgflow_watch"
# Names of the constants of diagnostic_msgs/DiagnosticStatus, the worst first.
_LEVELS = {
    Verdict.FAILED: "ERROR",
    Verdict.NOT_MEASURED: "WARN",
    Verdict.NO_DATA: "STALE",
    Verdict.PASSED: "OK",
}


def _status(rows: list[dict[str, Any]], lag_s: float | None) -> tuple[str, str, dict[str, str]]:
    """Return level, message and values of a target, which has rows of verdicts.

    The message has what is required and measured, and of what fails also the path and what is to
    blame. Values are 'p50', 'p99' and 'lost' (flows lost or dropped) of flows; and 'lag'.
    """
    worst = min((Verdict(row["verdict"]) for row in rows), key=[*_LEVELS].index)
    blamed = [row for row in rows if row["verdict"] == worst]
    values = {}
    # Of several paths, those of the first that fails.
    flows = next((row["flows"] for row in blamed if row["flows"] is not None), None)
    if flows is not None:
        for name, column in (("p50", "median_ns"), ("p99", "p99_ns")):
            if flows[column] is not None:
                values[name] = format_duration(flows[column])
        values["lost"] = str(flows["lost"] + flows["dropped"])
    if lag_s is not None:
        values["lag"] = f"{lag_s:.1f} s"
    return _LEVELS[worst], "; ".join(map(_sentence, blamed)), values


def _sentence(row: dict[str, Any]) -> str:
    subject = row["subject"] or row["target"]
    if row["value"] is None:
        return f"{subject}: {row['metric']} {row['condition']}: {row['reason']}"
    return violation_line(row | {"subject": subject, "is_final": True})


class Diagnostics:
    """A node that publishes what windows say of targets.

    It is no part of what it measures: `read_chunk` leaves out what this process does.
    """

    def __init__(self) -> None:
        """Start the node; a UsageError says what cannot be imported."""
        try:
            import rclpy
            from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
            from rclpy.duration import Duration
            from rclpy.node import Node
            from rclpy.signals import SignalHandlerOptions
        except ImportError as error:
            raise UsageError(
                f"--diagnostics needs rclpy and diagnostic_msgs: {error}",
                "source /opt/ros/DISTRO/setup.bash, with the Python of that distribution",
            ) from None
        self._array, self._status, self._pair = DiagnosticArray, DiagnosticStatus, KeyValue
        self._longest_wait = Duration(seconds=1)
        self._context = rclpy.Context()
        # Ctrl-C is ours.
        rclpy.init(args=[], context=self._context, signal_handler_options=SignalHandlerOptions.NO)
        self._node = Node(
            NODE, context=self._context, enable_rosout=False, start_parameter_services=False
        )
        self._publisher = self._node.create_publisher(DiagnosticArray, TOPIC, 10)

    def show(self, report: WindowReport) -> None:
        """Publish a status for each target that a window was judged by."""
        by_target: dict[str, list[dict[str, Any]]] = {}
        for row in report.judged:
            by_target.setdefault(row["target"], []).append(row)
        array = self._array()
        array.header.stamp = self._node.get_clock().now().to_msg()
        array.status = []
        for target, rows in by_target.items():
            level, message, values = _status(rows, report.lag_s)
            array.status.append(
                self._status(
                    level=getattr(self._status, level),
                    name=f"msgflow: {target}",
                    message=message,
                    hardware_id=socket.gethostname(),
                    values=[self._pair(key=key, value=value) for key, value in values.items()],
                )
            )
        self._publisher.publish(array)

    def close(self) -> None:
        """End the node, when the last message has arrived."""
        self._publisher.wait_for_all_acked(self._longest_wait)
        self._node.destroy_node()
        self._context.shutdown()
