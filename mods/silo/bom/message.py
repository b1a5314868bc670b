# SPDX-License-Identifier: LGPL-2.1-or-later
"""A message: a template and its values, which become a sentence where they are shown.

A message reads as its English sentence, for it is a ``str``: it can be stored, compared and sent. It keeps
its template and its values, so that another language needs no guess about which words are whose:

* the template is the message's code, as gettext has it: ``The file {file} is missing``;
* a value appears unchanged in each language; a value that is a message is translated by its own template;
* a value never fills a place again: ``{name}`` inside a value stays;
* ``str()`` of a message, and of an error that has one, is the message; what is added to a message with ``+``
  makes a message;
* what is made of a message by cutting it, or by an f-string or ``join``, is a plain ``str``, which is shown
  as it is: put messages together with :func:`message` and :func:`joined`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any, Protocol, Self

_PLACE = re.compile(r"\{(\w+)\}")
# Values that never hold a sentence of ours; all others may, until no plain sentence is left.
_NAMES = frozenset(
    (
        *("file", "path", "part", "name", "names", "users", "obj", "target", "label", "document", "place"),
        *("part_number", "part_numbers", "parent", "child", "supplier_part", "subject", "revision"),
        *("user", "username", "got", "uuid", "checksum", "key", "sheets", "category"),
    )
)


class Catalogue(Protocol):
    """The texts of a language; :class:`gettext.NullTranslations` and its kind have it."""

    def gettext(self, message: str, /) -> str: ...

    def ngettext(self, msgid1: str, msgid2: str, n: int, /) -> str: ...


class Message(str):
    """An English sentence that remembers its template and values.

    template
        with ``{name}`` for each value; the singular if there is a plural.
    plural
        the template for other numbers than one; "" if the sentence counts nothing.
    values
        name → value; ``n`` is the number that decides between singular and plural.
    """

    template: str
    plural: str
    values: Mapping[str, Any]

    def __new__(cls, template: str, values: Mapping[str, Any] | None = None, plural: str = "") -> Self:
        """Fill the template in English. Raises KeyError for a place without a value."""
        # An exception or a path may change until the sentence is shown. An error gives its message.
        kept = MappingProxyType({name: _kept(value) for name, value in (values or {}).items()})
        english = plural if plural and kept["n"] != 1 else template
        made = super().__new__(cls, _PLACE.sub(lambda place: str(kept[place[1]]), english))
        made.template, made.plural, made.values = template, plural, kept
        return made

    def __str__(self) -> str:
        """Stay a message."""
        return self

    def __add__(self, more: str, /) -> Message:
        """Put a text behind; it stays as it is in each language."""
        return joined("", (self, more)) if more else self

    def __radd__(self, before: str, /) -> Message:
        """Put a text before."""
        return joined("", (before, self)) if before else self

    def __reduce__(self) -> tuple[type[Message], tuple[str, dict[str, Any], str]]:
        """Travel to another process whole."""
        return type(self), (self.template, dict(self.values), self.plural)

    def said(self, catalogue: Catalogue) -> str:
        """Return the sentence in the language of the catalogue."""
        if self.plural:
            text = catalogue.ngettext(self.template, self.plural, self.values["n"])
        else:
            text = catalogue.gettext(self.template) if self.template else ""
        shown = {
            name: value if name in _NAMES and not isinstance(value, Message) else said(value, catalogue)
            for name, value in self.values.items()
        }
        return filled(text, shown)

    def as_json(self) -> dict[str, Any]:
        """Return template and values for JSON; values are messages, whole numbers or text. A value without
        a place in the text stays out.
        """
        places = _places(self.template, self.plural)
        values = {
            name: value.as_json() if isinstance(value, Message) else value
            for name, value in self.values.items()
            if name in places
        }
        more = {"plural": self.plural} if self.plural else {}
        return {"template": self.template, **more, "values": values}


def _places(template: str, plural: str) -> set[str]:
    """Return the names of the values that a sentence needs."""
    return set(_PLACE.findall(template) + _PLACE.findall(plural)) | ({"n"} if plural else set())


def _kept(value: object) -> str | int:
    return value if isinstance(value, Message) or type(value) in (int, str) else str(value)  # type: ignore[return-value]


def message(template: str, /, **values: Any) -> Message:
    """Make a message. The template is a literal, so that the texts for translators can be collected."""
    return Message(template, values)


def counted_message(n: int, singular: str, plural: str, /, **values: Any) -> Message:
    """Make a message about a number of things; ``{n}`` is the number: "{n} line", "{n} lines"."""
    return Message(singular, {"n": n, **values}, plural)


def template(text: str) -> str:
    """Mark a template that stands in a table; its message is made with ``Message(text, values)``."""
    return text


def joined(separator: str, parts: Iterable[object]) -> Message:
    """Put messages and texts side by side; each is translated by itself, and so is the separator."""
    kept = [_kept(part) for part in parts]
    if isinstance(separator, Message):
        kept = [piece for part in kept for piece in (separator, part)][1:]
        separator = ""
    if not any(isinstance(part, Message) for part in kept):
        return Message("{text}", {"text": separator.join(map(str, kept))})
    values = {f"part{number}": part for number, part in enumerate(kept)}
    return Message(separator.join(f"{{{name}}}" for name in values), values)


def altered(text: str, change: Callable[[str], str]) -> str:
    """Change the texts in the values of a message, such as paths; a plain text as a whole."""
    if not isinstance(text, Message):
        return change(text)
    values = {
        name: altered(value, change) if isinstance(value, str) else value
        for name, value in text.values.items()
    }
    return Message(text.template, values, text.plural)


def filled(text: str, values: Mapping[str, object]) -> str:
    """Put each value in the place of its ``{name}``. A name without a value stays, also inside a value."""
    return _PLACE.sub(lambda place: str(values.get(place[1], place[0])), text)


def said(value: object, catalogue: Catalogue) -> str:
    """Return the text of a value: of a message in the language of the catalogue, of all else unchanged."""
    if isinstance(value, Message):
        return value.said(catalogue)
    return getattr(catalogue, "old_sentence", str)(value)


def from_json(stored: object) -> Message | None:
    """Read a message as :meth:`Message.as_json` writes it; None for anything else, such as an older text."""
    if not isinstance(stored, Mapping):
        return None
    template, plural, values = stored.get("template"), stored.get("plural", ""), stored.get("values")
    if not isinstance(template, str) or not isinstance(plural, str) or not isinstance(values, Mapping):
        return None
    read = {str(name): from_json(value) or value for name, value in values.items()}
    places = _places(template, plural)
    counts = not plural or type(read.get("n")) is int
    return Message(template, read, plural) if places <= read.keys() and counts else None


def beside(text: str) -> dict[str, Any]:
    """Return what JSON keeps beside the English sentence: template and values; {} for a plain text."""
    return text.as_json() if isinstance(text, Message) else {}


def read_beside(row: Mapping[str, Any], key: str = "message") -> str:
    """Read the sentence of a row with what :func:`beside` keeps; the plain sentence if they do not agree."""
    text = row[key]
    made = from_json(row)
    return made if made is not None and made == text else str(text)


def carried(text: str) -> str | dict[str, Any]:
    """Write a message as JSON values for another process, and a plain text as it is."""
    return text.as_json() if isinstance(text, Message) else text


def from_carried(sent: object) -> str:
    """Read what :func:`carried` wrote."""
    return from_json(sent) or str(sent)
