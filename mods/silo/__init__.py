# SPDX-License-Identifier: LGPL-2.1-or-later

from __future__ import annotations

import os
import re
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from silo.bom.errors import Sentences

# What the add-on needs inside FreeCAD: import name → package. package.xml declares the same.
FREECAD_PACKAGES = {"requests": "requests>=2.31", "pydantic": "pydantic>=2.10"}
# What the add-on works without: live events need it.
OPTIONAL_PACKAGES = {"sseclient": "sseclient-py>=1.8"}


def spoken(text: str, language: str = "") -> str:
    """Translate a finished English text of ours into a language (default: that of the environment)."""
    if not language:
        names = ("SILO_LANGUAGE", "LC_ALL", "LC_MESSAGES", "LANG")
        language = next(filter(None, map(os.environ.get, names)), "en")
    return text if language.startswith(("en", "C")) else _sentences(re.split("[_.@-]", language)[0])(text)


@cache
def _sentences(language: str) -> Sentences:
    import gettext  # an English start does not pay for it

    from silo.bom.errors import Sentences

    folder = Path(__file__).parent / "locale"
    found = gettext.translation("silo-mod", folder, [language], fallback=True)
    return Sentences(getattr(found, "_catalog", {}))  # texts cannot be listed in another way
