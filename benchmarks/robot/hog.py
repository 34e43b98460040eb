"""A program without ROS that takes the CPU before others.

    python hog.py [CPU BUSY IDLE]

All that it can get with a higher priority; or, as a real-time program, so many seconds of one CPU
between so many without.
"""

import contextlib
import os
import signal
import sys
import time
from pathlib import Path

_PRIORITY = 79

# Ctrl-C ends it without a word.
signal.signal(signal.SIGINT, signal.SIG_DFL)
Path("/proc/self/comm").write_text("compressor")
if len(sys.argv) == 1:
    with contextlib.suppress(PermissionError):
        os.nice(-10)
    while True:
        pass
os.sched_setaffinity(0, {int(sys.argv[1])})
try:
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
except PermissionError:
    os.nice(-20)
busy, idle = map(float, sys.argv[2:])
while True:
    end = time.monotonic() + busy
    while time.monotonic() < end:
        pass
    time.sleep(idle)
