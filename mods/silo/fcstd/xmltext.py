# SPDX-License-Identifier: LGPL-2.1-or-later
"""Document.xml, unpacked and indexed only as far as somebody asks.

In well-formed XML no ``<`` stands in an attribute value or in text, so in a text without ``<!`` and ``<?``
every ``<`` begins a tag, and searching for tags is exact. FreeCAD writes such text (but for one comment at
the top), always in one form. The quick way below accepts exactly that form, step by step, each object right
behind the other; at the first thing that it does not expect it gives way to :mod:`silo.fcstd.expat_reader`,
where expat has the last word. A text that is read to its end has been counted, closed and checked against its
checksum.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Callable, Iterable
from hashlib import sha256
from itertools import accumulate, compress, count, islice, repeat
from operator import lshift, not_, or_
from typing import TYPE_CHECKING, Any

from silo.bom.message import message
from silo.fcstd.container import Inflater, ZipEntry
from silo.fcstd.errors import FcstdError
from silo.fcstd.expat_reader import Head, Malformed, Span, as_utf8, index_document
from silo.fcstd.limits import Limits

if TYPE_CHECKING:
    from silo.fcstd.properties import Shape


_ATTRIBUTES = rb'((?:\s+[\w:.-]+="[^"<]*")*)\s*'
_HEAD = re.compile(
    rb"""<\?xml version=["']1.0["'] encoding=["'](?:utf-8|UTF-8|us-ascii)["']\s*\?>\s*"""
    rb"(?:<!--[^-]*(?:-[^-]+)*-->\s*)?<Document" + _ATTRIBUTES + rb">"
)
_ATTRIBUTE = re.compile(rb'\s([\w:.-]+)="([^"&]*)"')
_OBJECTS = re.compile(rb'<Objects Count="(\d{1,9})"' + _ATTRIBUTES + rb">")
_OBJECT_TYPE = re.compile(rb'<Object type="([^"&]+)" name="([^"&]+)"')
_OBJECT_DATA = re.compile(rb"</Objects>\s*<ObjectData" + _ATTRIBUTES + rb">")
_OBJECT = re.compile(rb'\s*<Object name="([^"&]+)"' + _ATTRIBUTES + rb">")
_CLOSING = b"</Object>"
_LINKED = re.compile(rb'<XLink(?:Sub)?\s[^<>]*?\bfile="([^"<]+)"')
_TAIL = re.compile(rb"\s*</ObjectData>\s*</Document>\s*\Z")

# The first step holds the head and the object of a small part; the next ones are bigger.
_FIRST_STEP, _GROWTH, _HEAD_AT_MOST = 1 << 14, 4, 1 << 16


_CUT_AT_MOST = 1 << 24

# A span in one number: its begin above its end.
_HALF = 40
_LOW = (1 << _HALF) - 1


class _Unexpected(Exception):
    """The quick way met something that FreeCAD does not write."""


class SharedTexts:
    """What the texts of one session share: lists of property names, and a bound on memory."""

    def __init__(self, resident_limit: int) -> None:
        self.shapes: dict[tuple[str, int], Shape] = {}
        self._limit = resident_limit
        self._resident: dict[XmlText, int] = {}
        self._total = 0
        self._huge: XmlText | None = None

    def hold(self, text: XmlText, size: int) -> None:
        """Count ``size`` bytes for a text; the texts that grew longest ago free theirs for it.

        A text that is longer than all texts may be together does not count. Otherwise each growing text would
        push it out, although the next object is read from it again.
        """
        self._total -= self._resident.pop(text, 0)
        if size > self._limit:
            if self._huge is not None and self._huge is not text:
                self._huge.release()
            self._huge = text
            return
        self._total += size
        self._resident[text] = size
        while self._total > self._limit and len(self._resident) > 1:
            oldest = next(iter(self._resident))
            self._total -= self._resident.pop(oldest)
            oldest.release()


class XmlText:
    """The text of one Document.xml. All its methods may raise FcstdError."""

    def __init__(
        self, path: str, entry: ZipEntry, packed: bytes, limits: Limits, shared: SharedTexts | None = None
    ) -> None:
        self.path, self.limits, self.shared = path, limits, shared or SharedTexts(limits.resident)
        self._entry, self._packed = entry, packed
        self._inflater: Inflater
        self._text: bytes | None = b""
        self._known = 0
        self._head: Head | None = None
        self._data: dict[str, int] = {}  # begin and end in one number: a quarter of the memory of a pair
        self._names: list[bytes] = []
        self._position = 0
        self._complete = False
        self._failure: FcstdError | None = None
        self._sound: Malformed | bool | None = None  # expat's word on the whole, once a piece was refused
        self.is_careful = False

    def __reduce__(self) -> tuple[Any, ...]:
        """Send to another process only what was read, not what was made from it."""
        return XmlText, (self.path, self._entry, self._packed, self.limits)

    @property
    def text(self) -> bytes:
        """Return what is unpacked so far; spans count from its beginning."""
        return self._text if self._text is not None else self._unpack_again()

    @property
    def packed_size(self) -> int:
        """Return roughly how many bytes stay in memory: the packed text, and the place of each object."""
        return len(self._packed) + self._entry.size // 4

    def digest(self, directory: bytes) -> str:
        """Hash the packed text and the container's directory, which has a checksum of each other entry."""
        return sha256(b"%d %b%b" % (len(directory), directory, self._packed)).hexdigest()

    def release(self) -> None:
        """Free the memory of the text; it is unpacked again when it is needed."""
        self._text = None

    @property
    def head(self) -> Head:
        """Return the attributes, the types of all objects, and the document's properties."""
        if self._head is None:
            self._settle(self._find_head)
        assert self._head is not None
        return self._head

    def attribute(self, name: str, default: str = "") -> str:
        """Return an attribute of the ``<Document>`` element."""
        head = self.head
        if isinstance(head.attributes, bytes):
            matches = _ATTRIBUTE.findall(head.attributes)
            head.attributes = {self.decode(key): self.decode(value) for key, value in matches}
        return head.attributes.get(name, default)

    def span(self, name: str) -> Span | None:
        """Return where the data of an object lies; None if ``head.types`` does not have it."""
        if (span_here := self._data.get(name)) is None:
            if name not in self.head.types:
                return None
            self._settle(lambda: self._index_objects(name))
            if (span_here := self._data.get(name)) is None:
                return None
        return span_here >> _HALF, span_here & _LOW

    def complete(self) -> None:
        """Read to the end, and check everything that can be checked there."""
        if not self._complete:
            self._settle(self._index_objects)

    def error(self, reason: str) -> FcstdError:
        """Make an error about this text."""
        return FcstdError(self.path, message("its Document.xml {reason}", reason=reason))

    def malformed(self, problem: Malformed) -> FcstdError:
        """Make an error about a piece of this text; prefers expat's words about the whole, which name the
        line.
        """
        if self._sound is None and not self.is_careful:
            try:
                whole = self._new_inflater().rest()
                index_document(as_utf8(whole), self.limits.depth)
                self._sound = True
            except Malformed as error:
                self._sound = error
        return self.error(str(self._sound if isinstance(self._sound, Malformed) else problem))

    def decode(self, raw: bytes) -> str:
        """Decode UTF-8, or raise an error."""
        try:
            return raw.decode()
        except UnicodeDecodeError as error:
            raise self.error(message("is not in UTF-8")) from error

    def _settle(self, quick: Callable[[], None]) -> None:
        """Try the quick way, then the careful one. What failed once fails again without being read again."""
        if self._failure is not None:
            raise FcstdError(self.path, self._failure.reason)
        try:
            try:
                quick()
            except _Unexpected:
                self._read_carefully()
        except FcstdError as error:
            self._failure = error
            raise

    def _new_inflater(self) -> Inflater:
        return Inflater(self.path, self._entry, self._packed, self.limits.document_xml, self.limits)

    def _begin(self, whole: bool) -> bytes:
        """Unpack the first step; all of a small text, since that costs no more than a part of it."""
        self._inflater = self._new_inflater()
        if whole or self._entry.size <= _FIRST_STEP * _GROWTH:
            return self._hold(self._inflater.whole())
        return self._hold(self._inflater.step(_FIRST_STEP))

    def _extend(self) -> bytes:
        """Unpack one more step, and return the text. Raises _Unexpected at the end."""
        text = self.text
        if self._inflater.finished:
            raise _Unexpected
        more = self._inflater.step(max(_FIRST_STEP, len(text) * (_GROWTH - 1)))
        length = len(text)
        text = self._hold(text + more)
        if self._head is not None:
            _refuse_markup(text, max(0, length - 1))
        return text

    def _hold(self, text: bytes) -> bytes:
        self._text, self._known = text, len(text)
        self.shared.hold(self, len(text))
        return text

    def _find_head(self, whole: bool = False) -> None:
        text = self._begin(whole)
        if (opening := _HEAD.match(text)) is None or b"&" in opening[1]:
            raise _Unexpected
        begins = opening.end()
        while (end := text.find(b"</Objects>", begins)) < 0:
            text = self._extend()
        while (data := _OBJECT_DATA.match(text, end)) is None:
            if len(text) > end + _HEAD_AT_MOST:
                raise _Unexpected
            text = self._extend()
        _refuse_markup(text, begins)
        at = text.find(b"<Objects", begins)
        self._head = Head(opening[1], self._quick_types(text, at, end), _only_properties(text, begins, at))
        self._position = data.end()

    def _quick_types(self, text: bytes, begin: int, end: int) -> dict[str, str]:
        opening = _OBJECTS.match(text, begin, end)
        matches = _OBJECT_TYPE.findall(text, begin, end)
        if opening is None or not int(opening[1]) == len(matches) == text.count(b"<Object ", begin, end):
            raise _Unexpected
        self._limit_objects(len(matches))
        listed, self._names = map(list, zip(*matches, strict=True)) if matches else ([], [])
        kinds = {kind: self.decode(kind) for kind in set(listed)}
        # No name holds a quotation mark.
        names = self.decode(b'"'.join(self._names)).split('"') if matches else ()
        types = dict(zip(names, map(kinds.__getitem__, listed), strict=True))
        if len(types) != len(matches):
            raise _Unexpected
        return types

    def _limit_objects(self, count: int) -> None:
        if count > self.limits.objects:
            raise self.error(
                message(
                    "lists {count} objects; at most {objects} are read",
                    count=count,
                    objects=self.limits.objects,
                )
            )

    def _index_objects(self, until: str | None = None) -> None:
        """Index the objects from where the last run stopped, up to the named one or to the end."""
        if self._head is None:
            self._find_head(whole=until is None)
        if self._complete:
            return
        whole = until is None and not self._data and self._inflater.finished
        # The pieces are as much as the text; of a large one they would be too much.
        if whole and self._known <= _CUT_AT_MOST and self._cut_at_once():
            self._complete = True
            self._names.clear()
            return
        text, data, position = self.text, self._data, self._position
        # If the data is in the order of the list, the names are those of the list, not copies of them.
        listed = islice(self._head.types if self._head is not None else (), len(data), None)
        match, closing = _OBJECT.match, _CLOSING
        while True:
            opening = match(text, position)
            end = text.find(closing, opening.end()) if opening else -1
            if opening is not None and end >= 0:
                name = self.decode(opening[1])
                if name in data:
                    raise _Unexpected
                if (same := next(listed, name)) == name:
                    name = same
                data[name] = position << _HALF | end + 9
                self._position = position = end + 9
                if name == until:
                    return
            elif self._inflater.finished and _TAIL.match(text, position):
                break
            else:
                text = self._extend()
        if self._head is None or data.keys() != self._head.types.keys():
            raise _Unexpected
        self._complete = True
        self._names.clear()

    def _cut_at_once(self) -> bool:
        """Index the data of all objects, if they are in the order of the list; returns False if they
        are not.
        """
        assert self._head is not None  # found before
        pieces = self.text[self._position :].split(_CLOSING)
        tail = pieces.pop()
        if not pieces or len(pieces) != len(self._names) or not _TAIL.match(tail):
            return False
        indent = pieces[0].partition(b"<")[0]
        if not indent.isspace() and indent:
            return False
        # A text has thousands of objects: what is done for each of them is done by functions in C.
        begin = indent + b'<Object name="'
        opening = (begin + (b'">\0' + begin).join(self._names) + b'">').split(b"\0")
        if len(opening) != len(pieces):
            return False
        for number in compress(count(), map(not_, map(bytes.startswith, pieces, opening))):
            match = _OBJECT.match(pieces[number])
            if match is None or match[1] != self._names[number]:
                return False
        lengths = map(len(_CLOSING).__add__, map(len, pieces))
        ends = list(accumulate(lengths, initial=self._position))
        spans = map(or_, map(lshift, ends, repeat(_HALF)), islice(ends, 1, None))
        self._data = dict(zip(self._head.types, spans, strict=True))
        self._position = ends[-1]
        return True

    def mentioning(self, word: str) -> Iterable[str]:
        """Return the names of objects whose data may hold a word, in the order of the text, which must have
        been read to its end.
        """
        # A search is quicker than find() if the first letter is rare.
        text, wanted = self.text, re.compile(re.escape(word.encode()))
        if b"&" in text and b"&#" in text:  # which may be a letter
            return self.head.types
        mentioned, names = list[str](), list(self._data)
        ends = list(map(_LOW.__and__, self._data.values()))
        if ends != sorted(ends):
            return self.head.types
        at = wanted.search(text, self._data[names[0]] >> _HALF) if names else None
        while at is not None:
            number = bisect_right(ends, at.start())
            if number == len(names):
                break
            mentioned.append(names[number])
            at = wanted.search(text, ends[number])
        return mentioned

    def linked(self) -> set[str]:
        """Return roughly the recorded paths of linked files; the text must have been read to its end."""
        matches = {self.decode(path) for path in _LINKED.findall(self.text)}
        if any("&" in path for path in matches):
            from xml.sax.saxutils import unescape  # it imports HTTP and TLS

            matches = {unescape(path) for path in matches}
        return matches

    def _read_carefully(self) -> None:
        text = self.text + self._inflater.rest()
        try:
            text = as_utf8(text)
            head, data = index_document(text, self.limits.depth)
        except Malformed as error:
            raise self.error(str(error)) from error
        self._limit_objects(len(head.types))
        if lost := [name for name in head.types if name not in data]:
            raise self.error(
                message("lists the object {lost} but does not hold its data", lost=repr(lost[0]))
            )
        self._head = head
        self._data = {name: begin << _HALF | end for name, (begin, end) in data.items()}
        self._hold(text)
        self._complete = self.is_careful = True

    def _unpack_again(self) -> bytes:
        self._inflater = self._new_inflater()
        if self.is_careful:
            text = as_utf8(self._inflater.rest())
        else:
            text = self._inflater.rest(self._known)
        return self._hold(text)


def _refuse_markup(text: bytes, start: int) -> None:
    """Refuse comments, CDATA, document types and processing instructions in the quick way."""
    # One byte is looked for much faster than two, and FreeCAD's texts seldom have either.
    if (text.find(b"!", start) >= 0 and text.find(b"<!", start) >= 0) or (
        text.find(b"?", start) >= 0 and text.find(b"<?", start) >= 0
    ):
        raise _Unexpected


def _only_properties(text: bytes, begin: int, end: int) -> Span | None:
    start = text.find(b"<Properties", begin, end)
    if start < 0:
        raise _Unexpected
    close = text.find(b"</Properties>", start, end)
    if close < 0 or text.find(b"<Properties", start + 1, end) >= 0:
        raise _Unexpected
    return start, close + len(b"</Properties>")
