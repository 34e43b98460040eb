"""Keeps the C library from giving memory back at every opportunity."""

from __future__ import annotations

import ctypes

# Of mallopt(3).
_M_TRIM_THRESHOLD = -1
_M_MMAP_THRESHOLD = -3

_LARGEST_KEPT = 32 << 20
_MOST_KEPT = 128 << 20


def keep_freed_memory() -> None:
    """Let the process use again what was freed, up to 128 MB, instead of asking for it anew.

    Arrays of some megabytes are made and dropped all the time while traces are read; by default
    each goes back to the system, which hands out every page of the next one zeroed. Does nothing
    where the C library has no such settings.
    """
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):  # no glibc, or Windows
        return
    mallopt(_M_MMAP_THRESHOLD, _LARGEST_KEPT)
    mallopt(_M_TRIM_THRESHOLD, _MOST_KEPT)
