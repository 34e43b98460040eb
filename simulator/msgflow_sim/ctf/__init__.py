"""Writer of CTF 1.8 as LTTng and perf write it on x86-64: packed, little endian.

It knows layouts and bytes, nothing of ROS 2 or of the simulation.
"""

from __future__ import annotations

from msgflow_sim.ctf.perf import PerfWriter
from msgflow_sim.ctf.stream import Break, Ending, Faults, StreamWriter
from msgflow_sim.ctf.trace import USER_ID, TraceIdentity, TraceWriter
from msgflow_sim.ctf.tracepoint import Tracepoint, thread_context, thread_of

__all__ = [
    "USER_ID",
    "Break",
    "Ending",
    "Faults",
    "PerfWriter",
    "StreamWriter",
    "TraceIdentity",
    "TraceWriter",
    "Tracepoint",
    "thread_context",
    "thread_of",
]
