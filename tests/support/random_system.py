"""Random systems for properties: timers, relays and sinks in several processes on two hosts.

Everything that a system does is drawn from one seed, so that a failing one can be had again.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from random import Random

from support.ros_system import RosSystem
from support.staged_events import Thread

TOPICS = ("/a", "/b", "/c")


@dataclass
class _Reader:
    thread: Thread
    handle: int
    callback: int
    outputs: tuple[int, ...]
    pending: deque[int] = field(default_factory=deque)


def random_system(seed: int, *, actions: int = 20) -> RosSystem:
    """Make a system in which messages are published, dropped, taken and passed on.

    The first process is the source of a chain through the others, with more ways at random.
    """
    random = Random(seed)
    system = RosSystem()
    system.add_source(0, "alpha", "boot-a")
    system.add_source(1, "beta", "boot-b")
    threads = [Thread(100 + 100 * n, trace=n % 2) for n in range(random.randint(3, 5))]
    readers: dict[str, list[_Reader]] = {topic: [] for topic in TOPICS}
    publishers: dict[tuple[Thread, int], str] = {}
    timers: list[tuple[Thread, int, tuple[int, ...]]] = []
    for position, thread in enumerate(threads):
        system.context(thread)
        system.node(thread, 0x1, f"node{thread.pid}")
        handles = []
        for number in range(random.randint(1, 2)):
            handles.append(0x10 + number)
            topic = random.choice(TOPICS) if number else TOPICS[min(position, 2)]
            publishers[thread, handles[-1]] = topic
            system.publisher(thread, handles[-1], publishers[thread, handles[-1]])
        for number in range(0 if thread is threads[0] else random.randint(1, 2)):
            topic = random.choice(TOPICS) if number else TOPICS[min(position, 3) - 1]
            reader = _Reader(thread, 0x30 + number, 0xC0 + number, _some(random, handles))
            system.subscription(thread, reader.handle, topic, callback=reader.callback)
            readers[topic].append(reader)
        if random.random() < 0.3 or thread is threads[0]:
            timers.append((thread, 0xD0, _some(random, handles) or (handles[0],)))
            system.timer(thread, 0x50, 0xD0)
    stamps = iter(range(1_000_000, 2_000_000, 7))

    def publish(thread: Thread, handles: tuple[int, ...]) -> None:
        for handle in handles:
            stamp = next(stamps)
            system.publish(thread, handle, stamp)
            for reader in readers[publishers[thread, handle]]:
                if random.random() < 0.85:
                    reader.pending.append(stamp)

    for _ in range(actions):
        waiting = [reader for group in readers.values() for reader in group if reader.pending]
        if waiting and random.random() < 0.75:
            reader = random.choice(waiting)
            system.execute(reader.thread, reader.handle)
            system.take(reader.thread, reader.handle, reader.pending.popleft())
            system.start(reader.thread, reader.callback)
            if random.random() < 0.8:
                publish(reader.thread, reader.outputs)
            if random.random() < 0.95:
                system.end(reader.thread, reader.callback)
            system.ready(reader.thread)
        else:
            thread, callback, outputs = random.choice(timers)
            is_callback = random.random() < 0.8
            if is_callback:
                system.start(thread, callback)
            publish(thread, outputs)
            if is_callback:
                system.end(thread, callback)
            system.idle(thread)
    return system


def _some(random: Random, handles: list[int]) -> tuple[int, ...]:
    return tuple(random.choices(handles, k=random.choice((0, 1, 1, 1, 2))))
