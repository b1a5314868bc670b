# SPDX-License-Identifier: LGPL-2.1-or-later

from __future__ import annotations

import os
import re
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gettext import NullTranslations

# What the add-on needs inside FreeCAD: import name → package. package.xml declares the same.
FREECAD_PACKAGES = {"requests": "requests>=2.31", "pydantic": "pydantic>=2.10"}
# What the add-on works without: live events need it.
OPTIONAL_PACKAGES = {"sseclient": "sseclient-py>=1.8"}


def spoken(text: str, language: str = "") -> str:
    """Show a message (:class:`silo.bom.message.Message`) in a language (default: that of the environment).

    Its values, and a text that is no message, stay as they are.
    """
    found = _language(language)
    if not found:
        return text
    from silo.bom.message import Message, said  # an English start does not pay for the catalogue

    if isinstance(text, Message):
        return said(text, _catalogue(found))
    # A sentence that is no message yet is still known by its pattern.
    old_sentence = _catalogue(found).old_sentence  # type: ignore[attr-defined]
    return str(old_sentence(text, True))


def caption(text: str, language: str = "") -> str:
    """Show a text of ours that has no values, such as a heading, a help or a prompt, in a language."""
    found = _language(language)
    return _catalogue(found).gettext(text) if found and text else text


def _language(chosen: str) -> str:
    """Return the code of the language, "" for English.

    LANGUAGE counts as gettext has it: before the locale, but not beside a locale that is C.
    """
    if not (wanted := chosen or os.environ.get("SILO_LANGUAGE", "")):
        names = ("LC_ALL", "LC_MESSAGES", "LANG")
        locale = next(filter(None, map(os.environ.get, names)), "")
        preferred = os.environ.get("LANGUAGE", "") if locale not in ("C", "POSIX") else ""
        wanted = preferred.partition(":")[0] or locale or "en"
    return "" if wanted.startswith(("en", "C")) else re.split("[_.@-]", wanted)[0]


@cache
def _catalogue(language: str) -> NullTranslations:
    import gettext

    from silo.bom.errors import Sentences

    found = gettext.translation("silo-mod", Path(__file__).parent / "locale", [language], fallback=True)
    texts = {text: done for text, done in getattr(found, "_catalog", {}).items() if isinstance(text, str)}
    sentences = Sentences(texts)
    found.old_sentence = lambda value, whole=False: sentences(str(value), whole)  # type: ignore[attr-defined]
    return found
