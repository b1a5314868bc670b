# SPDX-License-Identifier: LGPL-2.1-or-later
"""The text of a STEP file (ISO 10303-21), as far as the geometry kernel does not pass it on.

The kernel drops part numbers, drops densities that come without a material name, and turns the unit of the
others into one of its own. So the few entities that carry them are read here, from the text: one pass of a
regular expression finds where every entity stands, and only wanted ones are taken apart.
"""

from __future__ import annotations

import mmap
import re
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TypeAlias

from silo.bom.errors import InputError

Buffer: TypeAlias = bytes | mmap.mmap


@dataclass(frozen=True, slots=True)
class Ref:
    """A reference to another entity: ``#12``."""

    id: int


@dataclass(frozen=True, slots=True)
class Typed:
    """A value with its type, ``LENGTH_MEASURE(1.)``, or one part of a complex entity."""

    name: str
    values: tuple[Value, ...]


Value: TypeAlias = "Ref | Typed | str | float | tuple[Value, ...] | None"
"""One argument. ``$`` and ``*`` are None, enumerations are strings with their dots (``.KILO.``)."""

MAX_DEPTH = 60
MAX_ENTITY_BYTES = 4_000_000

_ENTITY = re.compile(rb"#(\d+)\s*=\s*([A-Z_0-9]*)\s*\(")
_COMPLEX = re.compile(rb"UNIT|REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION")
_BODY = re.compile(rb"(?:[^';]+|'[^']*')*")
_REFERENCE = re.compile(rb"'(?:[^']|'')*'|#(\d+)")
_COMMENT = re.compile(rb"'[^']*(?:'|\Z)|/\*.*?\*/", re.DOTALL)
_TOKEN = re.compile(
    rb"\s*(?:(?P<string>'(?:[^']|'')*')|#(?P<ref>\d+)|(?P<enum>\.[A-Za-z0-9_]+\.)"
    rb"|(?P<number>[+-]?\d+\.?\d*(?:[eE][+-]?\d+)?)|(?P<name>[A-Za-z_!][A-Za-z0-9_]*)"
    rb'|(?P<binary>"[0-9A-Fa-f]*")|(?P<mark>[(),$*]))'
)
_END = b"END-ISO-10303-21"


@dataclass(eq=False)
class Part21:
    """The wanted entities of one file.

    keywords
        id → keyword ("" for a complex entity).
    ordinals
        id → position among all entities of the file, counted from 1: the kernel numbers them so.
    ids
        keyword → the ids that have it, in file order.
    count, highest
        how many entities there are, and the largest id.
    complete
        False where the file lacks its end mark, so that it was cut off.
    """

    data: Buffer
    keywords: dict[int, str] = field(default_factory=dict)
    ordinals: dict[int, int] = field(default_factory=dict)
    starts: dict[int, int] = field(default_factory=dict)
    ids: dict[str, list[int]] = field(default_factory=lambda: defaultdict(list))
    count: int = 0
    highest: int = 0
    complete: bool = False

    def of(self, *keywords: str) -> Iterator[tuple[int, tuple[Value, ...]]]:
        """All wanted entities with one of these keywords: id and arguments."""
        for number in self.listed(*keywords):
            yield number, self.arguments(number)

    def arguments(self, number: int) -> tuple[Value, ...]:
        """The arguments of entity ``number``; of a complex one, its parts as Typed. () where unreadable."""
        try:
            return _parsed(self.body(number))
        except InputError:
            return ()

    def references(self, number: int) -> tuple[int, ...]:
        """All ids that entity ``number`` refers to, in order, wherever they stand in it. Quick."""
        return tuple(int(found) for found in _REFERENCE.findall(self.body(number)) if found)

    def listed(self, *keywords: str) -> Iterator[int]:
        """The ids of all wanted entities with one of these keywords, those of one in file order."""
        return (number for keyword in keywords for number in self.ids.get(keyword, ()))

    def body(self, number: int) -> bytes:
        """The text of entity ``number`` from its bracket to before its semicolon; b"" where there is none."""
        start = self.starts.get(number)
        if start is None:
            return b""
        match = _BODY.match(self.data, start, min(len(self.data), start + MAX_ENTITY_BYTES))
        return match[0] if match is not None else b""


def scan(data: Buffer, wanted: frozenset[str]) -> Part21:
    """Find the entities whose keyword is in ``wanted`` or ends in SHAPE_REPRESENTATION.

    Of complex entities: units, and relationships that place a part.
    """
    if (end := data.rfind(b"*/") + 2) > 1:  # a comment may hold what looks like an entity
        # Most have one in the header only: the rest is not looked through.
        data = _COMMENT.sub(_blank, data[:end]) + data[end:]
    result = Part21(data)
    names: dict[bytes, str | None] = {}
    ordinal = 0
    for ordinal, match in enumerate(_ENTITY.finditer(data), start=1):
        digits, keyword = match.groups()
        if keyword not in names:
            word = keyword.decode("ascii")
            known = not word or word in wanted or word.endswith("SHAPE_REPRESENTATION")
            names[keyword] = word if known else None
        number = int(digits)
        if number > result.highest:
            result.highest = number
        name = names[keyword]
        if name is None or (not name and not _COMPLEX.search(data, match.end(), match.end() + 400)):
            continue
        result.keywords[number] = name
        result.ids[name].append(number)
        result.ordinals[number] = ordinal
        result.starts[number] = match.end() - 1
    result.count = ordinal
    result.complete = data.rfind(_END) > 0
    return result


def _blank(found: re.Match[bytes]) -> bytes:
    """Space in place of a comment; a string stays."""
    return found[0] if found[0][:1] == b"'" else b" " * len(found[0])


def refs(value: Value) -> tuple[int, ...]:
    """The ids that a value refers to directly: of one reference, or of a list of them."""
    if isinstance(value, Ref):
        return (value.id,)
    if isinstance(value, tuple):
        return tuple(item.id for item in value if isinstance(item, Ref))
    return ()


def ref(values: tuple[Value, ...], position: int) -> int | None:
    """The id that argument ``position`` refers to, None where there is no such reference."""
    found = refs(values[position]) if position < len(values) else ()
    return found[0] if found else None


def text(values: tuple[Value, ...], position: int) -> str:
    """Argument ``position`` as text, "" where it is none."""
    value = values[position] if position < len(values) else None
    return value if isinstance(value, str) else ""


def number(value: Value) -> float | None:
    """The number in a value, with or without its type around it."""
    if isinstance(value, Typed) and len(value.values) == 1:
        value = value.values[0]
    return value if isinstance(value, float) else None


def _parsed(body: bytes) -> tuple[Value, ...]:
    values, end = _list(body, 0, 0)
    if body[end:].strip():
        raise InputError("text after the closing bracket of an entity")
    # A complex entity is a row of Typed without commas; a simple one a list of arguments.
    return values


def _list(body: bytes, position: int, depth: int) -> tuple[tuple[Value, ...], int]:
    """The values of a bracketed list beginning at ``position``, and the position after it."""
    if depth > MAX_DEPTH:
        raise InputError(f"an entity nests its brackets more than {MAX_DEPTH} deep")
    values: list[Value] = []
    position = _mark(body, position, b"(")
    while True:
        match = _TOKEN.match(body, position)
        if match is None:
            raise InputError("an entity ends before its brackets are closed")
        kind, token = match.lastgroup, match[match.lastgroup or 0]
        position = match.end()
        if kind == "mark" and token == b")":
            return tuple(values), position
        if kind == "mark" and token == b"(":
            inner, position = _list(body, match.end() - 1, depth + 1)
            values.append(inner)
        elif kind == "name":
            inner, position = _list(body, position, depth + 1)
            values.append(Typed(token.decode("ascii"), inner))
        elif not (kind == "mark" and token == b","):
            values.append(_scalar(kind, token))


def _mark(body: bytes, position: int, mark: bytes) -> int:
    match = _TOKEN.match(body, position)
    if match is None or match["mark"] != mark:
        raise InputError(f"wanted {mark.decode()} in an entity, got {body[position : position + 10]!r}")
    return match.end()


def _scalar(kind: str | None, token: bytes) -> Value:
    if kind == "ref":
        return Ref(int(token))
    if kind == "number":
        return float(token)
    if kind == "enum":
        return token.decode("ascii")
    if kind == "string":
        return decoded(token[1:-1])
    return None


_ESCAPE = re.compile(
    r"\\X2\\(?P<two>[0-9A-Fa-f]*)\\X0\\|\\X4\\(?P<four>[0-9A-Fa-f]*)\\X0\\"
    r"|\\X\\(?P<one>[0-9A-Fa-f]{2})|\\S\\(?P<shift>.)|\\P[A-I]\\|\\\\|''",
    re.DOTALL,
)


def decoded(raw: bytes) -> str:
    """A Part 21 string as text: quotes, ``\\X\\``, ``\\X2\\``, ``\\X4\\`` and ``\\S\\`` undone.

    Bytes above 127 are against the standard and common: UTF-8 where they are that, else Windows-1252.
    """
    try:
        plain = raw.decode("utf-8")
    except UnicodeDecodeError:
        plain = raw.decode("cp1252", errors="replace")
    return _ESCAPE.sub(_unescaped, plain.replace("\r", "").replace("\n", ""))


def _unescaped(match: re.Match[str]) -> str:
    if (code := match["two"] or match["four"]) is not None:
        encoding = "utf-16-be" if match["two"] else "utf-32-be"
        return bytes.fromhex(code[: len(code) // 2 * 2]).decode(encoding, errors="replace")
    if match["one"] is not None:
        return chr(int(match["one"], 16))
    if match["shift"] is not None:
        return chr((ord(match["shift"]) + 128) % 256) if ord(match["shift"]) < 128 else match["shift"]
    return {"\\\\": "\\", "''": "'"}.get(match[0], "")
