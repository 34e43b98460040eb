"""Parses the types of TSDL: `integer { … }`, `struct { … } align(8)`, aliases and declarators."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from msgflow.trace.ctf import field_types as ctf
from msgflow.trace.ctf.field_types import BYTE, MetadataError, Reference, Scope, integer_of
from msgflow.trace.ctf.tsdl_tokens import Token, TokenStream

Labels = dict[str, tuple[tuple[int, int], ...]]
Value = int | str

_DECLARATIONS = {"typealias", "typedef", "struct", "variant", "enum"}
_BASES = dict.fromkeys(("16", "x", "hex", "hexadecimal", "p"), 16)
_TEXT_ENCODINGS = {"utf8", "utf-8", "ascii"}
_ABSOLUTE = (
    (("trace", "packet", "header"), Scope.PACKET_HEADER),
    (("stream", "packet", "context"), Scope.PACKET_CONTEXT),
    (("stream", "event", "header"), Scope.EVENT_HEADER),
    (("stream", "event", "context"), Scope.EVENT_CONTEXT),
    (("event", "context"), Scope.SPECIFIC_CONTEXT),
    (("event", "fields"), Scope.PAYLOAD),
)


class TypeParser(TokenStream):
    """Parses types and keeps the names given to them, block by block."""

    def __init__(self, tokens: list[Token], big_endian: bool) -> None:
        """Parse `tokens`; `big_endian` is the trace's own byte order."""
        super().__init__(tokens)
        self._big_endian = big_endian
        self._named: list[dict[str, ctf.Type]] = [{}]

    def open_block(self) -> None:
        """Begin a block: names declared in it are forgotten at its end."""
        self.expect("{")
        self._named.append({})

    def close_block(self) -> None:
        """End the block."""
        self.expect("}")
        self._named.pop()

    def at_declaration(self) -> bool:
        """Tell whether a `typealias`, `typedef` or named compound type follows."""
        return self.token.kind == "name" and self.token.value in _DECLARATIONS

    def declaration(self) -> None:
        """Parse a declaration that gives a type a name."""
        if self.take_if("typealias"):
            declared = self._specifier(is_alone=True)
            self.expect(":=")
            self._named[-1][self._words(is_alone=True)] = declared
        elif self.take_if("typedef"):
            declared, name = self._declarator(self._specifier())
            self._named[-1][name] = declared
        else:
            self._specifier(is_alone=True)
        self.expect(";")

    def structure(self) -> ctf.Structure:
        """Parse the structure of a scope, up to its semicolon."""
        declared = self._specifier(is_alone=True)
        if not isinstance(declared, ctf.Structure):
            raise MetadataError("expected a structure")
        return declared

    def _specifier(self, *, is_alone: bool = False) -> ctf.Type:
        """Parse a type: the name of a field follows, unless it stands alone."""
        while self.take_if("const"):
            pass
        if self.take_if("integer"):
            return self._integer()
        if self.take_if("floating_point"):
            return self._real()
        if self.take_if("string"):
            if self.token.value == "{":
                self._attributes()
            return ctf.String()
        if self.take_if("struct"):
            return self._struct()
        if self.take_if("variant"):
            return self._variant()
        if self.take_if("enum"):
            return self._enumeration()
        return self._find(self._words(is_alone))

    def _words(self, is_alone: bool) -> str:
        """Take the words of a type's name, without the name of a field if that follows."""
        words: list[str] = []
        while self.token.kind == "name":
            if not is_alone and words and self.after().kind != "name":
                break
            word = self.take().value
            if word != "const":
                words.append(word)
        if not words:
            raise MetadataError(f"expected a type, found {self.token.value!r}")
        return " ".join(words)

    def _find(self, name: str) -> ctf.Type:
        for block in reversed(self._named):
            if name in block:
                return block[name]
        raise MetadataError(f"there is no type {name!r}")

    def _attributes(self) -> dict[str, Value]:
        values: dict[str, Value] = {}
        self.expect("{")
        while not self.take_if("}"):
            name = self.name()
            self.expect("=")
            values[name] = self.value()
            self.expect(";")
        return values

    def value(self) -> Value:
        """Take a number, a text, or a name with dots."""
        if self.token.kind == "text":
            return self.text()
        if self.token.kind == "name":
            words = [self.name()]
            while self.take_if("."):
                words.append(self.name())
            return ".".join(words)
        return self.number()

    def _is_big_endian(self, values: Mapping[str, Value]) -> bool:
        order = values.get("byte_order", "native")
        if order in {"le", "be", "network"}:
            return order != "le"
        if order != "native":
            raise MetadataError(f"there is no byte order {order!r}")
        return self._big_endian

    def _integer(self) -> ctf.Integer:
        values = self._attributes()
        size = integer_of(values, "size", None)
        encoding = str(values.get("encoding", "none"))
        return ctf.Integer(
            size=size,
            align=integer_of(values, "align", 1 if size % BYTE else BYTE),
            big_endian=self._is_big_endian(values),
            signed=str(values.get("signed", "false")).lower() in {"true", "1"},
            is_text=encoding.lower() in _TEXT_ENCODINGS,
            base=_BASES.get(str(values.get("base", "")).lower(), 10),
            roles=frozenset({"clock." + str(values["map"]).split(".")[1]})
            if str(values.get("map", "")).count(".") == 2
            else frozenset(),
        )

    def _real(self) -> ctf.Real:
        values = self._attributes()
        digits = (values.get("exp_dig"), values.get("mant_dig"))
        sizes: dict[tuple[Value | None, Value | None], int] = {(8, 24): 32, (11, 53): 64}
        align = integer_of(values, "align", 1)
        return ctf.Real(sizes.get(digits, 0), align, self._is_big_endian(values))

    def _struct(self) -> ctf.Type:
        name = self.name() if self.token.kind == "name" and self.token.value != "align" else ""
        if name and self.token.value != "{":
            return self._find(f"struct {name}")
        members = self._members()
        align = 1
        if self.take_if("align"):
            self.expect("(")
            align = self.number()
            self.expect(")")
        structure = ctf.Structure(
            tuple(ctf.Member(without_prefix(key), member) for key, member in members), align
        )
        if name:
            self._named[-1][f"struct {name}"] = structure
        return structure

    def _members(self) -> list[tuple[str, ctf.Type]]:
        members = []
        self.open_block()
        while self.token.value != "}":
            if self.token.value in {"typealias", "typedef"}:
                self.declaration()
                continue
            declared = self._specifier()
            if self.take_if(";"):
                # A structure or enumeration that is only given a name here.
                continue
            while True:
                field, name = self._declarator(declared)
                members.append((name, field))
                if not self.take_if(","):
                    break
            self.expect(";")
        self.close_block()
        return members

    def _declarator(self, declared: ctf.Type) -> tuple[ctf.Type, str]:
        """Parse a name and its array dimensions."""
        name = self.name()
        dimensions: list[int | Reference] = []
        while self.take_if("["):
            if self.token.kind == "number":
                dimensions.append(self.number())
            else:
                dimensions.append(reference_of(str(self.value())))
            self.expect("]")
        field = declared
        for dimension in reversed(dimensions):
            field = (
                ctf.Array(field, dimension)
                if isinstance(dimension, int)
                else ctf.Sequence(field, dimension)
            )
        return field, name

    def _variant(self) -> ctf.Type:
        """Parse a variant. One without a selector only gets a name: its users name the selector."""
        name = self.name() if self.token.kind == "name" else ""
        selector = ""
        if self.take_if("<"):
            selector = str(self.value())
            self.expect(">")
        if self.token.value == "{":
            # Which values choose which option is resolved with the selector's labels.
            choices = (ctf.Choice(key, member, ()) for key, member in self._members())
            declared: ctf.Type = ctf.Variant(Reference(None, ()), tuple(choices))
            if name:
                self._named[-1][f"variant {name}"] = declared
        else:
            declared = self._find(f"variant {name}")
        if selector and isinstance(declared, ctf.Variant):
            return replace(declared, selector=reference_of(selector))
        if self.token.kind == "name":
            raise MetadataError(f"the variant {self.token.value!r} has no selector")
        return ctf.Structure()

    def _enumeration(self) -> ctf.Type:
        name = self.name() if self.token.kind == "name" else ""
        container: ctf.Type | None = None
        if self.take_if(":"):
            container = self._specifier(is_alone=True)
        if self.token.value != "{":
            return self._find(f"enum {name}")
        if container is None:
            container = self._find("int")
        if not isinstance(container, ctf.Integer):
            raise MetadataError("an enumeration must be of an integer type")
        enumeration = replace(container, labels=self._labels(), is_text=False, base=10)
        if name:
            self._named[-1][f"enum {name}"] = enumeration
        return enumeration

    def _labels(self) -> Labels:
        labels: Labels = {}
        following = 0
        self.expect("{")
        while not self.take_if("}"):
            label = self.text() if self.token.kind == "text" else self.name()
            first = following
            if self.take_if("="):
                first = self.number()
            last = first
            if self.take_if("..."):
                last = self.number()
            labels[label] = (*labels.get(label, ()), (first, last))
            following = last + 1
            if not self.take_if(","):
                self.expect("}")
                break
        return labels


def reference_of(text: str) -> Reference:
    """Return what a length or selector such as `stream.event.header.id` refers to."""
    names = tuple(text.split("."))
    for prefix, scope in _ABSOLUTE:
        if names[: len(prefix)] == prefix and len(names) > len(prefix):
            return Reference(scope, tuple(map(without_prefix, names[len(prefix) :])))
    return Reference(None, tuple(map(without_prefix, names)))


def without_prefix(name: str) -> str:
    """Remove the underscore that keeps names of fields apart from words of the language."""
    return name.removeprefix("_")
