"""A program without ROS that takes the CPU before others, named by its command line alone.

python train.py
"""

import contextlib
import os
import signal

# Ctrl-C ends it without a word.
signal.signal(signal.SIGINT, signal.SIG_DFL)
with contextlib.suppress(PermissionError):
    os.nice(-10)
while True:
    pass
