"""Tables as pages get them, taken apart in Python the way that the pages do."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Decoded:
    """A table: its rows as dictionaries, and what was said of it."""

    rows: list[dict[str, Any]]
    meta: dict[str, Any]
    columns: list[dict[str, Any]]


def decoded(content: bytes) -> Decoded:
    """Return the table that `msgflow.view.table_encoding.encode` made these bytes of."""
    length = int.from_bytes(content[:4], "little")
    head = json.loads(content[4 : 4 + length])
    at = 4 + length
    count = head["rows"]
    columns: dict[str, list[Any]] = {}
    for column in head["columns"]:
        body = content[at : at + column["bytes"]]
        at += column["bytes"]
        columns[column["name"]] = _values(column, body, count)
    assert at == len(content)
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    return Decoded(rows, head["meta"], head["columns"])


def _values(column: dict[str, Any], body: bytes, count: int) -> list[Any]:
    kind = column["type"]
    if kind == "double":
        return [None if value != value else value for value in np.frombuffer(body, "<f8").tolist()]
    if kind == "json":
        found: list[Any] = json.loads(body)
        return found
    if kind == "text":
        words = [None, *json.loads(body[: column["words"]])]
        return [words[code] for code in _integers(column, body[column["words"] :], count)]
    numbers = _integers(column, body, count)
    if kind == "boolean":
        return [None if number is None else bool(number) for number in numbers]
    return numbers


def _integers(column: dict[str, Any], body: bytes, count: int) -> list[Any]:
    width = column["width"]
    planes = np.frombuffer(body[: width * count], np.uint8).reshape(width, count)
    value = 0
    result: list[Any] = []
    for row in range(count):
        folded = sum(int(planes[plane][row]) << (8 * plane) for plane in range(width))
        value += folded // 2 if folded % 2 == 0 else -(folded + 1) // 2
        result.append(value)
    if column.get("nulls"):
        missing = body[width * count :]
        result = [None if missing[row] else one for row, one in enumerate(result)]
    return result
