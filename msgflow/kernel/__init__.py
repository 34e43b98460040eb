"""The compiled part of msgflow, which is optional: all it does is done by numpy as well.

`kernel.c` is compiled when msgflow is installed, where there is a C compiler. It is plain C, called
by ctypes: it needs no headers of Python to compile, fits every version of Python, and other threads
run meanwhile.
"""

from __future__ import annotations

import ctypes
import os
import sys
import zlib
from functools import cache
from pathlib import Path

SOURCE = Path(__file__).with_name("kernel.c")
LIBRARY = Path(__file__).with_name("kernel.so")
VARIABLE = "MSGFLOW_KERNEL"
"""Environment variable: 'off' leaves the kernel out."""

RESIDUES = 8
LENGTHS = 16
NO_FORM = 255


class Place(ctypes.Structure):
    """As in kernel.c."""

    _fields_ = (
        ("width", ctypes.c_int64),
        ("is_big_endian", ctypes.c_int64),
        ("shift", ctypes.c_int64),
        ("mask", ctypes.c_uint64),
        ("offsets", ctypes.c_int64 * RESIDUES),
    )


class Form(ctypes.Structure):
    """As in kernel.c."""

    _fields_ = (
        ("has_id", ctypes.c_int64),
        ("time_mask", ctypes.c_uint64),
        ("id", Place),
        ("time", Place),
        ("sizes", ctypes.c_int64 * RESIDUES),
    )


class Step(ctypes.Structure):
    """As in kernel.c."""

    _fields_ = (
        ("align", ctypes.c_int64),
        ("size", ctypes.c_int64),
        ("kind", ctypes.c_int64),
        ("slot", ctypes.c_int64),
        ("is_big_endian", ctypes.c_int64),
    )


class Body(ctypes.Structure):
    """As in kernel.c."""

    _fields_ = (
        ("number", ctypes.c_int64),
        ("first_step", ctypes.c_int64),
        ("step_count", ctypes.c_int64),
        ("sizes", ctypes.c_int64 * RESIDUES),
    )


class Layout(ctypes.Structure):
    """As in kernel.c."""

    _fields_ = (
        ("residues", ctypes.c_int64),
        ("align", ctypes.c_int64),
        ("selector_count", ctypes.c_int64),
        ("id_count", ctypes.c_int64),
        ("only_id", ctypes.c_uint64),
        ("selector", Place),
        ("forms", ctypes.c_void_p),
        ("form_of", ctypes.c_void_p),
        ("bodies", ctypes.c_void_p),
        ("body_of", ctypes.c_void_p),
        ("steps", ctypes.c_void_p),
    )


class Column(ctypes.Structure):
    """As in kernel.c."""

    _fields_ = (
        ("width", ctypes.c_int64),
        ("is_big_endian", ctypes.c_int64),
        ("is_signed", ctypes.c_int64),
        ("out_width", ctypes.c_int64),
        ("offsets", ctypes.c_int64 * RESIDUES),
        ("out", ctypes.c_void_p),
    )


class Texts(ctypes.Structure):
    """As in kernel.c."""

    _fields_ = (
        ("length", ctypes.c_int64),
        ("room", ctypes.c_int64),
        ("count", ctypes.c_int64),
        ("slot_count", ctypes.c_int64),
        ("offsets", ctypes.c_int64 * RESIDUES),
        ("known", ctypes.c_void_p),
        ("slots", ctypes.c_void_p),
        ("out", ctypes.c_void_p),
    )


class Wanted(ctypes.Structure):
    """As in kernel.c."""

    _fields_ = (
        ("sequence", ctypes.c_int64),
        ("origin", ctypes.c_int64),
        ("out", ctypes.c_void_p),
    )


class Events(ctypes.Structure):
    """As in kernel.c."""

    _fields_ = (
        ("ids", ctypes.c_void_p),
        ("times", ctypes.c_void_p),
        ("threads", ctypes.c_void_p),
        ("names", ctypes.c_void_p),
        ("count", ctypes.c_int64),
        ("sequences", ctypes.c_int64),
        ("label", ctypes.c_int64),
        ("wanted", ctypes.c_void_p),
        ("wanted_count", ctypes.c_int64),
    )


_COUNT, _ADDRESS = ctypes.c_int64, ctypes.c_void_p
_ARGUMENTS = {
    "msgflow_scan": (
        *(_ADDRESS, _ADDRESS, _COUNT, _COUNT, _COUNT),
        *(ctypes.POINTER(_COUNT), _ADDRESS, _COUNT),
    ),
    "msgflow_headers": (
        *(_ADDRESS, _ADDRESS, _COUNT, _ADDRESS, _COUNT, ctypes.c_uint64),
        *(_ADDRESS, _ADDRESS, _ADDRESS),
    ),
    "msgflow_split": (_ADDRESS, _COUNT, _COUNT, _ADDRESS, _ADDRESS),
    "msgflow_gather": (
        *(_ADDRESS, _COUNT, _COUNT, _ADDRESS, _COUNT),
        *(_ADDRESS, _COUNT, _ADDRESS),
    ),
    "msgflow_numbers": (
        *(_ADDRESS, _COUNT, _ADDRESS, _COUNT),
        *(ctypes.POINTER(_COUNT), _ADDRESS, _COUNT, _ADDRESS),
    ),
    "msgflow_place": (
        *(_ADDRESS, _COUNT, _COUNT, _COUNT, _ADDRESS, _ADDRESS, _COUNT),
        *(_COUNT, _ADDRESS, _ADDRESS, _ADDRESS),
    ),
}


@cache
def library() -> ctypes.CDLL | None:
    """Return the compiled kernel, None where there is none of this source or it is left out."""
    if os.environ.get(VARIABLE) == "off" or sys.byteorder != "little":
        return None
    try:
        loaded = ctypes.CDLL(str(LIBRARY))
        made_from = ctypes.c_uint32.in_dll(loaded, "msgflow_source").value
        if made_from != zlib.crc32(SOURCE.read_bytes()):
            return None
        for name, arguments in _ARGUMENTS.items():
            function = getattr(loaded, name)
            function.argtypes = arguments
            function.restype = _COUNT
    except (OSError, ValueError, AttributeError):
        return None
    return loaded
