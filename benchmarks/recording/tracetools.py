"""The library of ROS 2's tracepoints, for today's LTTng: built from `tracepoints.toml`.

The wheels of ROS 2 on PyPI call the tracepoints of `libtracetools.so`. Theirs is linked with an
LTTng of 2016, which no session daemon of today accepts. This one has the same functions, and takes
its place if it is loaded first: `python benchmarks/recording/tracetools.py DIRECTORY`, then
`LD_PRELOAD=DIRECTORY/libtracetools.so`. It needs gcc and the headers of LTTng-UST.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import msgflow
from msgflow.backports import tomllib

# What the wheels of Kilted have.
VERSION = (8, 6, 0)
_GID = 16
# DuckDB's type -> (type of C, macro of LTTng for the field)
_TYPES = {
    "UBIGINT": ("const void *", "lttng_ust_field_integer_hex(const void *, {0}, {0})"),
    "BIGINT": ("int64_t", "lttng_ust_field_integer(int64_t, {0}, {0})"),
    # An int of the trace is a bool of the function.
    "INTEGER": ("bool", "lttng_ust_field_integer(int32_t, {0}, {0})"),
    "VARCHAR": ("const char *", "lttng_ust_field_string({0}, {0})"),
    "UTINYINT[]": ("const uint8_t *", f"lttng_ust_field_array(uint8_t, {{0}}, {{0}}, {_GID})"),
}
# Parameters that the function has, and the event has not.
_NOT_RECORDED = {"rclcpp_publish": ("const void * publisher_handle",)}
_HEADER = """
#undef LTTNG_UST_TRACEPOINT_PROVIDER
#define LTTNG_UST_TRACEPOINT_PROVIDER ros2
#undef LTTNG_UST_TRACEPOINT_INCLUDE
#define LTTNG_UST_TRACEPOINT_INCLUDE "./tracepoints.h"
#if !defined(TRACEPOINTS_H) || defined(LTTNG_UST_TRACEPOINT_HEADER_MULTI_READ)
#define TRACEPOINTS_H
#include <lttng/tracepoint.h>
#include <stdbool.h>
#include <stdint.h>
{events}
#endif
#include <lttng/tracepoint-event.h>
"""
_EVENT = """
LTTNG_UST_TRACEPOINT_EVENT(ros2, {name}, LTTNG_UST_TP_ARGS({arguments}),
    LTTNG_UST_TP_FIELDS({fields}))
"""
_SOURCE = """
#define LTTNG_UST_TRACEPOINT_CREATE_PROBES
#define LTTNG_UST_TRACEPOINT_DEFINE
#include "tracepoints.h"
{functions}
"""
_FUNCTIONS = """
void ros_trace_{name}({parameters}) {{ lttng_ust_tracepoint(ros2, {name}{values}); }}
void ros_trace_do_{name}({parameters}) {{ lttng_ust_do_tracepoint(ros2, {name}{values}); }}
bool ros_trace_enabled_{name}(void) {{ return lttng_ust_tracepoint_enabled(ros2, {name}); }}
"""


def build_tracetools(directory: Path) -> Path:
    """Compile the library in a directory, and return its path.

    Raises:
        subprocess.CalledProcessError: the compiler or the headers of LTTng-UST are missing.
    """
    tracepoints = [one for one in _tracepoints() if _is_known(one)]
    events = "".join(_event(one["name"], one["fields"]) for one in tracepoints)
    functions = "".join(_functions(one["name"], one["fields"]) for one in tracepoints)
    (directory / "tracepoints.h").write_text(_HEADER.format(events=events))
    (directory / "tracetools.c").write_text(_SOURCE.format(functions=functions))
    library = directory / "libtracetools.so"
    command = f"gcc -O2 -shared -fPIC -I. -Wl,-soname,{library.name} -o {library.name} tracetools.c"
    subprocess.run([*command.split(), "-llttng-ust"], cwd=directory, check=True)
    return library


def build_program(source: Path, directory: Path) -> Path:
    """Compile a program of C that calls the tracepoints, beside their library."""
    program = directory / source.stem
    command = ["gcc", "-O2", "-pthread", "-o", str(program), str(source), f"-L{directory}"]
    subprocess.run([*command, "-ltracetools"], check=True)
    return program


def parameters() -> dict[str, list[str]]:
    """Return the parameters of the functions, type and name, by the tracepoint's name."""
    return {
        one["name"]: _parameters(one["name"], one["fields"])
        for one in _tracepoints()
        if _is_known(one)
    }


def _tracepoints() -> list[dict[str, Any]]:
    """Return the tracepoints of ROS 2 as this version has them."""
    path = Path(msgflow.__file__).parent / "ingest" / "tracepoints.toml"
    return [
        one
        | {
            "name": one["name"].removeprefix("ros2:"),
            "fields": [each for each in one["fields"] if _is_present(each)],
        }
        for one in tomllib.loads(path.read_text())["tracepoint"]
        if one["name"].startswith("ros2:") and _is_present(one)
    ]


def _is_present(entry: dict[str, Any]) -> bool:
    since, until = (
        tuple(int(part) for part in entry[key].split(".")) if key in entry else None
        for key in ("since", "until")
    )
    if since is None and "where" in entry:
        return False
    return (since is None or since <= VERSION) and (until is None or until >= VERSION)


def _is_known(tracepoint: dict[str, Any]) -> bool:
    return all(field["type"] in _TYPES for field in tracepoint["fields"])


def _event(name: str, fields: list[dict[str, Any]]) -> str:
    return _EVENT.format(
        name=name,
        arguments=", ".join(f"{_TYPES[each['type']][0]}, {each['name']}" for each in fields),
        fields=" ".join(_TYPES[each["type"]][1].format(each["name"]) for each in fields),
    )


def _parameters(name: str, fields: list[dict[str, Any]]) -> list[str]:
    # The version is not given: it is that of the library.
    recorded = [
        f"{_TYPES[each['type']][0]} {each['name']}" for each in fields if each["name"] != "version"
    ]
    return [*_NOT_RECORDED.get(name, ()), *recorded]


def _functions(name: str, fields: list[dict[str, Any]]) -> str:
    version = '"' + ".".join(str(part) for part in VERSION) + '"'
    return _FUNCTIONS.format(
        name=name,
        parameters=", ".join(_parameters(name, fields)) or "void",
        values="".join(
            ", " + (version if each["name"] == "version" else each["name"]) for each in fields
        ),
    )


if __name__ == "__main__":
    target = Path(sys.argv[1]).absolute()
    target.mkdir(parents=True, exist_ok=True)
    print(f"export LD_PRELOAD={build_tracetools(target)}")
