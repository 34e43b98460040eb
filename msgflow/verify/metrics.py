"""Metrics of requirements: each is an expression over the columns of a named query."""

from __future__ import annotations

from dataclasses import dataclass, field

from msgflow.verify.condition import Dimension

_ALL = ("min", "median", "mean", "p95", "p99", "max")
_HIGH = ("median", "p95", "p99", "max")


@dataclass(frozen=True)
class Metric:
    """A metric."""

    query: str  # the named query that measures it
    value: str  # SQL over its columns; `{}` stands for the statistic
    dimension: Dimension  # of the value
    statistics: tuple[str, ...] = ()  # those of the query; empty if there is one value only
    samples: str = "count"  # SQL over its columns: the number of values behind it
    # the worst case that explains a value that is too large, a key of `worst_case.KEYS`
    worst: str | None = None
    # why there may be no value, though the recording could have one
    missing: str = "too few values in the time window"
    lacking: str | None = None  # what a recording may lack to have a value at all; None: nothing


@dataclass(frozen=True)
class Filter:
    """A field of a target that chooses rows."""

    # the columns that it is compared with, by query; one of them has to match
    columns: dict[str, tuple[str, ...]]
    names: str  # SQL that returns the names of a run ($run_id)
    what: str  # the word for such a name in errors


@dataclass(frozen=True)
class Subject:
    """A kind of thing with requirements."""

    metrics: dict[str, Metric]  # by name
    label: dict[str, str]  # SQL that names a row, by query
    # by field of the file; the first is the subject itself, others are optional
    filters: dict[str, Filter] = field(default_factory=dict)


_TOPICS = """
SELECT topic_name FROM main.publisher WHERE run_id = $run_id
UNION SELECT topic_name FROM main.subscription WHERE run_id = $run_id
"""
_PLACES = f"{_TOPICS} UNION SELECT full_name FROM main.node WHERE run_id = $run_id"
_SERVICES = """
SELECT service_name FROM main.service WHERE run_id = $run_id
UNION SELECT service_name FROM main.client WHERE run_id = $run_id
"""
_ACTIONS = """
SELECT action_name FROM main.action_server WHERE run_id = $run_id
UNION SELECT action_name FROM main.action_client WHERE run_id = $run_id
"""
_NODES = "SELECT DISTINCT node FROM main.callback_label WHERE run_id = $run_id"
_OF_NODE = "SELECT DISTINCT full_name FROM main.node WHERE run_id = $run_id", "node"
_TIMERS = """
SELECT DISTINCT l.node
FROM main.callback_label AS l
JOIN main.callback AS c ON l.callback_id = c.callback_id
WHERE l.run_id = $run_id AND c.kind = 'timer'
"""
_CALLBACKS = "SELECT DISTINCT label FROM main.callback_label WHERE run_id = $run_id"
_PROCESSES = """
SELECT name FROM main.process WHERE run_id = $run_id
UNION SELECT nodes FROM main.process_label WHERE run_id = $run_id
"""
_NOT_TRACED = "the kernel was not traced, or not during it"
_NOT_DUE = "when it was due is not known: one call only, or its creation was not recorded"
# Roots and messages that could arrive, as far as the recording shows.
_ARRIVALS = "roots - not_connected - cut_by_recording"
_CONNECTED = "published - not_connected - cut_by_recording"

_BETWEEN = "e2e-latency-ends"
_NO_FLOW = "no flow reached the end of the path in the time window"

PATH = "path"
# A way between two topics, whatever path messages took: this is the field of the first topic.
ENDS = "from"
SUBJECTS: dict[str, Subject] = {
    PATH: Subject(
        {
            "latency": Metric(
                "e2e-latency", "{}_ns", Dimension.TIME, _ALL, "pairs", "flow",
                _NO_FLOW,
            ),
            "reaction_time": Metric(
                "e2e-latency-reaction", "{}_ns", Dimension.TIME, _ALL, "intervals"
            ),
            "age": Metric("e2e-latency-age", "{}_ns", Dimension.TIME, _ALL, "outputs"),
            "completeness": Metric(
                "e2e-latency", f"reached / nullif({_ARRIVALS}, 0)", Dimension.SHARE, (), _ARRIVALS
            ),
            "loss": Metric(
                "e2e-latency", f"(dropped + lost) / nullif({_ARRIVALS}, 0)", Dimension.SHARE, (),
                _ARRIVALS, "lost_flow",
            ),
        },
        dict.fromkeys(("e2e-latency", "e2e-latency-reaction", "e2e-latency-age"), "path"),
    ),
    ENDS: Subject(
        {
            "latency": Metric(
                _BETWEEN, "first_{}_ns", Dimension.TIME, _ALL, "reached", "first_flow", _NO_FLOW
            ),
            "last": Metric(
                _BETWEEN, "last_{}_ns", Dimension.TIME, _ALL, "reached", "last_flow", _NO_FLOW
            ),
            "age": Metric(_BETWEEN, "newest_{}_ns", Dimension.TIME, _ALL[1:], "messages"),
            "completeness": Metric(
                _BETWEEN, f"reached / nullif({_ARRIVALS}, 0)", Dimension.SHARE, (), _ARRIVALS
            ),
            "loss": Metric(
                _BETWEEN, f"(dropped + lost) / nullif({_ARRIVALS}, 0)", Dimension.SHARE, (),
                _ARRIVALS,
            ),
        },
        {_BETWEEN: "concat_ws(' → ', coalesce(first_topic, '?'), coalesce(last_topic, '?'), node)"},
        {
            ENDS: Filter({}, _PLACES, "topic or node"),
            "to": Filter({}, _PLACES, "topic or node"),
        },
    ),
    "timer": Subject(
        {
            "rate": Metric("timers", "rate_hz", Dimension.RATE),
            "jitter": Metric("timers", "jitter_{}_ns", Dimension.TIME, _HIGH, worst="late_call"),
            "lateness": Metric(
                "timers", "lateness_{}_ns", Dimension.TIME, _HIGH,
                "count - unknown - loss_affected", "late_call", lacking=_NOT_DUE,
            ),
            "missed": Metric(
                "timers", "missed", Dimension.COUNT, worst="late_call", lacking=_NOT_DUE
            ),
            "bunched": Metric("timers", "bunched", Dimension.COUNT, worst="late_call"),
        },
        {"timers": "node || ' ' || callback"},
        {
            "timer": Filter({"timers": ("node",)}, _TIMERS, "node with timers"),
            "callback": Filter({"timers": ("callback", "symbol")}, _CALLBACKS, "callback"),
        },
    ),
    "callback": Subject(
        {
            "duration": Metric(
                "callbacks", "{}_ns", Dimension.TIME, _ALL, "count - open", "callback"
            ),
            "period": Metric(
                "callbacks", "period_{}_ns", Dimension.TIME, ("min", "median", "max")
            ),
            "wait": Metric("waits", "wait_{}_ns", Dimension.TIME, ("median", "max")),
            "cpu": Metric(
                "scheduling", "running_{}_ns", Dimension.TIME, ("median", "p99", "max"),
                lacking=_NOT_TRACED,
            ),
            "preempted": Metric(
                "scheduling", "preempted_ns / nullif(total_ns, 0)", Dimension.SHARE,
                worst="preemption", lacking=_NOT_TRACED,
            ),
        },
        dict.fromkeys(("callbacks", "waits", "scheduling"), "node || ' ' || callback"),
        {
            "callback": Filter(
                {
                    "callbacks": ("callback", "symbol"),
                    "waits": ("callback",),
                    "scheduling": ("callback",),
                },
                _CALLBACKS, "callback",
            ),
            "node": Filter(
                dict.fromkeys(("callbacks", "waits", "scheduling"), ("node",)),
                _NODES, "node",
            ),
        },
    ),
    "topic": Subject(
        {
            "rate": Metric("topics-rate", "rate_hz", Dimension.RATE),
            "period": Metric(
                "topics-rate", "period_{}_ns", Dimension.TIME, ("min", "median", "p95", "max")
            ),
            "jitter": Metric("topics-rate", "period_deviation_ns", Dimension.TIME),
            "latency": Metric(
                "topics-latency", "{}_ns", Dimension.TIME, _ALL, "linked", "message"
            ),
            "loss": Metric(
                "topics-delivery", f"(dropped + lost) / nullif({_CONNECTED}, 0)",
                Dimension.SHARE, (), _CONNECTED,
            ),
            "completeness": Metric(
                "topics-delivery", f"delivered / nullif({_CONNECTED}, 0)",
                Dimension.SHARE, (), _CONNECTED,
            ),
        },
        {
            "topics-rate": "publisher || ' → ' || topic_name",
            "topics-latency": "topic_name || ' → ' || subscriber",
            "topics-delivery": "topic_name || ' → ' || subscriber",
        },
        {
            "topic": Filter(
                dict.fromkeys(("topics-rate", "topics-latency", "topics-delivery"),
                              ("topic_name",)), _TOPICS, "topic",
            ),
            "node": Filter(
                {
                    "topics-rate": ("publisher",),
                    "topics-latency": ("subscriber",),
                    "topics-delivery": ("subscriber",),
                },
                *_OF_NODE,
            ),
        },
    ),
    "service": Subject(
        {
            "round_trip": Metric(
                "service-latency", "round_trip_{}_ns", Dimension.TIME, _ALL, "answered", "request"
            ),
            "completeness": Metric(
                "service-latency", "answered / nullif(requests, 0)", Dimension.SHARE, (), "requests"
            ),
        },
        {"service-latency": "coalesce(client, '?') || ' → ' || service_name"},
        {
            "service": Filter({"service-latency": ("service_name",)}, _SERVICES, "service"),
            "node": Filter({"service-latency": ("client",)}, *_OF_NODE),
        },
    ),
    "action": Subject(
        {
            "goal": Metric(
                "action-latency", "result_{}_ns", Dimension.TIME, _ALL, "finished", "goal",
                "no goal is known with its result in the time window",
            ),
        },
        {"action-latency": "coalesce(client, '?') || ' → ' || action_name"},
        {
            "action": Filter({"action-latency": ("action_name",)}, _ACTIONS, "action"),
            "node": Filter({"action-latency": ("client",)}, *_OF_NODE),
        },
    ),
    "process": Subject(
        {
            "utilisation": Metric(
                "executor-usage", "callback_share", Dimension.SHARE, (), "callbacks"
            ),
            "wakeup": Metric(
                "scheduling-wakeup", "{}_ns", Dimension.TIME, ("median", "p99", "max"),
                lacking=_NOT_TRACED,
            ),
        },
        {
            "executor-usage": "printf('%s, thread %d', nodes, tid)",
            "scheduling-wakeup": "printf('%s, thread %d', nodes, tid)",
        },
        {
            "process": Filter(
                {
                    "executor-usage": ("process", "nodes"),
                    "scheduling-wakeup": ("process", "nodes"),
                },
                _PROCESSES, "process",
            ),
        },
    ),
}  # fmt: skip
