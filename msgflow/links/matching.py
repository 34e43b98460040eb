"""Matching of declared links: the nodes and topics of a run that their names and patterns mean."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from graphlib import CycleError, TopologicalSorter
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NoReturn

from msgflow.errors import UsageError
from msgflow.links.links_file import INDIRECT_KINDS, SYNCHRONOUS_KINDS
from msgflow.sql.statement import internal_sql
from msgflow.text.name_suggestions import meant_or, nearest

if TYPE_CHECKING:
    import duckdb

    from msgflow.files.yaml_file import Text, YamlFile
    from msgflow.links.links_file import DeclaredLink, LinksFile

_SHOWN = 12


@dataclass(frozen=True)
class Endpoint:
    """A subscription or publisher of a node."""

    id: int
    topic: str
    is_internal: bool


@dataclass(frozen=True)
class Node:
    """A node of a run, with its subscriptions and publishers."""

    subscriptions: tuple[Endpoint, ...]
    publishers: tuple[Endpoint, ...]
    name: str
    process_id: int
    process: str
    pid: int
    host: str


@dataclass(frozen=True)
class MatchedLink:
    """A declared link of one node, with its subscriptions and publishers."""

    kind: str  # of links_file.KINDS
    process_id: int  # process of the node
    inputs: tuple[Endpoint, ...]  # subscriptions, in order of their ids
    outputs: tuple[Endpoint, ...]  # publishers, likewise
    line: int  # its line in the file
    depth: int | None  # of a queue: most messages that wait in it


def match_links(
    con: duckdb.DuckDBPyConnection,
    run_id: int,
    file: LinksFile,
    leave_out: Callable[[DeclaredLink, UsageError], None] | None = None,
) -> tuple[MatchedLink, ...]:
    """Return the links of a file with the nodes and topics of a run; see `declare_links`."""
    rows = internal_sql().run(con, "link_node", {"run_id": run_id}).fetchall()
    nodes = [Node(_endpoints_of(heard), _endpoints_of(said), *of) for heard, said, *of in rows]
    matched: list[MatchedLink] = []
    for link in file.links:
        try:
            matched += _match(file.file, link, nodes)
        except UsageError as error:
            if leave_out is None:
                raise
            leave_out(link, error)
    _refuse_cycles(file.file, matched)
    return tuple(matched)


def _endpoints_of(rows: Sequence[dict[str, Any]] | None) -> tuple[Endpoint, ...]:
    return tuple(Endpoint(**row) for row in rows or ())


def _match(file: YamlFile, link: DeclaredLink, nodes: Sequence[Node]) -> Iterator[MatchedLink]:
    chosen = _choose(file, link, nodes)
    received = {node: _received(file, link, node, nodes) for node in chosen}
    # A name or pattern may fit several nodes: it means only those that have these topics.
    fitting = [
        (node, inputs, outputs)
        for node in chosen
        if (inputs := _endpoints(link.inputs, received[node]))
        and (outputs := _endpoints(link.outputs, node.publishers))
    ]
    if not fitting:
        if not _is_pattern(link.node.value):
            _refuse_repeated(file, link, chosen)
        _fail_on_topic(file, link, chosen, received)
    _refuse_repeated(file, link, [node for node, _, _ in fitting])
    for node, inputs, outputs in fitting:
        both = {e.topic for e in inputs} & {e.topic for e in outputs}
        if both and link.kind in INDIRECT_KINDS:
            file.fail(
                link.line,
                f"a topic is input and output of the same link — {sorted(both)[0]}",
                "leave it out on one side; narrow a pattern that matches it on both",
            )
        if link.kind in SYNCHRONOUS_KINDS and len(inputs) == 1:
            file.fail(
                link.line,
                f"{link.kind} with one input waits for nothing — {inputs[0].topic} of {node.name}",
                "name all inputs that it waits for, or leave it out",
            )
        yield MatchedLink(link.kind, node.process_id, inputs, outputs, link.line, link.depth)


def _choose(file: YamlFile, link: DeclaredLink, nodes: Sequence[Node]) -> Sequence[Node]:
    named = [node for node in nodes if matches(node.name, link.node.value)]
    if not named:
        names = [node.name for node in nodes]
        file.fail(
            link.node.line, f"no such node — {link.node.value}", _known("nodes", link.node, names)
        )
    placed = named
    if link.host is not None:
        placed = [node for node in placed if matches(node.host, link.host.value)]
        if not placed:
            hosts = sorted({node.host for node in named})
            file.fail(
                link.host.line,
                f"no such node on this host — {link.host.value}",
                f"{link.node.value} is on {_some(hosts)}",
            )
    if link.process is not None:
        wanted = link.process.value
        before, placed = (
            placed,
            [node for node in placed if str(node.pid) == wanted or matches(node.process, wanted)],
        )
        if not placed:
            file.fail(
                link.process.line,
                f"no such node in this process — {wanted}",
                f"{link.node.value} is in {_some(_place(node) for node in before)}",
            )
    return placed


def _received(
    file: YamlFile, link: DeclaredLink, node: Node, nodes: Sequence[Node]
) -> tuple[Endpoint, ...]:
    """Return the subscriptions of a node, or of the nodes that receive for it in its process."""
    if link.inputs_of is None:
        return node.subscriptions
    wanted = link.inputs_of
    beside = [other for other in nodes if other.process_id == node.process_id and other != node]
    others = [other for other in beside if matches(other.name, wanted.value)]
    if not others and not _is_pattern(link.node.value):
        file.fail(
            wanted.line,
            f"no such node in the process of {node.name} — {wanted.value}",
            _known("other nodes there", wanted, [other.name for other in beside]),
        )
    return tuple(endpoint for other in others for endpoint in other.subscriptions)


def _refuse_repeated(file: YamlFile, link: DeclaredLink, nodes: Sequence[Node]) -> None:
    """Raise if a name means several nodes, and the entry does not say which."""
    for node in nodes:
        same = [other for other in nodes if other.name == node.name]
        in_one_process = len({other.process_id for other in same}) == 1
        if len(same) > 1 and not (in_one_process and link.process is not None):
            file.fail(
                link.node.line,
                f"{len(same)} nodes have this name — {node.name}",
                f"say which with process: or host: — {_some(_place(other) for other in same)}",
            )


def _endpoints(wanted: Sequence[Text], there: Sequence[Endpoint]) -> tuple[Endpoint, ...]:
    """Return the endpoints that all texts mean; nothing if a text means none."""
    meant: dict[int, Endpoint] = {}
    for text in wanted:
        found = [endpoint for endpoint in there if _means(text, endpoint)]
        if not found:
            return ()
        meant.update((endpoint.id, endpoint) for endpoint in found)
    return tuple(meant[number] for number in sorted(meant))


def _means(text: Text, endpoint: Endpoint) -> bool:
    return endpoint.topic == text.value or (
        not endpoint.is_internal and matches(endpoint.topic, text.value)
    )


def _fail_on_topic(
    file: YamlFile,
    link: DeclaredLink,
    nodes: Sequence[Node],
    received: Mapping[Node, tuple[Endpoint, ...]],
) -> NoReturn:
    """Raise for the first topic that no node has, or because no node has all topics."""
    lacking: dict[str, str] = {}
    for texts, is_input in ((link.inputs, True), (link.outputs, False)):
        for text in texts:
            there = [(n, received[n] if is_input else n.publishers) for n in nodes]
            without = [n for n, endpoints in there if not any(_means(text, e) for e in endpoints)]
            for node in without:
                lacking.setdefault(node.name, text.value)
            if len(without) == len(nodes):
                topics = [e.topic for _, endpoints in there for e in endpoints if not e.is_internal]
                _fail_on_unknown_topic(file, link, text, topics, is_input=is_input)
    file.fail(
        link.line,
        f"no node that matches {link.node.value} has all of these inputs and outputs",
        _some(f"{name} lacks {topic}" for name, topic in lacking.items()),
    )


def _fail_on_unknown_topic(
    file: YamlFile, link: DeclaredLink, text: Text, topics: Sequence[str], *, is_input: bool
) -> NoReturn:
    if _is_pattern(link.node.value):
        who = f"no node that matches {link.node.value}"
        what = "subscribes to" if is_input else "publishes on"
    else:
        who = f"{link.node.value} does not"
        what = "subscribe to" if is_input else "publish on"
    file.fail(
        text.line,
        f"{who} {what} such a topic — {text.value}",
        _known("topics", text, topics) if topics else f"{who} {what} any topic",
    )


def _refuse_cycles(file: YamlFile, links: Sequence[MatchedLink]) -> None:
    """Raise if messages would lead back to themselves through declared links."""
    links = [link for link in links if link.kind in INDIRECT_KINDS]
    before: dict[str, set[str]] = {}
    for link in links:
        for output in link.outputs:
            before.setdefault(output.topic, set()).update(e.topic for e in link.inputs)
    try:
        TopologicalSorter({topic: sorted(before[topic]) for topic in sorted(before)}).prepare()
    except CycleError as error:
        cycle = error.args[1]
        steps = set(pairwise(cycle))
        lines = sorted(
            {
                link.line
                for link in links
                for i in link.inputs
                for o in link.outputs
                if (i.topic, o.topic) in steps
            }
        )
        file.fail(
            lines[-1],
            f"the links form a cycle — {' → '.join(cycle)}",
            f"leave one of them out: lines {', '.join(map(str, lines))}",
        )


def matches(name: str, wanted: str) -> bool:
    """Tell whether a name is the wanted one, or fits the wanted pattern."""
    return name == wanted or (_is_pattern(wanted) and fnmatchcase(name, wanted))


def _is_pattern(text: str) -> bool:
    return any(character in text for character in "*?[")


def _place(node: Node) -> str:
    return f"process {node.process} {node.pid} on host {node.host}"


def _known(what: str, wanted: Text, names: Iterable[str]) -> str:
    known = sorted(set(names))
    if not known:
        return f"there are no {what}"
    return meant_or(nearest(wanted.value, known)[:1], f"the {what} are {_some(known)}")


def _some(names: Iterable[str]) -> str:
    known = list(dict.fromkeys(names))
    more = len(known) - _SHOWN
    return ", ".join(known[:_SHOWN]) + (f" and {more} more" if more > 0 else "")
