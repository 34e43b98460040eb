"""Random histories of executors for properties: threads that wait, look, run, nest and lose events.

Nothing in them has to make sense to hold the properties; most does.
"""

from __future__ import annotations

from random import Random

from support.ros_system import RosSystem
from support.staged_events import Thread

CALLBACKS = 4
SUBSCRIPTION, CALLBACK, PUBLISHER = 0x30, 0xC0, 0x10


def random_executor(seed: int, *, threads: int, with_events: bool = True) -> RosSystem:
    """Make a process with one executor of this many threads, and one that publishes to it.

    Args:
        seed: everything is drawn from it.
        threads: how many threads run the callbacks.
        with_events: whether the executor tells what it does.
    """
    random = Random(seed)
    system = RosSystem()
    main, source = Thread(100), Thread(200)
    system.node(main, 0x1, "receiver")
    system.node(source, 0x1, "source")
    for number in range(CALLBACKS):
        topic = f"/topic{number}"
        system.publisher(source, PUBLISHER + number, topic)
        system.subscription(main, SUBSCRIPTION + number, topic, callback=CALLBACK + number)
    workers = [Thread(100, 100 + number) for number in range(threads)]
    running: dict[Thread, list[int]] = {worker: [] for worker in workers}
    queue: list[tuple[int, int]] = []
    for worker in workers:  # what they all run makes them one executor
        system.start(worker, CALLBACK)
        system.end(worker, CALLBACK)
    for stamp in range(1_000_000, 1_000_120):
        worker = random.choice(workers)
        action = random.random()
        if action < 0.2:
            number = random.randrange(CALLBACKS)
            system.publish(source, PUBLISHER + number, stamp)
            queue.append((number, stamp))
        elif action < 0.3:
            system.wait(random.choice((20, 500, 2_000_000)))
        elif action < 0.32:
            system.lose()
        elif action < 0.6 and with_events:
            word = random.choice((system.ready, system.ready, system.idle))
            word(worker)
        elif running[worker] and random.random() < 0.7:
            callback = running[worker].pop()
            if random.random() < 0.9:
                system.end(worker, callback)
        elif queue and (not running[worker] or random.random() < 0.2):
            number, sent = queue.pop(0)
            if with_events:
                system.execute(worker, SUBSCRIPTION + number)
            system.take(worker, SUBSCRIPTION + number, sent)
            system.start(worker, CALLBACK + number)
            running[worker].append(CALLBACK + number)
    return system
