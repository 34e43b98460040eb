"""Channels: messages with buffers that the middleware writes for each subscription on its own."""

from __future__ import annotations

from msgflow_sim.entity import MILLISECOND, SECOND, Publisher, Subscription, Timer, Work
from msgflow_sim.system import Executor, Host, Node, Process, Scenario

_IMAGE_BYTES = 900_000


def channels() -> Scenario:
    """Cameras and readers with channels of their own, shared ones, and for a while with none."""
    camera = Node(
        "camera",
        publishers=(
            Publisher("/image", size_bytes=_IMAGE_BYTES, is_buffer_aware=True),
            Publisher("/points", 20, size_bytes=200_000, is_buffer_aware=True),
            Publisher("/status"),
        ),
        timers=(
            Timer(5 * MILLISECOND, ("/image", "/status")),
            # Several are published before the thread goes on.
            Timer(17 * MILLISECOND, ("/points", "/points")),
        ),
    )
    # Its writes and those of the camera go on at the same time now and then.
    lidar = Node(
        "lidar",
        publishers=(Publisher("/points", 20, size_bytes=400_000, is_buffer_aware=True),),
        timers=(Timer(23 * MILLISECOND, ("/points",)),),
    )
    detector = Node(
        "detector",
        publishers=(Publisher("/detections", size_bytes=20_000, is_buffer_aware=True),),
        subscriptions=(
            Subscription("/image", ("/detections",), channel="own"),
            Subscription("/points", depth=20, channel="own"),
            Subscription("/status"),
        ),
    )
    # It is too slow for its queue.
    viewer = Node(
        "viewer",
        subscriptions=(
            Subscription("/image", work=Work(8 * MILLISECOND), depth=1, channel="shared"),
            Subscription("/detections", channel="shared"),
        ),
    )
    recorder = Node(
        "recorder",
        subscriptions=(
            Subscription("/image", depth=20, channel="shared"),
            Subscription("/points", depth=20, channel="own"),
            Subscription("/detections", depth=20, channel="own"),
        ),
    )
    # Who cannot read buffers makes the publishers write for all at once.
    echo = Node(
        "echo",
        subscriptions=(
            Subscription("/image", created_ns=250 * MILLISECOND, destroyed_ns=350 * MILLISECOND),
        ),
    )
    return Scenario(
        name="channels",
        description="Messages with buffers, written for each subscription on its own (rmw_zenoh).",
        hosts=(Host("alpha", cpu_count=4), Host("beta", cpu_count=4)),
        processes=(
            Process("camera", "alpha", 1101, (camera,)),
            Process("lidar", "alpha", 1201, (lidar,), start_ns=3 * MILLISECOND),
            Process("detector", "alpha", 1301, (detector,), start_ns=5 * MILLISECOND),
            Process("viewer", "alpha", 1401, (viewer,), start_ns=7 * MILLISECOND),
            Process("recorder", "beta", 1501, (recorder,), start_ns=9 * MILLISECOND),
            Process(
                "echo",
                "beta",
                1601,
                (echo,),
                start_ns=11 * MILLISECOND,
                executors=(Executor(),),
            ),
        ),
        duration_ns=6 * SECOND,
        overwrites=True,
    )
