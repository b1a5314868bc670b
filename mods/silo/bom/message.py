# SPDX-License-Identifier: LGPL-2.1-or-later
"""A message: a template and its values, which become a sentence where they are shown.

A message reads as its English sentence, for it is a ``str``: it can be stored, compared and sent. It keeps
its template and its values, so that another language needs no guess about which words are whose:

* the template is the message's code, as gettext has it: ``The file {file} is missing``;
* a value appears unchanged in each language; a value that is a message is translated by its own template;
* a value never fills a place again: ``{name}`` inside a value stays;
* what is made of a message by cutting or adding is a plain ``str``, which is shown as it is: put messages
  together with :func:`message` and :func:`joined`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any, Protocol, Self

_PLACE = re.compile(r"\{(\w+)\}")


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
        kept = MappingProxyType(dict(values or {}))
        english = plural if plural and kept["n"] != 1 else template
        made = super().__new__(cls, _PLACE.sub(lambda place: str(kept[place[1]]), english))
        made.template, made.plural, made.values = template, plural, kept
        return made

    def __reduce__(self) -> tuple[type[Message], tuple[str, dict[str, Any], str]]:
        """Travel to another process whole."""
        return type(self), (self.template, dict(self.values), self.plural)

    def said(self, catalogue: Catalogue) -> str:
        """Return the sentence in the language of the catalogue."""
        if self.plural:
            text = catalogue.ngettext(self.template, self.plural, self.values["n"])
        else:
            text = catalogue.gettext(self.template) if self.template else ""
        return filled(text, {name: said(value, catalogue) for name, value in self.values.items()})

    def as_json(self) -> dict[str, Any]:
        """Return template and values for JSON; values are messages, whole numbers or text."""
        values = {
            name: value.as_json()
            if isinstance(value, Message)
            else value
            if type(value) in (int, str)
            else str(value)
            for name, value in self.values.items()
        }
        more = {"plural": self.plural} if self.plural else {}
        return {"template": self.template, **more, "values": values}


def message(template: str, /, **values: Any) -> Message:
    """Make a message. The template is a literal, so that the texts for translators can be collected."""
    return Message(template, values)


def counted_message(n: int, singular: str, plural: str, /, **values: Any) -> Message:
    """Make a message about a number of things; ``{n}`` is the number: "{n} line", "{n} lines"."""
    return Message(singular, {"n": n, **values}, plural)


def joined(separator: str, parts: Iterable[object]) -> Message:
    """Put messages and texts side by side; each is translated by itself."""
    values = {f"part{number}": part for number, part in enumerate(parts)}
    return Message(separator.join(f"{{{name}}}" for name in values), values)


def filled(text: str, values: Mapping[str, object]) -> str:
    """Put each value in the place of its ``{name}``. A name without a value stays, also inside a value."""
    return _PLACE.sub(lambda place: str(values.get(place[1], place[0])), text)


def said(value: object, catalogue: Catalogue) -> str:
    """Return the text of a value: of a message in the language of the catalogue, of all else unchanged."""
    return value.said(catalogue) if isinstance(value, Message) else str(value)


def from_json(stored: object) -> Message | None:
    """Read a message as :meth:`Message.as_json` writes it; None for anything else, such as an older text."""
    if not isinstance(stored, Mapping):
        return None
    template, plural, values = stored.get("template"), stored.get("plural", ""), stored.get("values")
    if not isinstance(template, str) or not isinstance(plural, str) or not isinstance(values, Mapping):
        return None
    read = {str(name): from_json(value) or value for name, value in values.items()}
    places = set(_PLACE.findall(template) + _PLACE.findall(plural)) | ({"n"} if plural else set())
    return Message(template, read, plural) if places <= read.keys() else None
