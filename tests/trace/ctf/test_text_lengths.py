"""Lengths of texts in the memory of packets."""

from __future__ import annotations

import time

import numpy as np

from msgflow.trace.ctf.field_columns import text_lengths
from msgflow.trace.ctf.packet_memory import Memory


def test_short_and_long_texts() -> None:
    lengths = [0, 1, 7, 8, 9, 2047, 2048, 2049, 2056, 5_000, 3]
    data = bytearray(b"".join(b"x" * length + b"\0" for length in lengths) + bytes(16))
    begins = np.cumsum([0, *(length + 1 for length in lengths)])[:-1]
    assert text_lengths(Memory(data), begins).tolist() == lengths


def test_a_text_of_many_megabytes_takes_no_time() -> None:
    data = bytearray(b"x" * 20_000_000 + bytes(16))
    begin_s = time.process_time()
    assert text_lengths(Memory(data), np.zeros(1, np.int64)).tolist() == [20_000_000]
    assert time.process_time() - begin_s < 1
