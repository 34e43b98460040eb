"""What C++ has in rclpy."""

import ctypes
import os

if os.path.exists(os.environ["FAKE_LIBRARY"]):
    ctypes.CDLL(os.environ["FAKE_LIBRARY"])


class Handle:
    def __init__(self, pointer):
        self.pointer = pointer


class WaitSet:
    def wait(self, timeout):
        pass


class ActionClient:
    def take_goal_response(self, kind):
        return 1, kind

    take_cancel_response = take_result_response = take_goal_response
