"""Simulated ROS 2 systems: real CTF traces of systems whose truth is known.

`simulate("pipeline", directory)` writes for each host a trace as LTTng-UST would have recorded it
(`directory/HOSTNAME/ust/uid/1000/64-bit`), and the truth into `directory/truth`: what happened, not
what can be seen. `scenarios()` lists what can be simulated; a `Scenario` of your own works as well.

Truth tables (Parquet). `host` is a hostname; `pid` and `tid` are those of the trace. Columns in
`_ns` are ns since the epoch on the trace clock of the host in question, hence equal to time stamps
of events in its trace, except `latency_ns`, which is a true duration, free of clock offsets.
Identifiers (`…_id`) are the truth's own and connect its tables; rows have no particular order.
`is_internal` marks /rosout, /parameter_events and ros_discovery_info.

publication — one row per publication:
    publication_id, host, pid, tid, node (full name), topic_name, publisher_handle (as in
    rcl_publisher_init), rmw_publisher_handle, rclcpp_ns, rcl_ns, rmw_ns (its events, NULL where
    there is none: /rosout does not pass rclcpp, ros_discovery_info only rmw),
    source_timestamp_ns, callback_instance_id (the callback that published, else NULL),
    is_internal. node and publisher_handle are NULL for ros_discovery_info.
take — one row per successful take of an executor:
    take_id, host, pid, tid, node, topic_name, subscription_handle, rmw_ns, rcl_ns, rclcpp_ns,
    source_timestamp_ns, publication_id, callback_instance_id, is_internal
callback_instance — one row per run of a callback:
    callback_instance_id, host, pid, tid, node, kind ('timer', 'subscription'), callback_handle,
    start_ns, end_ns, take_id (NULL for timers)
transport — one row per take with its publication:
    publication_id, take_id, topic_name, publication_{host,pid,tid,rclcpp_ns,rcl_ns,rmw_ns},
    source_timestamp_ns, take_{host,pid,tid,rmw_ns,rcl_ns,rclcpp_ns}, latency_ns (rmw_publish to
    rmw_take), is_internal
undelivered — one row per publication and subscription that existed then but never took it:
    publication_id, topic_name, publication_{host,pid,tid,rmw_ns}, source_timestamp_ns,
    subscription_{host,pid,handle}, reason ('before_discovery', 'overwritten', 'pending_at_end'),
    is_internal
causal — one row per publication made inside a callback:
    callback_instance_id, publication_id, host, pid, tid, kind ('direct'), callback_start_ns,
    take_id, take_rmw_ns (NULL for timers), topic_name, publication_rcl_ns, publication_rmw_ns,
    is_internal
end_to_end — one row per flow from a run of a timer's callback to a subscription whose callback
publishes nothing (logging does not count):
    root_callback_instance_id, root_{host,pid,tid,start_ns}, path (topics in order),
    sink_{host,pid,tid,node,take_id,take_ns,end_ns} (take_ns: rmw_take; end_ns: callback_end),
    latency_ns (callback_start of the root to callback_end of the sink)
executor_state — one row per executor event, lasting until the next one of the thread:
    host, pid, tid, start_ns, end_ns (NULL: the last), state ('process' for get_next_ready,
    'wait' for wait_for_work, 'execute' for execute)

meta.json: scenario, description, layout, seed, factor, clock_offset_ns, hosts (hostname → trace,
begin_of_tracing_ns, cpu_count, events by name), processes, rows of each table, length_ns (from the
begin to the end of tracing), failed_takes (of executors), full_queues (arrivals at a queue that was
full), undelivered (reason → count).
"""

from __future__ import annotations

from msgflow.sim.builtin import scenarios
from msgflow.sim.engine import Simulation, simulate
from msgflow.sim.layout import layouts
from msgflow.sim.long_recording import long_recording
from msgflow.sim.recording import Buffers, Recording
from msgflow.sim.system import (
    Host,
    Node,
    Process,
    Publisher,
    Scenario,
    Subscription,
    Timer,
    Work,
)

__all__ = [
    "Buffers",
    "Host",
    "Node",
    "Process",
    "Publisher",
    "Recording",
    "Scenario",
    "Simulation",
    "Subscription",
    "Timer",
    "Work",
    "layouts",
    "long_recording",
    "scenarios",
    "simulate",
]
