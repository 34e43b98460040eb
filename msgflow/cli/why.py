"""Explain why a topic is late: who is to blame, where the time goes, what to ask next."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Unpack

from msgflow.cli.operation import asks
from msgflow.cli.output import command_text, print_note, print_runs, print_status
from msgflow.cli.sections import SectionsFormat, chosen_format, print_sections, screen_sections
from msgflow.database import Database
from msgflow.files.default_files import DEFAULT_DATABASE
from msgflow.run.slice import SliceWords
from msgflow.text.values import printable
from msgflow.text.wrapping import wrap

if TYPE_CHECKING:
    from msgflow.query.why import Explanation
    from msgflow.result.query_result import QueryResult

_PATHS = 3
_CULPRITS = 3
# Titles, and the columns that answer the question.
_SHOWN = {
    "paths": ("paths", "path roots reached ambiguous median_ns p95_ns max_ns reasons"),
    "nodes": ("time by node, on {}", "node share part what median_ns max_ns"),
    "slow_flow": (
        "one of its slow flows (95 of 100 take no longer)",
        "rank latency_ns take_id duration_ns share activity state who node what",
    ),
    "waits": (
        "what kept its callbacks waiting",
        "node callback meanwhile_node meanwhile_callback meanwhile_thread worst_ns",
    ),
    "losses": ("messages not delivered", "topic_name subscriber published dropped lost reasons"),
}
# Parts and activities as an engineer says them; docs/glossary.md explains each.
_WORDS = {
    "network_or_idle": "on the way",
    "until_arrival": "on the way",
    "undecided": "way or queue",
    "executor_busy": "in the queue",
    "executor": "in the executor",
    "all_threads_busy": "no free thread",
    "blocked": "group is busy",
    "run_queue": "waits for a CPU",
    "take_to_callback": "taken, not begun",
    "response_to_take": "answer on its way",
    "timer": "waits for timer",
    "unpublished": "waits for input",
    "cache": "in the cache",
    **dict.fromkeys(("intra", "rclcpp", "rcl", "rmw", "dds", "publish"), "publishes"),
}


@asks(Database.why)
def command(
    found: Explanation,
    *,
    form: SectionsFormat | None = None,
    output: Path | None = None,
    wide: bool = False,
    database: Path = DEFAULT_DATABASE,
    **part: Unpack[SliceWords],
) -> None:
    """The last lines are the commands to ask next.

    Args:
        form (table|json|markdown): By default by the suffix of FILE, else table.
    """
    form = chosen_format(form, output)
    print_runs([found.run])
    print_sections(found.sections, form, output, None if wide else partial(_brief, found))
    if (more := len(found.paths) - _PATHS) > 0:
        ends = ("--to", found.place) if found.place else ()
        paths = "1 more path" if more == 1 else f"{more} more paths"
        whole = part | {"start": found.start}
        print_note(f"{paths}: {_command(('query', 'e2e-latency', *ends), whole, database)}")
    for note in found.notes:
        print_note(note)
    for step in found.steps:
        print_status(f"next: {_command(step, part, database)}")


def _brief(found: Explanation, width: int) -> Iterator[str]:
    """Yield the worst sentences, each with an empty line behind, who else is to blame, and why."""
    rows = found.verdict.table.to_pylist()
    # What was found of the recording costs nothing, and comes first.
    shown = sum(row["cost_ns"] is None for row in rows) + _CULPRITS
    sentences = [row["sentence"] for row in rows[:shown]]
    if less := [row["who"] for row in rows[shown:]]:
        sentences.append(f"less: {', '.join(less)} (--wide)")
    for sentence in sentences:
        yield from wrap(printable(sentence), width)
        yield ""
    yield from screen_sections(_shown(found), width, is_chosen=True)


def _shown(found: Explanation) -> dict[str, QueryResult]:
    path = found.paths.table["path"][0].as_py()
    number = found.paths.path_numbers.get(path)
    place = "the path" if number is None else f"path {number}"
    shown = {}
    for name, (title, columns) in _SHOWN.items():
        result = found.sections[name]
        title = title.format(place)
        rows = result.first(_PATHS) if name == "paths" else result
        shown[title] = _in_words(rows.with_columns(columns.split()))
    return shown


def _in_words(rows: QueryResult) -> QueryResult:
    from msgflow.trace.numpy_arrow import texts_to_arrow

    table = rows.table
    for place, name in enumerate(table.column_names):
        if name in ("part", "activity"):
            words = [_WORDS.get(word, word) for word in table[name].to_pylist()]
            table = table.set_column(place, name, texts_to_arrow(words))
    return replace(rows, table=table)


def _command(step: tuple[str, ...], part: SliceWords, database: Path) -> str:
    # Of a flow the identity tells the run; suggestions are from all of a run.
    taken = {"query": part, "suggest": {"run": part.get("run")}}.get(step[0], {})
    words = ["msgflow", *step]
    for name, value in taken.items():
        if value is not None:
            words += [f"--{name.replace('_', '-')}", str(value)]
    return command_text(words, database)
