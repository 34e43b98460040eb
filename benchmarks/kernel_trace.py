"""A kernel trace beside a simulated recording, as large as asked, as lttng-modules writes one.

Each thread of the recording has its CPU while it emits events; in between, threads of other
processes wake and switch, with interrupts. Made with numpy: millions of events take seconds.
"""

from __future__ import annotations

import struct
import uuid
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

import msgflow.trace

if TYPE_CHECKING:
    from numpy.typing import NDArray

_CONTENT_BYTES = 200_000
_HEADER = [("id", "<u2"), ("time", "<u4")]
_RECORDS = {
    "sched_switch": [
        ("prev_comm", "S16"),
        ("prev_tid", "<i4"),
        ("prev_prio", "<i4"),
        ("prev_state", "<i8"),
        ("next_comm", "S16"),
        ("next_tid", "<i4"),
        ("next_prio", "<i4"),
    ],
    "sched_waking": [("comm", "S16"), ("tid", "<i4"), ("prio", "<i4"), ("target_cpu", "<i4")],
    "irq_softirq_entry": [("vec", "<u4")],
    "irq_softirq_exit": [("vec", "<u4")],
}
_SWITCH, _WAKING, _ENTRY, _EXIT = range(4)
_OTHERS = 300  # threads of other processes
_OWN = 2_000  # how long before its first event a thread gets the CPU [ns]


@dataclass(frozen=True)
class _Stretch:
    """Times [ns] in which threads of the recording have a CPU, one after the other."""

    begin: NDArray[np.int64]
    end: NDArray[np.int64]
    tid: NDArray[np.int32]


def write_beside(ust: Path, directory: Path, events: int) -> int:
    """Write a kernel trace of about so many events of the run of `ust`; return how many."""
    with msgflow.trace.open([ust]) as traces:
        info = traces.traces[0]
        names = {name: pa.schema([]) for trace in traces.traces for name in trace.event_names}
        parts = [
            [np.asarray(batch.batch[column]) for column in ("ts_ns", "cpu_id", "vtid")]
            for batch in traces.batches(names)
            if batch.name != msgflow.trace.PACKET
        ]
    times, cpus, tids = (np.concatenate(column) for column in zip(*parts, strict=True))
    directory.mkdir(parents=True)
    identity = uuid.UUID(int=7)
    text = _metadata(identity, info)
    (directory / "metadata").write_text(text, encoding="utf-8")
    random = np.random.default_rng(1)
    written = 0
    for cpu in np.unique(cpus).tolist():
        own = np.flatnonzero(cpus == cpu)
        own = own[np.argsort(times[own], kind="stable")]
        share = events * own.size // times.size
        records = _records(_stretches(times[own], tids[own]), share, random)
        written += _write(directory / f"kernel_{cpu}", records, cpu, identity, info)
    return written


def _stretches(times: NDArray[np.int64], tids: NDArray[np.int32]) -> _Stretch:
    """Return when threads have the CPU: from before their first event until after their last."""
    is_first = np.append(True, (tids[1:] != tids[:-1]) | (np.diff(times) > 25 * _OWN))
    first = np.flatnonzero(is_first)
    last = np.append(first[1:], times.size) - 1
    middle = (times[last[:-1]] + times[first[1:]]) // 2
    begin = np.maximum(times[first] - _OWN, np.append(times[0] - _OWN, middle))
    end = np.minimum(times[last] + _OWN, np.append(middle, times[-1] + _OWN))
    return _Stretch(begin, np.maximum(end, times[last] + 1), tids[first])


def _records(
    own: _Stretch, events: int, random: np.random.Generator
) -> tuple[NDArray[np.int64], NDArray[np.int8], NDArray[np.int32], NDArray[np.int32]]:
    """Return time, kind, thread and thread before of the events of a CPU, in order of time."""
    # Of four events of others, two are a switch and its waking, and half of these have softirqs.
    count = max((events - 3 * own.tid.size) // 3, 0)
    gaps = np.maximum(own.begin[1:] - own.end[:-1], 0)
    place = np.sort(random.integers(0, max(int(gaps.sum()), 1), count))
    ends = np.cumsum(gaps)
    gap = np.searchsorted(ends, place, side="right")
    at = place - (ends - gaps)[gap] + own.end[gap]
    others = random.integers(100_000, 100_000 + _OTHERS, count, dtype=np.int32)
    switch_at = np.concatenate([own.begin, own.end, at])
    switch_to = np.concatenate([own.tid, np.zeros_like(own.tid), others])
    order = np.argsort(switch_at, kind="stable")
    switch_at, switch_to = switch_at[order], switch_to[order]
    before = np.append(0, switch_to[:-1]).astype(np.int32)
    woken = np.flatnonzero(switch_to)
    interrupted = woken[::2]
    parts = [
        (switch_at, _SWITCH, switch_to, before),
        (switch_at[woken] - 300, _WAKING, switch_to[woken], before[woken]),
        (switch_at[interrupted] - 400, _ENTRY, switch_to[interrupted], before[interrupted]),
        (switch_at[interrupted] - 200, _EXIT, switch_to[interrupted], before[interrupted]),
    ]
    times = np.concatenate([part[0] for part in parts])
    order = np.argsort(times, kind="stable")
    kinds = np.concatenate([np.full(part[0].size, part[1], np.int8) for part in parts])
    tids, befores = (np.concatenate([part[n] for part in parts]) for n in (2, 3))
    return times[order], kinds[order], tids[order], befores[order]


def _write(path: Path, records: Any, cpu: int, identity: uuid.UUID, info: Any) -> int:
    times, kinds, tids, befores = records
    cycles = times - info.clock_offset_ns
    types = [np.dtype(_HEADER + fields) for fields in _RECORDS.values()]
    sizes = np.array([one.itemsize for one in types])[kinds]
    ends = np.cumsum(sizes)
    packet = (ends - sizes) // _CONTENT_BYTES
    bounds = np.append(np.flatnonzero(np.append(True, np.diff(packet))), times.size)
    with path.open("wb") as file:
        for sequence, (begin, end) in enumerate(pairwise(bounds.tolist())):
            rows = slice(begin, end)
            at = ends[rows] - sizes[rows]
            content = np.zeros(ends[end - 1] - at[0], np.uint8)
            for kind, of_kind in enumerate(types):
                chosen = np.flatnonzero(kinds[rows] == kind)
                made = _made(of_kind, kind, tids[rows][chosen], befores[rows][chosen])
                made["time"] = cycles[rows][chosen] & 0xFFFFFFFF
                where = (at[chosen] - at[0])[:, np.newaxis] + np.arange(of_kind.itemsize)
                content[where] = made.view(np.uint8).reshape(-1, of_kind.itemsize)
            bits = (84 + content.size) * 8
            size = -(-bits // (8 * 4096)) * 4096
            head = struct.pack("<I16sIQ", 0xC1FC1FC1, identity.bytes, 0, cpu)
            span = int(cycles[begin]), int(cycles[end - 1])
            head += struct.pack("<QQQQQQI", *span, bits, size * 8, sequence, 0, cpu)
            file.write((head + content.tobytes()).ljust(size, b"\0"))
    return int(times.size)


def _made(
    of_kind: np.dtype[Any], kind: int, tids: NDArray[np.int32], befores: NDArray[np.int32]
) -> NDArray[Any]:
    made = np.zeros(tids.size, of_kind)
    made["id"] = kind
    if kind == _SWITCH:
        made["prev_comm"], made["next_comm"] = _names(befores), _names(tids)
        made["prev_tid"], made["next_tid"] = befores, tids
        made["prev_prio"] = made["next_prio"] = 20
        made["prev_state"] = (befores != 0).astype(np.int64)
    elif kind == _WAKING:
        made["comm"], made["tid"], made["prio"] = _names(tids), tids, 20
    return made


def _names(tids: NDArray[np.int32]) -> NDArray[np.bytes_]:
    known, place = np.unique(tids, return_inverse=True)
    return np.array([f"thread-{tid}" for tid in known.tolist()], "S16")[place]


def _metadata(identity: uuid.UUID, info: Any) -> str:
    text = "integer { size = 8; align = 8; signed = 1; encoding = UTF8; base = 10; }"
    types = {
        "S16": lambda name: f"{text} _{name}[16];",
        "<i4": lambda name: f"integer {{ size = 32; align = 8; signed = 1; }} _{name};",
        "<u4": lambda name: f"integer {{ size = 32; align = 8; signed = 0; }} _{name};",
        "<i8": lambda name: f"integer {{ size = 64; align = 8; signed = 1; }} _{name};",
    }
    events = "".join(
        f'event {{ name = "{name}"; id = {number}; stream_id = 0; fields := struct {{ '
        + " ".join(types[of_field](field) for field, of_field in fields)
        + " }; };\n"
        for number, (name, fields) in enumerate(_RECORDS.items())
    )
    return f"""/* CTF 1.8 */
typealias integer {{ size = 8; align = 8; signed = false; }} := uint8_t;
typealias integer {{ size = 16; align = 8; signed = false; }} := uint16_t;
typealias integer {{ size = 32; align = 8; signed = false; }} := uint32_t;
typealias integer {{ size = 64; align = 8; signed = false; }} := uint64_t;
trace {{ major = 1; minor = 8; uuid = "{identity}"; byte_order = le;
    packet.header := struct {{
        uint32_t magic; uint8_t uuid[16]; uint32_t stream_id; uint64_t stream_instance_id;
    }};
}};
env {{ hostname = "{info.hostname}"; domain = "kernel"; tracer_name = "lttng-modules";
    tracer_major = 2; tracer_minor = 13; tracer_patchlevel = 12; }};
clock {{ name = "{info.clock_name}"; uuid = "{info.clock_uuid}"; freq = 1000000000;
    offset = {info.clock_offset_ns}; }};
typealias integer {{ size = 32; align = 8; signed = false; map = clock.{info.clock_name}.value; }}
    := uint32_clock_t;
typealias integer {{ size = 64; align = 8; signed = false; map = clock.{info.clock_name}.value; }}
    := uint64_clock_t;
struct packet_context {{
    uint64_clock_t timestamp_begin; uint64_clock_t timestamp_end; uint64_t content_size;
    uint64_t packet_size; uint64_t packet_seq_num; uint64_t events_discarded; uint32_t cpu_id;
}};
struct event_header_large {{
    enum : uint16_t {{ compact = 0 ... 65534, extended = 65535 }} id;
    variant <id> {{
        struct {{ uint32_clock_t timestamp; }} compact;
        struct {{ uint32_t id; uint64_clock_t timestamp; }} extended;
    }} v;
}} align(8);
stream {{
    id = 0; event.header := struct event_header_large; packet.context := struct packet_context;
}};
{events}"""
