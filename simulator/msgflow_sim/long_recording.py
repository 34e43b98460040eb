"""Long recording: half an hour of Humble with few, big messages and a clock that is slewed."""

from __future__ import annotations

from msgflow_sim.entity import MILLISECOND, SECOND, Publisher, Subscription, Timer, Work
from msgflow_sim.recording import Recording
from msgflow_sim.system import Host, Node, Process, Scenario

_HOST = "robot"
_IMAGE_BYTES = 10_000_000


def long_recording() -> Scenario:
    """A camera of 5 Hz with images of 10 MB, a rectified copy of them and a detector, stock Humble.

    The clock of source stamps runs 20 ppm faster than that of the trace, 36 ms in all.
    """
    camera = Node(
        "camera",
        publishers=(Publisher("/image", 5, _IMAGE_BYTES), Publisher("/camera_info", 5)),
        timers=(Timer(200 * MILLISECOND, ("/image", "/camera_info"), Work(900_000, 700_000)),),
    )
    rectifier = Node(
        "rectifier",
        publishers=(Publisher("/image_rect", 5, _IMAGE_BYTES),),
        subscriptions=(
            Subscription(
                "/image",
                ("/image_rect",),
                Work(9_000_000, 4_000_000),
                5,
                message_type="sensor_msgs::msg::Image",
            ),
            Subscription("/camera_info", depth=5, message_type="sensor_msgs::msg::CameraInfo"),
        ),
    )
    detector = Node(
        "detector",
        publishers=(Publisher("/detections"),),
        subscriptions=(
            Subscription(
                "/image_rect",
                ("/detections",),
                Work(20_000_000, 15_000_000, 0.02, 120_000_000),
                message_type="sensor_msgs::msg::Image",
            ),
        ),
    )
    logger = Node("logger", subscriptions=(Subscription("/detections", logs=True),))
    return Scenario(
        name="long_recording",
        description="Half an hour of Humble: images of 10 MB, source stamps 20 ppm too fast.",
        hosts=(Host(_HOST),),
        processes=(
            Process("camera", _HOST, 1101, (camera,)),
            Process("rectifier", _HOST, 1201, (rectifier,), start_ns=30 * MILLISECOND),
            Process("detector", _HOST, 1301, (detector,), start_ns=60 * MILLISECOND),
            Process("logger", _HOST, 1401, (logger,), start_ns=90 * MILLISECOND),
        ),
        duration_ns=1800 * SECOND,
        layout="humble",
        recording=Recording(slew_ppm=20),
    )
