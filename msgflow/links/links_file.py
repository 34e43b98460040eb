"""File of links and topics, which a user declares or reviews: YAML; errors name the line.

links:
  - kind: periodic_async
    node: /fusion
    inputs: [/lidar, /camera]
    outputs: [/objects]
  - kind: queue
    node: /slam
    inputs: [/image]
    outputs: [/pose]
    depth: 2
  - kind: independent
    node: /filter
    inputs: [/scan]
    outputs: [/tick]
topics:
  - name: /scan
    publisher: 0x55bb52684970
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from msgflow.files.yaml_file import Text, YamlFile, line_of

# Links to what a node publishes later, from messages that it keeps.
# The synchronous ones need a message of every input.
SYNCHRONOUS_KINDS = ("partial_sync", "approximate_sync")
QUEUE = "queue"
INDIRECT_KINDS = ("periodic_async", QUEUE, *SYNCHRONOUS_KINDS)
# Whether the publications that come after a message are its effects.
KINDS = (*INDIRECT_KINDS, "direct", "independent")
_REQUIRED = ("kind", "node", "inputs", "outputs")
_OPTIONAL = ("inputs_of", "process", "host", "depth")
_ENDPOINTS = ("publisher", "subscription")
_EXAMPLE = "links: [{kind: periodic_async, node: /fusion, inputs: [/lidar], outputs: [/objects]}]"
_TOPIC_EXAMPLE = "topics: [{name: /scan, publisher: 0x55bb52684970}], as in msgflow check"
_QUOTING = "quote patterns that begin with *, as in '*_raw'"


@dataclass(frozen=True)
class DeclaredLink:
    """One entry of the file."""

    # one of INDIRECT_KINDS; 'direct': the node publishes on the outputs because of the message
    # before; 'independent': not because of messages of the inputs
    kind: str
    node: Text  # full name of a node, or a pattern
    inputs: tuple[Text, ...]  # topics that the node receives, or patterns
    outputs: tuple[Text, ...]  # topics that it publishes, or patterns
    # name or pattern of another node of its process that receives the inputs for it
    inputs_of: Text | None
    process: Text | None  # name or pid of its process, if several nodes have the name
    host: Text | None  # its host, likewise
    line: int  # where the entry begins
    # of a queue, how many messages wait in it at most; any number when None
    depth: int | None = None


@dataclass(frozen=True)
class DeclaredTopic:
    """The name of a topic for which the trace has none."""

    name: Text
    kind: str  # 'publisher' or 'subscription'
    handle: int  # handle of one of its publishers or subscriptions
    handle_text: Text  # the same, as the file has it
    process: Text | None  # name or pid of its process, if several have the handle
    host: Text | None  # its host, likewise


@dataclass(frozen=True)
class LinksFile:
    """A file with declared links."""

    file: YamlFile  # for errors, which name the line
    links: tuple[DeclaredLink, ...]  # its links, in order
    topics: tuple[DeclaredTopic, ...] = ()  # its topics, in order


def read_links(path: Path, content: str | None = None) -> LinksFile:
    """Read a file with declared links, or its content, which may not be written yet."""
    file = YamlFile(path, _EXAMPLE, _QUOTING, content)
    links, topics = file.entries("links", "topics")
    return LinksFile(
        file,
        tuple(_link(file, entry) for entry in links),
        tuple(_topic(file, entry) for entry in topics),
    )


def _link(file: YamlFile, node: Any) -> DeclaredLink:
    fields = file.mapping(node, "a link", _REQUIRED, _OPTIONAL)
    kind = file.text(fields["kind"], "kind")
    if kind.value not in KINDS:
        file.fail(
            kind.line, f"no such kind of link — {kind.value}", f"the kinds are {', '.join(KINDS)}"
        )
    return DeclaredLink(
        kind.value,
        file.text(fields["node"], "node"),
        file.texts(fields["inputs"], "inputs"),
        file.texts(fields["outputs"], "outputs"),
        file.optional(fields, "inputs_of"),
        file.optional(fields, "process"),
        file.optional(fields, "host"),
        line_of(node),
        _depth(file, kind.value, file.optional(fields, "depth")),
    )


def _depth(file: YamlFile, kind: str, given: Text | None) -> int | None:
    if given is None:
        return None
    if kind != QUEUE:
        file.fail(given.line, f"only a {QUEUE} has a depth — {kind}", "leave it out")
    if not given.value.isdecimal() or int(given.value) < 1:
        file.fail(given.line, f"a depth is a number from 1 — {given.value}", "leave it out")
    return int(given.value)


def _topic(file: YamlFile, node: Any) -> DeclaredTopic:
    fields = file.mapping(node, "a topic", ("name",), (*_ENDPOINTS, "process", "host"))
    name = file.text(fields["name"], "name", "a topic")
    if not name.value.startswith("/"):
        file.fail(name.line, f"a topic begins with / — {name.value}", _TOPIC_EXAMPLE)
    kinds = [kind for kind in _ENDPOINTS if kind in fields]
    if len(kinds) != 1:
        file.fail(
            line_of(node),
            f"a topic has a publisher or a subscription — {name.value}",
            _TOPIC_EXAMPLE,
        )
    text = file.text(fields[kinds[0]], kinds[0], "a handle")
    try:
        handle = int(text.value, 16)
    except ValueError:
        file.fail(text.line, f"{kinds[0]} is not a handle — {text.value}", _TOPIC_EXAMPLE)
    return DeclaredTopic(
        name,
        kinds[0],
        handle,
        text,
        file.optional(fields, "process"),
        file.optional(fields, "host"),
    )
