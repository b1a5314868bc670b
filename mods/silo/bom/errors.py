# SPDX-License-Identifier: LGPL-2.1-or-later
"""Every error of the project, split by whose fault it is.

::

    SiloError
    ├── InputError              ours to repair: a file, an argument, a configuration
    │   ├── DocumentError       a FreeCAD document cannot be read or written
    │   ├── SeveralAssembliesError  a document holds several, and none was named
    │   └── ConfigError         the configuration is missing or contradicts itself
    │       └── PackageError    a Python package cannot be imported
    ├── RemoteError             the server's, or the way to it
    │   ├── UnreachableError    no answer (no network, refused, timed out)
    │   │   ├── NotSentError    the request did not leave this computer
    │   │   └── BusyError       429, 503 with Retry-After: not processed, ask again later
    │   ├── AuthError           401: who are you
    │   │   └── ForbiddenError  403: you may not
    │   ├── NotFoundError       404
    │   │   └── RouteMissingError  404, 405, 501: this server does not know the request at all
    │   ├── RejectedError       400, 413, 422: the server names what it does not accept
    │   ├── ReadOnlyError       503: the server takes no changes now
    │   └── ServerFaultError    any other 5xx, or an answer that cannot be understood
    ├── ConflictError           no one's: two truths met (409)
    │   ├── CycleError          the BOM would contain itself
    │   ├── NewerRevisionError  somebody committed the item since this file was opened
    │   ├── MissingRevisionError  the server does not have the file that this BOM is of
    │   └── VersionConflictError  412: somebody else changed it first
    └── CancelledError          a user stopped it; not a failure

A message says what was wanted, what was got, where, and what to do. It is English, for it is stored, compared
and sent; :func:`spoken` says it in the language of a user where it is shown.
"""

from __future__ import annotations

import difflib
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from enum import IntEnum
from functools import lru_cache
from itertools import chain
from typing import Any, ClassVar

from silo.bom.message import Message, joined, message, template


class Exit(IntEnum):
    """What every command and job ends with, and what documents and scripts rely on."""

    DONE = 0
    UNDONE = 1  # something differs, was left out, is held or waits; the output says what
    BAD_INPUT = 2  # an argument, a file or the configuration cannot be used; also if the server notices
    REMOTE = 3  # no server, or no right
    CANCELLED = 130  # Ctrl-C, SIGINT or SIGTERM


def exit_of(error: BaseException) -> Exit:
    """Return the exit code of an error; it says whose fault the error is."""
    if isinstance(error, KeyboardInterrupt | CancelledError):
        return Exit.CANCELLED
    if isinstance(error, ConflictError):  # two truths met: a user decides
        return Exit.UNDONE
    refused = isinstance(error, RejectedError) or type(error) is NotFoundError
    return Exit.REMOTE if isinstance(error, RemoteError) and not refused else Exit.BAD_INPUT


def did_you_mean(given: str, candidates: Iterable[str]) -> str:
    """Write the end of a sentence about an unknown name: the known names that look like it; "" if none
    does.
    """
    near = difflib.get_close_matches(given, list(candidates), 2, 0.7)
    if len(near) > 1:
        return message("; did you mean {first} or {second}?", first=near[0], second=near[1])
    return message("; did you mean {name}?", name=near[0]) if near else ""


def counted(number: int, singular: str, many: str = "") -> str:
    """Return "1 item" or "2 items"; ``many`` if the plural is not ``singular`` with an s."""
    # The script that collects the texts knows the nouns of each call.
    return Message(f"{{n}} {singular}", {"n": number}, f"{{n}} {many or singular + 's'}")


# As ``FreeCAD.Qt.translate``: (context, text) -> the text in the user's language.
Translate = Callable[[str, str], str]


def english(_context: str, text: str) -> str:
    """Return the text unchanged."""
    return text


def duration(seconds: float) -> str:
    """Write a span of time for people: 40 s, 10 min, 26 hours, 27000 days."""
    for size, text in ((86400.0, template("{n} days")), (3600.0, template("{n} hours")), (60.0, "{n} min")):
        if seconds >= 2 * size:
            return Message(text, {"n": f"{seconds / size:.0f}"})
    return f"{seconds:.0f} s"


def listed(names: Sequence[str], most: int = 5) -> str:
    """List the first ``most`` names, and how many more there are: a, b and 3 more."""
    is_plain = not any(isinstance(name, Message) for name in names)
    first = ", ".join(names[:most]) if is_plain else joined(", ", names[:most])
    return message("{names} and {n} more", names=first, n=len(names) - most) if len(names) > most else first


class Sentences:
    """Says English sentences in another language.

    The catalogue has patterns with ``{name}`` for what is filled in, which may be a sentence as well; ``{n}``
    is a number; ``{words}``, ``{role}`` and ``{status}`` are words of ours. Of several patterns the one with
    the most words of its own is taken. What the catalogue does not have stays as it is. Translations are
    remembered, so that a page can say each of its rows.
    """

    LONGEST = 1000
    OURS = re.compile(r"\{(words|role|status|decided_by)\d*\}")

    def __init__(self, catalogue: Mapping[str, str]) -> None:
        self._catalogue = {text: done for text, done in catalogue.items() if text}
        split = [(re.split(r"\{\w+\}", text), text) for text in catalogue if "{" in text]
        # The name of the program is no part of a sentence.
        split.sort(key=lambda pair: (pair[1][:4] != "silo", -sum(map(len, pair[0]))))
        # A pattern is looked up by the word of its own that the fewest others have; a value may touch a word.
        words = [re.findall(r"(?<![\w}])\w+(?![\w{])", "{}".join(parts)) or [""] for parts, _ in split]
        count = Counter(chain.from_iterable(words))
        self._patterns: dict[str, list[tuple[int, list[str], str]]] = {}
        for number, (own, (parts, text)) in enumerate(zip(words, split, strict=True)):
            self._patterns.setdefault(min(own, key=count.__getitem__), []).append((number, parts, text))
        self._known: Callable[[str, bool], str] = lru_cache(4096)(self._said)

    def __call__(self, text: str, whole: bool = True) -> str:
        """Translate ``text``. A single word stays in a part of a sentence: it may be somebody's name."""
        if "\n" in text:
            return "\n".join(self(line, whole) for line in text.split("\n"))
        return (self._known if len(text) <= self.LONGEST else self._said)(text, whole)

    def _said(self, text: str, whole: bool) -> str:
        if text in self._catalogue and (whole or " " in text):
            return self._catalogue[text]
        words = {"", *re.findall(r"\w+", text)} if len(text) <= self.LONGEST else ()
        for _number, parts, pattern in sorted(chain.from_iterable(self._patterns.get(w, ()) for w in words)):
            if all(map(text.__contains__, parts)) and (found := self._match(parts, pattern, text, whole)):
                return re.sub(r"\{\w+\}", lambda place: found[place[0]], self._catalogue[pattern])
        rest = re.sub(r"^[^\w{\[-]+", "", text)
        before, core = text[: len(text) - len(rest)], rest.rstrip()
        if core != text:
            return f"{before}{self(core, whole)}{text[len(before) + len(core) :]}" if core else text
        for between in ("  ", ". ", "; ", ": ", " (", ", "):
            if between in text:
                # Behind a path or a name the rest may be a sentence with a colon of its own.
                pieces = text.split(between, 1 if between == ": " else -1)
                return between.join(self(piece, False) for piece in pieces)
        core = text.rstrip(").:;?!…")
        return f"{self(core, whole)}{text[len(core) :]}" if core not in ("", text) else text

    def _match(self, parts: Sequence[str], pattern: str, text: str, whole: bool) -> dict[str, str]:
        places = re.findall(r"\{\w+\}", pattern)
        several = any(end in text and end not in pattern for end in (". ", "; ", ": "))
        words = len(re.findall(r"[^\W\d_]{2}\b", " ".join(parts)))
        # A single word says too little of a part of a sentence, and of several.
        if "{n}" not in places and words < 2 and (several or not whole):
            return {}
        # A name before a colon is up to the first colon.
        ways = [
            r"(\d+)" if place == "{n}" else "((?:(?!: ).)*?)" if behind.startswith(": ") else "(.*?)"
            for place, behind in zip(places, parts[1:], strict=True)
        ]
        found = re.fullmatch(
            "".join(map("".join, zip(map(re.escape, parts), (*ways, ""), strict=True))), text
        )
        values = found.groups() if found else ()
        return {
            place: ", ".join(map(self, value.split(", "))) if self.OURS.match(place) else self(value, False)
            for place, value in zip(places, values, strict=False)
        }


class SiloError(Exception):
    """The root. ``status_hint`` is the HTTP status a server answers with, ``code`` its machine name."""

    status_hint: ClassVar[int] = 500
    code: ClassVar[str] = "error"


class InputError(SiloError):
    """Something given to us is unusable. ``problems`` lists all that is wrong with it."""

    status_hint = 400
    code = "bad_input"

    def __init__(self, message: str, problems: Sequence[str] = ()) -> None:
        super().__init__(message)
        self.problems = tuple(problems)


class DocumentError(InputError):
    """A FreeCAD document cannot be read or written."""

    code = "bad_document"

    def __init__(self, path: str, reason: str) -> None:
        super().__init__(message("{path}: {reason}", path=path, reason=reason))
        self.path = path
        self.reason = reason


class SeveralAssembliesError(InputError):
    """A file holds several assemblies, and none was chosen; ``names``: those of FreeCAD."""

    code = "several_assemblies"

    def __init__(self, message: str, path: str = "", names: Sequence[str] = ()) -> None:
        super().__init__(message)
        self.path, self.names = path, tuple(names)


class ConfigError(InputError):
    """The configuration is missing or contradicts itself."""

    code = "bad_config"


class PackageError(ConfigError):
    """A Python package that is needed cannot be imported; installing it repairs that."""

    code = "bad_package"


class RemoteError(SiloError):
    """The server's fault, or that of the way to it. ``retry_after``: the pause it asks for, in seconds."""

    retry_after: float | None = None

    status_hint = 502
    code = "remote"


class UnreachableError(RemoteError):
    """No answer: no network, connection refused, timed out. ``refused``: a 503, so nothing was processed."""

    refused: bool = False

    status_hint = 504
    code = "unreachable"


class NotSentError(UnreachableError):
    """The request did not leave this computer: no such host, refused. Sending again is safe."""


class BusyError(UnreachableError):
    """429, or 503 with Retry-After: the server did not process the request and wants it later."""

    status_hint = 503
    code = "busy"


class AuthError(RemoteError):
    """401: the token is missing or wrong."""

    status_hint = 401
    code = "unauthorized"


class ForbiddenError(AuthError):
    """403: the token is known, but its role is too low."""

    status_hint = 403
    code = "forbidden"


class NotFoundError(RemoteError):
    """404: the server has no such item or revision."""

    status_hint = 404
    code = "not_found"


class RouteMissingError(NotFoundError):
    """404, 405, 501: the server does not know the request at all; it is older, or no Silo."""

    status_hint = 404
    code = "no_route"


class RejectedError(RemoteError):
    """400, 413, 422: the server does not accept what was sent. ``problems`` lists all of it at once."""

    status: int | None = None  # as the server answered

    status_hint = 400
    code = "rejected"

    def __init__(self, message: str, problems: Sequence[str] = ()) -> None:
        super().__init__(message)
        self.problems = tuple(problems)


class ReadOnlyError(RemoteError):
    """503: the server takes no changes now; the same request may succeed later.

    ``named``: it says so itself; else only what answered may be out of order, as the store of files.
    """

    named: bool = True

    status_hint = 503
    code = "read_only"


class ServerFaultError(RemoteError):
    """Another 5xx, or an answer that cannot be understood."""

    status_hint = 500
    code = "server_fault"


class ConflictError(SiloError):
    """Two truths met (409); a user or a new read decides."""

    status_hint = 409
    code = "conflict"


class CycleError(ConflictError):
    """A BOM would contain itself. ``path`` is the ring of part numbers or objects, first = last."""

    code = "cycle"

    def __init__(self, path: Sequence[str]) -> None:
        super().__init__(message("this BOM would contain itself: {path}", path=" → ".join(path)))
        self.path = tuple(path)


class NewerRevisionError(ConflictError):
    """Somebody committed the item since this file was opened. ``revision`` is the newest one with a file."""

    code = "newer_revision"

    def __init__(self, message: str, revision: Mapping[str, Any]) -> None:
        super().__init__(message)
        self.revision = revision


class MissingRevisionError(ConflictError):
    """The server does not have, or has no more, the file that a BOM is of: the file has to go first."""

    code = "missing_revision"


class VersionConflictError(ConflictError):
    """412: the BOM has another version than the one the request was made from."""

    status_hint = 412
    code = "version_conflict"


class CancelledError(SiloError):
    """A user stopped it. Nothing is wrong; what was done before the stop stays done."""

    status_hint = 499
    code = "cancelled"
