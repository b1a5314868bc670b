# SPDX-License-Identifier: LGPL-2.1-or-later
"""Texts for people: translated, and made safe to show.

``translate`` has the signature of ``FreeCAD.Qt.translate``, so Qt's tools find the texts; inside FreeCAD it
is that function, elsewhere the text stays as it is. What comes from files and servers passes through
:func:`plain` before it is shown: it may not steer a terminal, a label or a user.
"""

from __future__ import annotations

import unicodedata
from collections import Counter
from collections.abc import Iterable
from typing import TYPE_CHECKING

import silo

if TYPE_CHECKING:
    from silo.bom.errors import Translate

_translate: Translate = lambda _context, text: text  # noqa: E731  (replaced as a whole by `use`)

# Cc control (ANSI escapes begin with one), Cf format (bidirectional overrides), Co private use, Cs halves of
# surrogate pairs, Zl and Zp line ends of other scripts.
_HIDDEN = frozenset(("Cc", "Cf", "Co", "Cs", "Zl", "Zp"))


def use(function: Translate) -> None:
    """Translate with this function from now on."""
    global _translate
    _translate = function


def translate(context: str, text: str, **values: object) -> str:
    """Translate the text into the user's language, and fill in the values (:func:`filled`).

    Write context and text as literals, or Qt's tools do not see them.
    """
    return filled(_translate(context, text), **values)


def filled(text: str, **values: object) -> str:
    """Fill a text in as a message is (:func:`silo.bom.message.filled`)."""
    if not values:
        return text
    from silo.bom import message  # late: FreeCAD's start fills in nothing

    return message.filled(text, values)


def spoken(sentence: object) -> str:
    """Say a finished sentence of silo, such as an error or a finding, in the user's language."""
    # The translation of this text is the code of its language, so both have the same.
    return silo.spoken(str(sentence), translate("Silo", "en"))


def QT_TRANSLATE_NOOP(_context: str, text: str) -> str:  # the name that Qt's tools look for
    """Return the text unchanged; FreeCAD translates it when it shows it."""
    return text


def of_command(name: str, text: str) -> str:
    """Translate a command's text into the user's language."""
    return _translate(name, text)


def plain(text: str, most: int = 200) -> str:
    """Return foreign text as one line of visible characters, cut if it is very long."""
    # Only a little more than can be shown is looked at: a label may be megabytes long.
    head = text[: most * 4]
    shown = " ".join("".join(" " if unicodedata.category(c) in _HIDDEN else c for c in head).split())
    return shown if len(shown) <= most and len(text) <= most * 4 else shown[: most - 1].rstrip() + "…"


def told_apart(paths: Iterable[str]) -> dict[str, str]:
    """Return path → the file's name, with as many folders as are needed if several files have that name."""
    left = {path: path.replace("\\", "/").split("/") for path in paths}
    shown: dict[str, str] = {}
    depth = 0
    while left:
        depth += 1
        tails = {path: "/".join(parts[-depth:]) for path, parts in left.items()}
        times = Counter(tails.values())
        alone = {path: tail for path, tail in tails.items() if times[tail] == 1 or depth >= len(left[path])}
        shown |= alone
        left = {path: parts for path, parts in left.items() if path not in alone}
    return shown


# Longer words get places where a line may end.
_LONG_WORD = 26
_ZERO_WIDTH = "\u200b"


def breakable(text: str) -> str:
    """Add places where long words (paths, names without a blank) can break: after a sign or a small letter.

    Such a place is a character without width; texts without long words stay unchanged.
    """
    return " ".join(word if len(word) <= _LONG_WORD else _broken(word) for word in text.split(" "))


def _broken(word: str) -> str:
    made, run = [], 0
    for number, letter in enumerate(word):
        made.append(letter)
        run += 1
        following = word[number + 1 : number + 2]
        hump = letter.islower() and following.isupper()
        if following and (letter in "/\\_-.:," or hump or run >= _LONG_WORD):
            made.append(_ZERO_WIDTH)
            run = 0
    return "".join(made)


def visible(text: str, most: int = 20_000) -> str:
    """Do what :func:`plain` does for the report view and message boxes, but keep lines and blanks."""
    shown = (c if c == "\n" or unicodedata.category(c) not in _HIDDEN else " " for c in text[:most])
    return "".join(shown) + ("…" if len(text) > most else "")


# A tool tip has the whole of what a cell cuts; no screen has room for more than this.
MOST_TIP = 3000


def tip(text: str) -> str:
    """Write a tool tip as markup. Qt takes a text that looks like markup for markup, so all texts are
    escaped.

    Markup also breaks long lines, which a plain tool tip does not.
    """
    # FreeCAD's start must not pay for its table of names.
    import html

    return f"<qt>{html.escape(plain(text, MOST_TIP), quote=False)}</qt>" if text else ""


def counted(count: int, singular: str, many: str) -> str:
    """Return ``singular`` or ``many``, with ``{n}`` replaced by the count."""
    return filled(singular if count == 1 else many, n=count)


def quantity(value: float | None) -> str:
    """Write a quantity, for people."""
    return "?" if value is None else f"{value:g}"
