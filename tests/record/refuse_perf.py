"""Runs a program that may not call perf_event_open, as in a container: python refuse_perf.py WORDS.

The system call fails as Docker's profile of seccomp has it, in the program and in what it starts.
"""

import ctypes
import errno
import os
import platform
import struct
import sys

_NO_NEW_PRIVILEGES = 38
_SECCOMP = 22
_FILTER = 2
_ALLOW = 0x7FFF0000
_ERROR = 0x00050000 | errno.EPERM
_CALLS = {"x86_64": 298, "aarch64": 241}


def refuse() -> None:
    """Have the kernel refuse the call from now on."""
    instructions = b"".join(
        struct.pack("=HBBI", *each)
        for each in (
            (0x20, 0, 0, 0),  # load the number of the call
            (0x15, 0, 1, _CALLS[platform.machine()]),  # another one: over the next
            (0x06, 0, 0, _ERROR),
            (0x06, 0, 0, _ALLOW),
        )
    )
    text = ctypes.create_string_buffer(instructions)
    program = struct.pack("@HP", len(instructions) // 8, ctypes.addressof(text))
    library = ctypes.CDLL(None, use_errno=True)
    for words in ((_NO_NEW_PRIVILEGES, 1, 0, 0, 0), (_SECCOMP, _FILTER, program, 0, 0)):
        if library.prctl(*words):
            raise OSError(ctypes.get_errno(), "prctl")


if __name__ == "__main__":
    refuse()
    os.execvp(sys.argv[1], sys.argv[1:])
