"""Simulated ROS 2 systems: real CTF traces of systems whose truth is known.

`simulate("pipeline", directory)` writes for each host a trace as LTTng-UST would have recorded it
(`directory/HOSTNAME/ust/uid/1000/64-bit`; that of the kernel, if the scenario has one, in
`directory/HOSTNAME/kernel`, or in `…/perf` if perf has recorded it), and the truth into
`directory/truth`: what happened, not what can be seen. `scenarios()` lists what can be simulated;
a `Scenario` of your own works as well.

`layout` names the release of ROS 2 whose events the trace has, see `layouts()`. `recording` is how
they are recorded: the recording starts late, pauses, loses events or packets, is rotated, … A
recording never changes what happens. A layout changes only when stamps are made, and what depends
on these times.

Truth tables (Parquet). `host` is a hostname; `pid` and `tid` are those of the trace. Columns in
`_ns` are ns since the epoch on the trace clock of the host in question, hence equal to time stamps
of events in its trace, except `latency_ns`, which is a true duration, free of clock offsets.
Identifiers (`…_id`) are the truth's own and connect its tables; rows have no particular order.
`is_internal` marks /rosout, /parameter_events and ros_discovery_info.

publication — one row per publication:
    publication_id, host, pid, tid, node (full name), topic_name, publisher_handle (as in
    rcl_publisher_init), rmw_publisher_handle, rclcpp_ns, rcl_ns, rmw_ns (times of its
    events; NULL: no such event, since /rosout does not pass rclcpp, ros_discovery_info only rmw),
    source_timestamp_ns, callback_instance_id (the callback that published, else NULL),
    is_internal, intra_ns (rclcpp_intra_publish; such a publication has the others only if a
    subscription needs DDS). node and publisher_handle are NULL for ros_discovery_info. After a
    shutdown, only rclcpp_ns is there: nothing was sent. agnocast_ns: agnocast_publish; then
    all others are NULL, and the rmw handle is 0.
take — one row per message that was handed over to a subscription:
    take_id, host, pid, tid, node, topic_name, subscription_handle, rmw_ns, rcl_ns, rclcpp_ns,
    source_timestamp_ns, publication_id, callback_instance_id (NULL: taken without a callback),
    is_internal, method ('rmw', 'ring_buffer', 'agnocast', 'callback_only': without an event of its
    own), dequeue_ns (from a ring buffer), subscription_id, agnocast_ns (when its callable was made,
    or it was polled). A message that comes through a ring buffer
    and DDS is taken twice; the second one has no callback.
callback_instance — one row per run of a callback that is traced:
    callback_instance_id, host, pid, tid, node, kind ('timer', 'subscription', 'service'),
    callback_handle, start_ns, end_ns (NULL: it never ended, or nothing records it), take_id
    (NULL but for subscriptions), is_intra_process, parent_id (the callback that it runs nested in)
transport — one row per take with its publication:
    publication_id, take_id, topic_name, publication_{host,pid,tid,rclcpp_ns,rcl_ns,rmw_ns},
    source_timestamp_ns, take_{host,pid,tid,rmw_ns,rcl_ns,rclcpp_ns}, latency_ns (rmw_publish to
    rmw_take, or rclcpp_intra_publish to dequeue), is_internal, method (as of the take),
    publication_intra_ns, take_dequeue_ns, is_replay (kept by the publisher from before the
    subscription was there), is_self_loop (the node's own message, or on /tf that of its process)
subscription — one row per subscription, at whatever address:
    subscription_id, host, pid, node, topic_name, subscription_handle, rmw_subscription_handle,
    created_ns, ended_ns (NULL: not before the end of tracing), is_internal
reader — one row per reader of DDS in a process without ROS, on a topic of ROS:
    host, pid, topic_name, created_ns (dds:create_reader)
undelivered — one row per publication and subscription of its topic where neither a callback nor a
user got the message. It does not matter when the two existed: every publication and subscription of
a topic has a take or a row here:
    publication_id, topic_name, publication_{host,pid,tid,rmw_ns}, source_timestamp_ns,
    subscription_{host,pid,handle}, reason, is_internal, subscription_id. Reasons:
    'before_subscription', 'before_discovery', 'lost_in_transport', 'overwritten' (in a queue or a
    ring buffer), 'take_failed' (expired, and the take found nothing), 'expired' (and the take
    found a newer message), 'subscription_ended', 'pending_at_end'
causal — one row per publication made inside a callback, or with a message taken without one, and
one per message of another input that it was made of (annotated nodes), or that the callback took:
    callback_instance_id, publication_id, host, pid, tid (of the callback), kind ('direct';
    'take_adjacent' without a callback; 'periodic_async', 'partial_sync' of another input;
    'approximate_sync' of the set, and then 'triggered' instead of 'direct'; 'polled'
    without a callback, the last message of each topic that the publishing callback took itself),
    callback_start_ns, take_id, take_rmw_ns (NULL for timers), topic_name,
    publication_rcl_ns, publication_rmw_ns, is_internal, is_reuse (an earlier publication by the
    same link used the message too; a program that empties its caches uses it only once)
request — one row per request:
    request_id, service_name, client_gid, sequence_number, client_{host,pid,tid,node,handle},
    sent_ns, sender_callback_instance_id, service_{host,pid,tid,node,handle}, taken_ns,
    callback_instance_id (of the service; NULL like the rest if nobody took it)
response — one row per request that was answered:
    request_id, service_name, client_gid, sequence_number, source_timestamp_ns,
    service_{host,pid,tid}, sent_ns, client_{host,pid,tid}, taken_ns
link_call — one row per publication, request or response that followed from a request, or a
response, without a callback that is traced:
    request_id (which was taken, or answered), is_response, publication_id, sent_request_id,
    answered_request_id (whose response was sent)
user_event — one row per event of the user's own tracepoints (`Record`):
    user_event_id, host, pid, tid, name, at_ns, callback_instance_id (the innermost callback inside
    which it was recorded, else NULL), frame, score, label (its fields)
lifecycle_transition — one row per change of state of a managed node:
    host, pid, tid, node, at_ns, start_state, goal_state
end_to_end — one row per flow from a run of a timer's callback (one that uses no messages) to a
subscription whose callback publishes and keeps nothing (logging does not count), self loops left
out:
    root_callback_instance_id, root_{host,pid,tid,start_ns}, path (topics in order),
    sink_{host,pid,tid,node,take_id,take_ns,end_ns} (take_ns: rmw_take or dequeue; end_ns:
    callback_end),
    latency_ns (callback_start of the root to callback_end of the sink)
dds_event — one row per `dds:*` event of a publication, whether or not the layout has it:
    publication_id, host, pid, tid, event, ts_ns
declared — one row per field of an event of the layout (field is NULL for an event without fields):
    event, field
trace — one row per trace:
    host, pid (NULL: of all processes), path, clock_error_ns (what its time stamps are ahead of the
    times in these tables)
unrecorded — one row per event of the layout that happened and is not in a trace:
    host, pid, tid, cpu, event, ts_ns, cause ('late start', 'pause', 'loss', 'packets',
    'truncation', 'stop')
missing_packet — one row per packet without events that is not in a trace, but one before it is:
    host, pid (NULL: of all processes), cpu, since_ns (the end of that one), end_ns, cause (as of
    unrecorded)
emitted — one row per event that came into the buffers of a trace, recorded or not, of recordings
that are not perfect:
    host, pid, tid, cpu, ts_ns
arrival — one row per take of a message that came by DDS, where the kernel is traced:
    take_id, arrived_ns (when it was in the queue of its subscription)
thread_state — one row per state of a thread of a process with nodes, where the kernel is traced:
    host, pid, tid, state ('running', 'preempted', 'sleeping', 'uninterruptible', 'runnable'), cpu
    (that it has, had or waits for), start_ns, end_ns (NULL: the last), waker_kind (what ended the
    sleep: 'timer', 'interrupt', 'softirq', 'thread'), waker_tid (that thread)
cpu_run — one row per stretch of time in which a thread had a CPU, likewise, of all processes:
    host, cpu, kernel_tid, name, priority, start_ns, end_ns
interrupt — one row per interrupt that woke a thread, and what one left for later, likewise:
    host, cpu, kind ('interrupt', 'softirq'), start_ns, end_ns
kernel_loss — one row per time in which events of the kernel were lost:
    host, start_ns, end_ns, is_counted (the trace says that it lost some)
executor_state — one row per executor event, lasting until the next one of the thread:
    host, pid, tid, start_ns, end_ns (NULL: the last), state ('process' for get_next_ready,
    'wait' for wait_for_work, 'execute' for execute)

meta.json: scenario, description, layout, seed, factor, clock_offset_ns, clock_drift_ppm, hosts
(hostname → traces, begin_of_tracing_ns, clock_drift_ppb (how much too fast its clock runs),
cpu_count, events by name), processes, rows of each table, length_ns (from the begin to the end of
tracing), failed_takes (of executors), full_queues (arrivals at a queue that was full), undelivered
(reason → count).
"""

from __future__ import annotations

from msgflow_sim.engine import Simulation, simulate
from msgflow_sim.entity import (
    Call,
    Client,
    MessageLink,
    Poll,
    Publish,
    Publisher,
    Record,
    Service,
    Spin,
    Subscription,
    Timer,
    Transition,
    Work,
)
from msgflow_sim.layout import layouts
from msgflow_sim.long_recording import long_recording
from msgflow_sim.recording import Buffers, Recording
from msgflow_sim.scenario import scenarios
from msgflow_sim.system import Executor, Group, Host, Node, Process, Scenario

__all__ = [
    "Buffers",
    "Call",
    "Client",
    "Executor",
    "Group",
    "Host",
    "MessageLink",
    "Node",
    "Poll",
    "Process",
    "Publish",
    "Publisher",
    "Record",
    "Recording",
    "Scenario",
    "Service",
    "Simulation",
    "Spin",
    "Subscription",
    "Timer",
    "Transition",
    "Work",
    "layouts",
    "long_recording",
    "scenarios",
    "simulate",
]
