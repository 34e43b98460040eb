"""JUnit XML of verdicts, for CI servers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

from msgflow.run.window import format_epoch
from msgflow.text.values import format_duration, printable

if TYPE_CHECKING:
    from msgflow.result.query_result import QueryResult
    from msgflow.run.choice import Run


def junit_xml(result: QueryResult, run: Run, *, allow_not_measured: bool) -> str:
    """Return a document with one test case per verdict."""
    rows: list[dict[str, Any]] = result.to_arrow().to_pylist()
    missing = "skipped" if allow_not_measured else "errors"
    counts = {"tests": len(rows), "failures": 0, "errors": 0, "skipped": 0}
    counts["failures"] = sum(row["verdict"] == "failed" for row in rows)
    counts[missing] = sum(row["value"] is None for row in rows)
    numbers = {name: str(number) for name, number in counts.items()}
    root = ElementTree.Element("testsuites", {"name": "msgflow verify", **numbers})
    name = printable(run.name)
    suite = ElementTree.SubElement(root, "testsuite", {"name": name, **numbers})
    for row in rows:
        # Names come from traces and files: `printable` escapes characters that XML cannot hold.
        case = ElementTree.SubElement(
            suite,
            "testcase",
            {
                "classname": printable(row["path"] or row["subject"] or row["target"]),
                "name": printable(f"{row['metric']} {row['condition']}"),
            },
        )
        if row["verdict"] == "failed":
            failure = ElementTree.SubElement(
                case, "failure", {"type": "failed", "message": f"measured {row['measured']}"}
            )
            failure.text = printable(_worst(row))
        elif row["value"] is None:
            tag = "skipped" if allow_not_measured else "error"
            attributes = {"message": printable(row["reason"])}
            if tag == "error":
                attributes["type"] = row["verdict"]
            ElementTree.SubElement(case, tag, attributes)
        if row["value"] is not None and row["reason"] is not None:
            ElementTree.SubElement(case, "system-out").text = printable(row["reason"])
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}'


def _worst(row: dict[str, Any]) -> str:
    if row["worst_at_ns"] is None:
        return ""
    took = "" if row["worst_ns"] is None else f"{format_duration(row['worst_ns'])} "
    return f"worst: {took}at {format_epoch(row['worst_at_ns'])}, see {row['see']}"
