"""Metadata in TSDL, the language of CTF 1.8."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from uuid import UUID

from msgflow.trace.ctf import field_types as ctf
from msgflow.trace.ctf.declarations import Clock, EventClass, StreamClass, TraceClass
from msgflow.trace.ctf.field_types import MetadataError, Role, Scope, integer_of, may_have
from msgflow.trace.ctf.tsdl_tokens import Token, tokens_of
from msgflow.trace.ctf.tsdl_types import TypeParser, Value, without_prefix

_ROLES: Mapping[Scope, Mapping[str, str]] = {
    Scope.PACKET_HEADER: {
        "magic": Role.MAGIC,
        "uuid": Role.UUID,
        "stream_id": Role.STREAM_CLASS,
        "stream_instance_id": Role.STREAM,
    },
    Scope.PACKET_CONTEXT: {
        "timestamp_begin": Role.TIME,
        "timestamp_end": Role.END,
        "content_size": Role.CONTENT_SIZE,
        "packet_size": Role.PACKET_SIZE,
        "packet_seq_num": Role.SEQUENCE,
        "events_discarded": Role.DISCARDED,
    },
    Scope.EVENT_HEADER: {"id": Role.EVENT_CLASS, "timestamp": Role.TIME},
}
_SCOPES = {
    "packet.header": Scope.PACKET_HEADER,
    "packet.context": Scope.PACKET_CONTEXT,
    "event.header": Scope.EVENT_HEADER,
    "event.context": Scope.EVENT_CONTEXT,
    "context": Scope.SPECIFIC_CONTEXT,
    "fields": Scope.PAYLOAD,
}
_KINDS = ("trace", "env", "clock", "stream", "event", "callsite")
Frames = list[dict[str, ctf.Type]]


@dataclass
class _Block:
    """A block of one of `_KINDS`."""

    values: dict[str, Value] = field(default_factory=dict)
    structures: dict[Scope, ctf.Structure] = field(default_factory=dict)


def parse(text: str) -> TraceClass:
    """Parse metadata."""
    blocks = _Blocks(tokens_of(text))
    try:
        blocks.parse()
    except MetadataError as error:
        raise MetadataError(f"line {blocks.token.line}: {error}") from error
    return _trace_class(blocks.of_kind)


class _Blocks(TypeParser):
    """The blocks of a text, in the order of their appearance."""

    def __init__(self, tokens: list[Token]) -> None:
        super().__init__(tokens, _is_big_endian(tokens))
        self.of_kind: dict[str, list[_Block]] = {kind: [] for kind in _KINDS}

    def parse(self) -> None:
        while self.token.kind != "end":
            if self.at_declaration():
                self.declaration()
                continue
            kind = self.name()
            block = self._block()
            self.expect(";")
            if kind not in self.of_kind:
                raise MetadataError(f"there is no block {kind!r}")
            self.of_kind[kind].append(block)

    def _block(self) -> _Block:
        block = _Block()
        self.open_block()
        while self.token.value != "}":
            if self.at_declaration():
                self.declaration()
                continue
            name = str(self.value())
            if self.take_if(":="):
                structure = self.structure()
                # As with values, what no reader knows says nothing.
                if name in _SCOPES:
                    block.structures[_SCOPES[name]] = structure
            else:
                self.expect("=")
                block.values[name] = self.value()
            self.expect(";")
        self.close_block()
        return block


def _is_big_endian(tokens: list[Token]) -> bool:
    """Look for the trace's byte order, which holds for the types declared before it as well."""
    depth, in_trace = 0, False
    for token, after, value in zip(tokens, tokens[1:], tokens[2:], strict=False):
        if depth == 0 and token.kind == "name":
            in_trace = token.value == "trace"
        depth += (token.value == "{") - (token.value == "}")
        if depth == 1 and in_trace and token.value == "byte_order" and after.value == "=":
            if value.value not in {"le", "be", "network"}:
                raise MetadataError(f"line {value.line}: unknown byte order {value.value!r}")
            return value.value != "le"
    raise MetadataError("the trace's byte order is not declared")


def _trace_class(blocks: Mapping[str, list[_Block]]) -> TraceClass:
    if not blocks["trace"]:
        raise MetadataError("there is no `trace` block")
    declared = blocks["trace"][-1]
    outer: dict[Scope, ctf.Structure] = {}
    _add(outer, declared, Scope.PACKET_HEADER)
    trace = TraceClass(_uuid(declared), packet_header=outer[Scope.PACKET_HEADER])
    for block in blocks["env"]:
        trace.environment |= block.values
    clocks = {
        str(each.values.get("name", "")): _clock(each, trace.notes) for each in blocks["clock"]
    }
    only_clock = next(iter(clocks.values())) if len(clocks) == 1 else None
    scopes: dict[int, dict[Scope, ctf.Structure]] = {}
    # A trace may have a single stream that is not worth a block.
    for block in blocks["stream"] or [_Block()]:
        stream_scopes = dict(outer)
        for scope in (Scope.PACKET_CONTEXT, Scope.EVENT_HEADER, Scope.EVENT_CONTEXT):
            _add(stream_scopes, block, scope)
        stream = StreamClass(
            id=integer_of(block.values, "id", 0),
            packet_context=stream_scopes[Scope.PACKET_CONTEXT],
            event_header=stream_scopes[Scope.EVENT_HEADER],
            event_context=stream_scopes[Scope.EVENT_CONTEXT],
            clock=_clock_of(stream_scopes, clocks) or only_clock,
        )
        if stream.id in trace.streams:
            raise MetadataError(f"there are two streams {stream.id}")
        trace.streams[stream.id] = stream
        scopes[stream.id] = stream_scopes
    for block in blocks["event"]:
        stream_id = integer_of(block.values, "stream_id", next(iter(trace.streams)))
        if stream_id not in trace.streams:
            raise MetadataError(f"there is no stream {stream_id}")
        event_scopes = dict(scopes[stream_id])
        for scope in (Scope.SPECIFIC_CONTEXT, Scope.PAYLOAD):
            _add(event_scopes, block, scope)
        event = EventClass(
            id=integer_of(block.values, "id", 0),
            name=str(block.values.get("name", "")),
            specific_context=event_scopes[Scope.SPECIFIC_CONTEXT],
            payload=event_scopes[Scope.PAYLOAD],
        )
        trace.add_event(trace.streams[stream_id], event)
    return trace


def _add(scopes: dict[Scope, ctf.Structure], block: _Block, scope: Scope) -> None:
    """Add the structure of a scope, after those that it may refer to."""
    frames: dict[Scope, dict[str, ctf.Type]] = {
        known: {member.name: member.type for member in of_scope.members}
        for known, of_scope in scopes.items()
        if known < scope
    }
    declared = block.structures.get(scope, ctf.Structure())
    outer = [frames[known] for known in sorted(frames)]
    scopes[scope] = _Resolver(scope, frames).structure(declared, outer)


def _clock_of(scopes: Mapping[Scope, ctf.Structure], clocks: Mapping[str, Clock]) -> Clock | None:
    """Return the clock to which a field of the packet context or event header is mapped."""
    for scope in (Scope.EVENT_HEADER, Scope.PACKET_CONTEXT):
        for name in _mapped_clocks(scopes[scope]):
            if name in clocks:
                return clocks[name]
            raise MetadataError(f"there is no clock {name!r}")
    return None


def _mapped_clocks(declared: ctf.Type) -> list[str]:
    if isinstance(declared, ctf.Integer):
        return [role.partition(".")[2] for role in declared.roles if role.startswith("clock.")]
    return [name for part in ctf.parts(declared) for name in _mapped_clocks(part)]


def _clock(block: _Block, notes: list[str]) -> Clock:
    name = block.values.get("name")
    return Clock(
        frequency=integer_of(block.values, "freq", Clock.frequency),
        offset_seconds=integer_of(block.values, "offset_s", 0),
        offset_cycles=integer_of(block.values, "offset", 0),
        name=None if name is None else str(name),
        uuid=_uuid(block),
    ).plausible(notes)


def _uuid(block: _Block) -> str | None:
    value = block.values.get("uuid")
    if value is None:
        return None
    try:
        return str(UUID(str(value)))
    except ValueError as error:
        raise MetadataError(f"{value!r} is no uuid") from error


class _Resolver:
    """Gives fields their roles, and options of variants the values that choose them.

    The selector is an enumeration declared before, and its labels are the names of the options.
    """

    def __init__(self, scope: Scope, scopes: dict[Scope, dict[str, ctf.Type]]) -> None:
        self._scope = scope
        self._scopes = scopes
        self._roles = _ROLES.get(scope, {})

    def structure(self, declared: ctf.Structure, frames: Frames) -> ctf.Structure:
        frame: dict[str, ctf.Type] = {}
        self._scopes.setdefault(self._scope, frame)
        members = []
        for member in declared.members:
            field = self._with_role(member.name, self._type(member.type, [*frames, frame]))
            frame[member.name] = field
            members.append(ctf.Member(member.name, field))
        return ctf.Structure(tuple(members), declared.minimum_align)

    def _with_role(self, name: str, declared: ctf.Type) -> ctf.Type:
        role = self._roles.get(name)
        if role and isinstance(declared, ctf.Integer | ctf.Array) and may_have(declared, role):
            return replace(declared, roles=declared.roles | {role})
        return declared

    def _type(self, declared: ctf.Type, frames: Frames) -> ctf.Type:
        match declared:
            case ctf.Structure():
                return self.structure(declared, frames)
            case ctf.Array() | ctf.Sequence():
                return replace(declared, element=self._type(declared.element, frames))
            case ctf.Variant():
                return self._variant(declared, frames)
            case _:
                return declared

    def _variant(self, declared: ctf.Variant, frames: Frames) -> ctf.Variant:
        selector = self._find(declared.selector, frames)
        if not isinstance(selector, ctf.Integer) or selector.labels is None:
            path = ".".join(map(str, declared.selector.path))
            raise MetadataError(f"the selector {path!r} of a variant is no enumeration before it")
        choices = []
        for choice in declared.choices:
            name = without_prefix(choice.name)
            ranges = selector.labels.get(choice.name) or selector.labels.get(name) or ()
            choices.append(ctf.Choice(name, self._type(choice.type, frames), ranges))
        return replace(declared, choices=tuple(choices))

    def _find(self, reference: ctf.Reference, frames: Frames) -> ctf.Type | None:
        if reference.scope is not None:
            return _follow(self._scopes.get(reference.scope), reference.path)
        for frame in reversed(frames):
            if reference.path[0] in frame:
                return _follow(frame, reference.path)
        return None


def _follow(frame: dict[str, ctf.Type] | None, path: tuple[str | None, ...]) -> ctf.Type | None:
    found: ctf.Type | None = None
    for name in path:
        if frame is None or name is None:
            return None
        found = frame.get(name)
        match found:
            case ctf.Structure(members=members):
                frame = {member.name: member.type for member in members}
            case ctf.Variant(choices=choices):
                frame = {
                    member.name: member.type
                    for choice in choices
                    if isinstance(choice.type, ctf.Structure)
                    for member in choice.type.members
                }
            case _:
                frame = None
    return found
