"""File of requirements: the conditions that each subject has to meet.

targets:
  - path: [/scan, /cmd_vel]
    latency: p99 < 80 ms
    completeness: ">= 99 %"
  - path: camera-to-motors
    latency: max < 200 ms
  - from: /camera/image
    to: /base/motors
    latency: p95 < 150 ms
    last: max < 600 ms
  - timer: /planner
    rate: 100 Hz ± 5 %
    lateness: [p99 < 1 ms, max < 5 ms]
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from msgflow.files.yaml_file import Text, YamlFile, line_of
from msgflow.text.name_suggestions import meant_or, nearest
from msgflow.verify.condition import Condition, ConditionError, parse_condition
from msgflow.verify.metrics import ENDS, PATH, SUBJECTS

_EXAMPLE = "targets: [{path: [/scan, /cmd_vel], latency: p99 < 80 ms}]"
_QUOTING = 'quote conditions that begin with >, and patterns that begin with *: ">= 99 %"'
_NAME = "name"


@dataclass(frozen=True)
class Requirement:
    """A condition on a metric of a target."""

    metric: str
    condition: Condition
    line: int  # its line, from 1


@dataclass(frozen=True)
class Target:
    """A subject with its requirements."""

    kind: str  # a key of SUBJECTS
    name: str  # its name in the file, else the words that choose its subject
    topics: tuple[Text, ...]  # topics of a path, in order; empty for a path that only has a name
    chosen: dict[str, Text]  # names or patterns that choose rows, by the name of the field
    requirements: tuple[Requirement, ...]  # at least one
    path_name: Text | None = None  # name of a path in the file with named paths


@dataclass(frozen=True)
class TargetsFile:
    """A file of requirements."""

    file: YamlFile  # for errors, which name the line
    targets: tuple[Target, ...]  # its entries, in order


def read_targets(path: Path) -> TargetsFile:
    """Read a file of requirements; a run decides later whether its names exist."""
    file = YamlFile(path, _EXAMPLE, _QUOTING)
    (entries,) = file.entries("targets")
    if not entries:
        file.fail(1, "the file has no target", _EXAMPLE)
    targets = tuple(_target(file, entry) for entry in entries)
    _refuse_repeated(file, targets)
    return TargetsFile(file, targets)


def _target(file: YamlFile, node: Any) -> Target:
    kind = _kind(file, node)
    subject = SUBJECTS[kind]
    choosing = tuple(name for name in subject.filters if name != kind)
    metrics = tuple(subject.metrics)
    known = (kind, _NAME, *choosing, *metrics)
    for key, _ in node.value:
        name = str(key.value) if key.id == "scalar" else "…"
        if name not in known:
            hint = meant_or(nearest(name, known)[:1], f"it has {', '.join(known)}")
            file.fail(line_of(key), f"a {_word(kind)} has no {name}", hint)
    required = (kind, "to") if kind == ENDS else (kind,)
    fields = file.mapping(node, f"a {_word(kind)}", required, (*choosing, *metrics, _NAME))
    path_name = _path_name(file, fields[kind]) if kind == PATH else None
    topics = _path(file, fields[kind]) if kind == PATH and path_name is None else ()
    chosen = {name: file.text(fields[name], name) for name in (kind, *choosing) if name in fields
              and kind != PATH}  # fmt: skip
    requirements = tuple(
        requirement
        for name in metrics
        if name in fields
        for requirement in _requirements(file, kind, name, fields[name])
    )
    if not requirements:
        file.fail(
            line_of(node),
            f"nothing is required of this {_word(kind)}",
            f"give {', '.join(metrics)}",
        )
    named = [path_name] if path_name else []
    words = [text.value for text in (*topics, *named)] or [text.value for text in chosen.values()]
    separator = " → " if topics or kind == ENDS else " "
    given = file.optional(fields, _NAME)
    return Target(
        kind,
        given.value if given else separator.join(words),
        topics,
        chosen,
        requirements,
        path_name,
    )


def _word(kind: str) -> str:
    return "way" if kind == ENDS else kind


def _kind(file: YamlFile, node: Any) -> str:
    kinds = ", ".join(SUBJECTS)
    if node.id != "mapping":
        file.fail(line_of(node), "a target is not a mapping", _EXAMPLE)
    names = [key.value for key, _ in node.value if key.id == "scalar"]
    # A timer may be chosen by its callback, for example: the first key in SUBJECTS is the kind.
    found = [kind for kind in SUBJECTS if kind in names]
    if not found:
        near = [kind for name in names for kind in nearest(str(name), (*SUBJECTS,))]
        file.fail(
            line_of(node),
            "a target does not say what it is of",
            meant_or(near[:1], f"it has one of {kinds}"),
        )
    allowed = set(SUBJECTS[found[0]].filters)
    for other in found[1:]:
        if other not in allowed:
            key = next(key for key, _ in node.value if key.value == other)
            file.fail(
                line_of(key),
                f"a target is of one thing — {found[0]} and {other}",
                "make two targets of them",
            )
    return found[0]


def _path_name(file: YamlFile, node: Any) -> Text | None:
    # Topics begin with a slash.
    if node.id != "scalar" or str(node.value).startswith("/"):
        return None
    return file.text(node, PATH, "the name of a path")


def _path(file: YamlFile, node: Any) -> tuple[Text, ...]:
    topics = file.texts(node, PATH, "a list of topics")
    if len(topics) < 2:
        file.fail(
            topics[0].line,
            f"a path has two topics at least, its first and its last — {topics[0].value}",
            _EXAMPLE,
        )
    for position, topic in enumerate(topics):
        if topic.value in [before.value for before in topics[:position]]:
            file.fail(
                topic.line,
                f"a path does not come to a topic twice — {topic.value}",
                "loops are no paths: name the topics from the first to the last once",
            )
    return topics


def _requirements(file: YamlFile, kind: str, name: str, node: Any) -> list[Requirement]:
    metric = SUBJECTS[kind].metrics[name]
    found = []
    for text in file.texts(node, name, "a condition"):
        try:
            condition = parse_condition(text.value, metric.dimension, metric.statistics, name)
        except ConditionError as error:
            file.fail(text.line, str(error), error.hint)
        found.append(Requirement(name, condition, text.line))
    return found


def _refuse_repeated(file: YamlFile, targets: tuple[Target, ...]) -> None:
    """Raise if a bound of a metric of a subject is given twice."""
    seen: dict[tuple[Any, ...], int] = {}
    for target in targets:
        subject = (
            target.kind,
            tuple(text.value for text in target.topics),
            target.path_name and target.path_name.value,
            tuple(sorted((name, text.value) for name, text in target.chosen.items())),
        )
        for one in target.requirements:
            for side in ("lower", "upper"):
                key = (subject, one.metric, one.condition.statistic, side)
                if getattr(one.condition, side) is None:
                    continue
                if key in seen:
                    file.fail(
                        one.line,
                        f"{one.metric} of this {_word(target.kind)} is required twice",
                        f"line {seen[key]} has it, too: leave one of them out",
                    )
                seen[key] = one.line
