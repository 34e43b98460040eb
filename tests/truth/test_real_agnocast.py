"""The events of Agnocast by LTTng's own macros, from three processes of a chain with a bridge.

Agnocast itself needs its kernel module, which is not to be had here: pipes carry the messages.
"""

from __future__ import annotations

import subprocess
from pathlib import Path

import duckdb
import pytest
from recording.recorder import NotPossibleError, require_lttng, session
from recording.tracetools import build_tracetools

from msgflow import open_db

# Name, fields: as in Agnocast 2.3. H: a pointer, I: a number, S: a text.
EVENTS = {
    "agnocast_init": "H context_handle",
    "agnocast_node_init": "H node_handle, S node_name, S namespace",
    "agnocast_publisher_init": "H publisher_handle, H node_handle, S topic_name, I queue_depth",
    "agnocast_subscription_init": "H subscription_handle, H node_handle, H callback, "
    "H callback_group, S symbol, S topic_name, I queue_depth, I pid_callback_info_id",
    "agnocast_timer_init": "H timer_handle, H node_handle, H callback, H callback_group, "
    "S symbol, I period",
    "agnocast_add_callback_group": "H executor_addr, H node_handle, H callback_group_addr, "
    "S group_type_name",
    "agnocast_construct_executor": "H executor_addr, S executor_type_name",
    "agnocast_publish": "H publisher_handle, I entry_id",
    "agnocast_create_callable": "H callable, I entry_id, I pid_callback_info_id",
    "agnocast_create_timer_callable": "H callable, H timer_handle",
    "agnocast_callable_start": "H callable",
    "agnocast_callable_end": "H callable",
    "agnocast_take": "H subscription_handle, H message, I entry_id",
}
TYPES = {"H": "const void *", "I": "uint64_t", "S": "const char *"}
FIELDS = {
    "H": "lttng_ust_field_integer_hex(uint64_t, {0}, (uint64_t){0}_arg)",
    "I": "lttng_ust_field_integer(uint64_t, {0}, {0}_arg)",
    "S": "lttng_ust_field_string({0}, {0}_arg)",
}
HEADER = """
#undef LTTNG_UST_TRACEPOINT_PROVIDER
#define LTTNG_UST_TRACEPOINT_PROVIDER agnocast
#undef LTTNG_UST_TRACEPOINT_INCLUDE
#define LTTNG_UST_TRACEPOINT_INCLUDE "./agnocast_tp.h"
#if !defined(AGNOCAST_TP_H) || defined(LTTNG_UST_TRACEPOINT_HEADER_MULTI_READ)
#define AGNOCAST_TP_H
#include <lttng/tracepoint.h>
#include <stdint.h>
%s
#endif
#include <lttng/tracepoint-event.h>
"""
PROGRAM = r"""
#define LTTNG_UST_TRACEPOINT_CREATE_PROBES
#define LTTNG_UST_TRACEPOINT_DEFINE
#include "agnocast_tp.h"
#include <stdbool.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>
#define A(event, ...) lttng_ust_tracepoint(agnocast, agnocast_##event, __VA_ARGS__)
void ros_trace_rcl_init(const void *);
void ros_trace_rcl_node_init(const void *, const void *, const char *, const char *);
void ros_trace_rcl_publisher_init(const void *, const void *, const void *, const char *, int64_t);
void ros_trace_rcl_publish(const void *, const void *);
void ros_trace_rmw_publish(const void *, const void *, int64_t);
static char context, node, pub, rmw, sub, polled, timer, group, executor, callback, callable;
static char message;

static uint64_t set_up(const char *name, const char *in)
{
    uint64_t number = (uint64_t)getpid() << 32 | 1;
    prctl(PR_SET_NAME, name);
    A(init, &context);
    A(construct_executor, &executor, "agnocast_only_single_threaded_executor");
    A(node_init, &node, name, "/");
    if (in)
        A(subscription_init, &sub, &node, &callback, &group, "Node::cb", in, 1, number);
    A(add_callback_group, &executor, &node, &group, "mutually_exclusive");
    return number;
}
static void sensor(int out)
{
    set_up("sensor", NULL);
    A(publisher_init, &pub, &node, "/points", 1);
    A(timer_init, &timer, &node, &callback, &group, "Node::tick", 2000000);
    for (uint64_t entry = 0; entry < 100; entry++) {
        usleep(2000);
        A(create_timer_callable, &callable, &timer);
        A(callable_start, &callable);
        A(publish, &pub, entry);
        if (write(out, &entry, sizeof entry) < 0)
            _exit(1);
        A(callable_end, &callable);
    }
}
static void filter(int in, int out)
{
    uint64_t number = set_up("filter", "/points"), entry;
    A(subscription_init, &polled, &node, &callback, &group, "dummy_take/map", "/map", 1, 0);
    A(publisher_init, &pub, &node, "/filtered", 1);
    while (read(in, &entry, sizeof entry) > 0) {
        A(create_callable, &callable, entry, number);
        A(callable_start, &callable);
        A(take, &polled, NULL, 0);
        A(publish, &pub, entry + 7);
        if (write(out, &entry, sizeof entry) < 0)
            _exit(1);
        A(callable_end, &callable);
    }
}
static void bridge(int in)
{
    uint64_t number, entry;
    ros_trace_rcl_init(&rmw);
    ros_trace_rcl_node_init(&timer, &rmw, "bridge", "/");
    ros_trace_rcl_publisher_init(&pub, &timer, &rmw, "/filtered", 10);
    number = set_up("agnocast_bridge", "/filtered");
    while (read(in, &entry, sizeof entry) > 0) {
        A(create_callable, &callable, entry + 7, number);
        A(callable_start, &callable);
        ros_trace_rcl_publish(&pub, &message);
        ros_trace_rmw_publish(&rmw, &message, 1700000000000000000 + entry);
        A(callable_end, &callable);
    }
}
int main(void)
{
    int points[2], filtered[2];
    if (pipe(points) || pipe(filtered))
        return 1;
    if (!fork()) {
        close(points[1]);
        filter(points[0], filtered[1]);
        return 0;
    }
    close(points[0]);
    close(filtered[1]);
    if (!fork()) {
        close(points[1]);
        bridge(filtered[0]);
        return 0;
    }
    usleep(200000);
    sensor(points[1]);
    close(points[1]);
    while (wait(NULL) > 0) {}
}
"""


def tracepoint(name: str, fields: str) -> str:
    parts = [part.split() for part in fields.split(", ")]
    arguments = ", ".join(f"{TYPES[kind]}, {field}_arg" for kind, field in parts)
    recorded = " ".join(FIELDS[kind].format(field) for kind, field in parts)
    return (
        f"LTTNG_UST_TRACEPOINT_EVENT(agnocast, {name}, LTTNG_UST_TP_ARGS({arguments}),"
        f" LTTNG_UST_TP_FIELDS({recorded}))"
    )


@pytest.fixture
def trace(tmp_path: Path) -> Path:
    try:
        require_lttng()
    except NotPossibleError as error:
        pytest.skip(f"cannot record: {error}")
    events = "\n".join(tracepoint(name, fields) for name, fields in EVENTS.items())
    (tmp_path / "agnocast_tp.h").write_text(HEADER % events)
    (tmp_path / "main.c").write_text(PROGRAM)
    library = build_tracetools(tmp_path)
    command = ["gcc", "-I.", "-o", "program", "main.c", str(library), "-llttng-ust"]
    subprocess.run([*command, f"-Wl,-rpath,{tmp_path}"], cwd=tmp_path, check=True)
    # A child that forks is registered with LTTng by its library for fork.
    preload = {"LTTNG_UST_REGISTER_TIMEOUT": "-1", "LD_PRELOAD": "liblttng-ust-fork.so"}
    with session(tmp_path / "trace"):
        subprocess.run([tmp_path / "program"], env=preload, check=True)
    return tmp_path / "trace"


@pytest.mark.thorough
def test_a_chain_of_three_processes(trace: Path, tmp_path: Path) -> None:
    with open_db(tmp_path / "run.duckdb") as db:
        db.ingest(trace)
    with duckdb.connect(str(tmp_path / "run.duckdb"), read_only=True) as connection:

        def rows(query: str) -> list[tuple[object, ...]]:
            return connection.execute(query).fetchall()

        assert rows(
            "SELECT method, candidate_count, count(*) FROM link_transport GROUP BY ALL"
        ) == [("agnocast", 1, 200)]
        # Each message is that with the same number, and both have it in order.
        assert rows(
            "SELECT count(*) FROM link_transport AS l "
            "JOIN agnocast_entry AS b ON l.publication_id = b.publication_id "
            "JOIN agnocast_entry AS t ON l.take_id = t.take_id WHERE b.entry_id <> t.entry_id"
        ) == [(0,)]
        assert rows("SELECT kind, count(*) FROM link_causal GROUP BY ALL") == [("direct", 300)]
        assert rows("SELECT status, count(*) FROM stat_delivery GROUP BY ALL") == [
            ("delivered", 200)
        ]
        assert rows("SELECT full_name FROM node ORDER BY 1") == [
            ("/agnocast_bridge",),
            ("/bridge",),
            ("/filter",),
            ("/sensor",),
        ]
        assert rows("SELECT period_ns FROM timer") == [(2_000_000,)]
        assert rows("SELECT DISTINCT kind, is_inferred FROM executor") == [
            ("agnocast_only_single_threaded_executor", False)
        ]
        assert rows("SELECT count(*) FROM failed_take") == [(0,)]
        assert rows("SELECT count(*) FROM take") == [(200,)]
        assert rows("SELECT max(n) FROM (SELECT len(topics) AS n FROM main.flow_path([1]))") == [
            (2,)
        ]
