"""What has callbacks."""

from rclpy._core import Handle


class Subscription:
    def __init__(self, pointer, callback):
        self.handle = Handle(pointer)
        self.callback = callback
