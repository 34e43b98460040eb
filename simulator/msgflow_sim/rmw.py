"""The middleware layer (rmw) and DDS: they stamp and write a message, or read it.

The layout says which of them makes the source stamp and when, and which `dds:*` events there are.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from msgflow_sim.scheduler import Dice, tail

if TYPE_CHECKING:
    from msgflow_sim.machine import Thread
    from msgflow_sim.objects import SubscriptionObject

# Fast DDS serialises a message before it stamps it, at about 5 bytes per ns.
_SERIALISING_NS_PER_BYTE = 0.2
_SENDING_NS_PER_BYTE = 0.08
# Now and then the writer is locked, or the thread has lost its CPU.
_HELD_UP = 1 / 400
_LONGEST_HOLD_UP_NS = 250_000
# Where an object of the middleware layer keeps that of DDS.
_ENTITY_OFFSET = 0x2A0


@dataclass(frozen=True, slots=True)
class Written:
    """A message that was written.

    Attributes:
        rmw: time of rmw_publish.
        stamp_ns: source stamp, in ns since the epoch.
        end: time at which the call returns.
        dds: times of the `dds:*` events, with their names.
    """

    rmw: int
    stamp_ns: int
    end: int
    dds: tuple[tuple[str, int], ...] = ()

    def add_to_truth(self, thread: Thread, publication_id: int) -> None:
        """Write down the `dds:*` events of a publication."""
        machine = thread.machine
        for event, time in self.dds:
            thread.scheduler.truth.dds_event.add(
                publication_id,
                machine.hostname,
                thread.process.pid,
                thread.tid,
                event,
                time + machine.epoch,
            )


def entity_of(rmw_handle: int) -> int:
    """The DDS writer or reader that belongs to a publisher or subscription."""
    return rmw_handle + _ENTITY_OFFSET


def write(
    thread: Thread, rmw_handle: int, message: int, time: int, random: Dice, size_bytes: int = 0
) -> Written:
    """Publish a message in the middleware layer, called at `time`."""
    machine = thread.machine
    layout = machine.layout
    tracepoints, emit, context = machine.tracepoints, thread.emit, thread.context
    pace = machine.publish_pace
    duration = int(size_bytes * _SERIALISING_NS_PER_BYTE * (0.8 + 0.4 * random()))
    if layout.is_stamped_by_rmw:
        # The rmw layer reads the clock first and emits the event then.
        stamp = time + int((200 + int(random() * 500)) * pace)
        rmw = stamp + int((60 + int(random() * 200)) * pace)
        stamp_ns = machine.stamp_ns(stamp)
        emit(tracepoints.rmw_publish, rmw, context, rmw_handle, message, stamp_ns)
        return Written(rmw, stamp_ns, rmw + duration + int(size_bytes * _SENDING_NS_PER_BYTE))

    rmw = time + int((260 + int(random() * 700)) * pace)
    emit(tracepoints.rmw_publish, rmw, context, rmw_handle, message, 0)
    entered = rmw + int((150 + int(random() * 400)) * pace)
    emit(tracepoints.ros2_caret_dds_write, entered, context, message)
    stamp = entered + int((200 + int(random() * 800)) * pace)
    if not layout.is_stamped_early:
        stamp += duration + int(tail(random, 1_500) * pace)
        if random() < _HELD_UP:
            stamp += int(random() * _LONGEST_HOLD_UP_NS)
    stamp_ns = machine.stamp_ns(stamp)
    writer = entity_of(rmw_handle)
    end = stamp
    dds = []
    for name in layout.dds_write:
        if name == "dds:write":
            end = stamp + int((60 + int(random() * 300)) * pace)
            emit(tracepoints.dds_write, end, context, writer, message, stamp_ns)
        else:
            end = end + int(150 * pace) if end > stamp else entered
            emit(tracepoints.dds_write_pre, end, context, writer, message)
        dds.append((name, end))
    if tracepoints.ros2_caret_dds_bind_addr_to_stamp.pack is not None:
        # Fast DDS does not know the message.
        end += 200
        emit(tracepoints.ros2_caret_dds_bind_addr_to_stamp, end, context, 0, stamp_ns)
    if layout.is_stamped_early:
        end += duration
    return Written(rmw, stamp_ns, end + int(size_bytes * _SENDING_NS_PER_BYTE), tuple(dds))


def write_to_channels(
    thread: Thread,
    channels: list[list[SubscriptionObject]],
    time: int,
    random: Dice,
    size_bytes: int,
) -> tuple[dict[SubscriptionObject, int], int]:
    """Publish a message on one channel after the other, called at `time`; no event tells.

    Returns the source stamps by subscription, and the time at which the call returns.
    """
    machine = thread.machine
    stamps: dict[SubscriptionObject, int] = {}
    for channel in channels:
        time += 400 + int(random() * 800)
        time += int(size_bytes * _SERIALISING_NS_PER_BYTE * (0.8 + 0.4 * random()))
        time += tail(random, 1_500)
        stamps |= dict.fromkeys(channel, machine.stamp_ns(time))
        time += 1_000 + int(size_bytes * _SENDING_NS_PER_BYTE)
    return stamps, time


def read(thread: Thread, rmw_handle: int, buffer: int, time: int, stamp_ns: int, taken: int) -> int:
    """Try to take a message in the middleware layer from `time` on; returns the time of rmw_take.

    `stamp_ns` is the message's source stamp, 0 if there is none; `taken` is 1 if there was one.
    """
    tracepoints, emit, context = thread.machine.tracepoints, thread.emit, thread.context
    emit(tracepoints.dds_read, time, context, entity_of(rmw_handle), buffer)
    rmw = time + 250
    emit(tracepoints.rmw_take, rmw, context, rmw_handle, buffer, stamp_ns, taken)
    return rmw
