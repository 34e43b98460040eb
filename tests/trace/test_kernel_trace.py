"""Packets in kernel traces: headers inside variants, read at once or field by field."""

from __future__ import annotations

import uuid
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import pyarrow as pa
import pytest
from support.kernel_traces import (
    FREQUENCY,
    ICMP,
    KHZ,
    NOISE,
    RECEIVED,
    SENT,
    TCP,
    UDP,
    Header,
    KernelEvent,
    KernelTrace,
    write_kernel_trace,
)
from support.same_batches import differences, read

from msgflow.ingest import catalogue
from msgflow.trace.ctf.record_batch import ClassPlan

Read = Callable[..., dict[str, list[dict[str, Any]]]]

WANTED = {
    name: tracepoint.arrow_schema()
    for name, tracepoint in catalogue.load().tracepoints.items()
    if tracepoint.is_kernel
}
V6 = ("fe80:0:0:0:0:0:0:1", "fe80:0:0:0:0:0:0:abcd")


def headers(random: Random, count: int) -> list[Header | None]:
    made: list[Header | None] = []
    for number in range(count):
        addresses = random.choice([("10.0.0.1", "10.0.0.2"), ("192.168.1.20", "239.255.0.1"), V6])
        made.append(
            random.choice(
                [
                    None,
                    Header(*addresses, random.choice([TCP, UDP, ICMP, 99]), (7400, 7411 + number)),
                    Header(*addresses, TCP, (22, 60_000), number, sequence=2**32 - 1 - number),
                ]
            )
        )
    return made


@pytest.fixture(scope="module", params=[False, True], ids=["bare", "contexts"])
def trace(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A trace with packets of all kinds between other events."""
    random = Random(1)
    events = []
    for number, header in enumerate(headers(random, 3000)):
        time = 10**18 + 1000 * number
        events.append(KernelEvent(time, NOISE, cpu=number % 2))
        device = random.choice(["lo", "eth0", "wlp0s20f3"])
        name = random.choice([SENT, RECEIVED, "net_if_rx"])
        events.append(KernelEvent(time + 5, name, header, device, cpu=number % 2))
    content = KernelTrace("robot", uuid.UUID(int=9), 10**17, events, contexts=request.param)
    return write_kernel_trace(tmp_path_factory.mktemp("kernel") / "kernel", content)


def test_headers_are_read(tmp_path: Path, read_rows: Read) -> None:
    events = [
        KernelEvent(10**18, SENT, Header(*V6, TCP, (1, 2), sequence=2**32 - 2, acknowledgement=3)),
        KernelEvent(10**18 + 1, SENT, Header("10.0.0.1", "10.0.0.255", UDP, (4, 5), 6, checksum=7)),
        KernelEvent(10**18 + 2, SENT, None),
        KernelEvent(10**18 + 3, SENT, Header(protocol=99)),
    ]
    directory = write_kernel_trace(
        tmp_path / "kernel", KernelTrace("robot", uuid.UUID(int=9), 10**17, events)
    )
    rows = read_rows(directory, wanted=WANTED)[SENT]
    names = list(WANTED[SENT].names)
    assert [[row[name] for name in names] for row in rows] == [
        [
            [0xFE80, 0, 0, 0, 0, 0, 0, 1],
            [0xFE80, 0, 0, 0, 0, 0, 0, 0xABCD],
            None,
            None,
            1,
            2,
            2**32 - 2,
            3,
            None,
            None,
        ],
        [[10, 0, 0, 1], [10, 0, 0, 255], 6, 0x4000, 4, 5, None, None, 108, 7],
        [None] * 10,
        [[10, 0, 0, 1], [10, 0, 0, 2], 1, 0x4000, *[None] * 6],
    ]


def test_the_cpu_of_a_frequency_is_not_that_of_its_event(tmp_path: Path, read_rows: Read) -> None:
    events = [KernelEvent(10**18, FREQUENCY, cpu=1)]
    directory = write_kernel_trace(
        tmp_path / "kernel", KernelTrace("robot", uuid.UUID(int=9), 10**17, events)
    )
    (row,) = read_rows(directory, wanted=WANTED)[FREQUENCY]
    assert (row["cpu_id"], row["of_cpu"], row["frequency_khz"]) == (1, 2, KHZ)


@pytest.mark.thorough
def test_readers_agree(trace: Path, bt2_bindings: object) -> None:
    for wanted in (WANTED, None):
        ours, theirs = (read(trace, reader=name, wanted=wanted) for name in ("msgflow", "bt2"))
        assert ours.event_counts == theirs.event_counts
        assert not differences(ours, theirs)
        assert not ours.damages
    assert sum(len(rows) for rows in ours.rows.values()) > 6000


def test_fast_and_slow_agree(trace: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plans = []
    is_field_by_field = ClassPlan.is_field_by_field.fget
    assert is_field_by_field is not None

    def noted(plan: ClassPlan) -> bool:
        plans.append((plan.layout.event.name, is_field_by_field(plan)))
        return is_field_by_field(plan)

    monkeypatch.setattr(ClassPlan, "is_field_by_field", property(noted))
    fast = read(trace, wanted=WANTED, batch_rows=100)
    assert set(plans) == {(SENT, False), (RECEIVED, False), (FREQUENCY, False)}
    monkeypatch.setattr(ClassPlan, "is_field_by_field", property(lambda plan: True))
    assert read(trace, wanted=WANTED, batch_rows=100).rows == fast.rows


def test_an_array_that_only_some_rows_have(trace: Path) -> None:
    wanted = {SENT: pa.schema([WANTED[SENT].field("source_address")])}
    content = read(trace, wanted=wanted)
    lengths = {None if row[-1] is None else len(row[-1]) for row in content.rows[SENT]}
    assert lengths == {None, 4, 8}


def test_damage_is_said_and_what_is_before_kept(trace: Path, tmp_path: Path) -> None:
    copy = tmp_path / "damaged"
    copy.mkdir()
    for path in trace.iterdir():
        (copy / path.name).write_bytes(path.read_bytes())
    stream = copy / "kchan_0"
    data = bytearray(stream.read_bytes())
    at = data.index(b"eth0\0\1", 20_000) + 5
    data[at] = 77  # there is no such kind of network header
    stream.write_bytes(data)
    whole, damaged = read(trace, wanted=WANTED), read(copy, wanted=WANTED)
    assert ["no option for the value 77" in damage.message for damage in damaged.damages] == [True]
    assert 0 < len(damaged.rows[SENT]) < len(whole.rows[SENT])
