# SPDX-License-Identifier: LGPL-2.1-or-later
"""An installed FreeCAD's material cards, read as text (INI up to 0.21, YAML from 1.0).

Read at run time, never copied: the cards carry their own licences (LGPL and CC-BY mixed). Only name, UUID,
inheritance and density are looked at. FreeCAD 1.0's "Default" card has 1 kg/m^3 and "None" has 0: those, and
gases, are no materials here.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

from silo.freecads import material_folders
from silo.inertia.materials.density import parse_density
from silo.inertia.materials.table import Material

MAX_CARD_BYTES = 1_000_000

_NAME = re.compile(r"^\s*Name\s*[:=]\s*[\"']?(.+?)[\"']?\s*$", re.MULTILINE)
_DENSITY = re.compile(r"^\s*Density\s*[:=]\s*[\"']?([^\"'\n]+?)[\"']?\s*$", re.MULTILINE)
_UUID = re.compile(r"UUID\s*[:=]\s*[\"']?([0-9a-fA-F-]{36})")
_INHERITS = re.compile(r"^Inherits:\s*\n(?:\s+.*\n)*?\s+UUID:\s*[\"']?([0-9a-fA-F-]{36})", re.MULTILINE)


@cache
def installed_cards() -> tuple[Material, ...]:
    """Cards of every FreeCAD found on this machine; the first of a name wins."""
    return tuple(read_cards(card_folders()))


def card_folders() -> tuple[Path, ...]:
    """Folders that hold material cards here: FREECAD_MATERIALS first, then the usual places."""
    given = [Path(p) for p in os.environ.get("FREECAD_MATERIALS", "").split(os.pathsep) if p]
    return tuple(folder for folder in (*given, *material_folders()) if folder.is_dir())


def cards_fingerprint() -> str:
    """Changes with every card that is added, removed or edited; for caches of what cards were used for."""
    seen = hashlib.sha256()
    for folder in card_folders():
        for path in sorted(folder.rglob("*.FCMat")):
            try:
                stat = path.stat()
            except OSError:
                continue
            seen.update(f"{path}\0{stat.st_size}\0{stat.st_mtime_ns}\n".encode())
    return seen.hexdigest()


def read_cards(folders: Iterable[Path]) -> list[Material]:
    """All cards with a density below ``folders`` (``.FCMat``, both formats), in path order."""
    texts = [text for folder in folders for text in _texts(folder)]
    by_uuid = {own[1].casefold(): (path, text) for path, text in texts if (own := _own_uuid(text))}
    found: dict[str, Material] = {}
    for path, text in texts:
        density = _density(text, by_uuid, depth=0)
        if density is None:
            continue
        name = _NAME.search(text)
        title = name[1] if name else path.stem
        aliases = {path.stem, path.stem.removesuffix("-Generic"), title.removesuffix(" Generic")} - {title}
        found.setdefault(title, Material(title, density, tuple(sorted(aliases)), f"FreeCAD card {path.name}"))
    return list(found.values())


def _texts(folder: Path) -> Iterator[tuple[Path, str]]:
    for path in sorted(folder.rglob("*.FCMat")):
        try:
            if path.stat().st_size <= MAX_CARD_BYTES:
                yield path, path.read_text("utf-8", errors="replace")
        except OSError:
            continue  # a card that cannot be read is as if it were not installed


def _own_uuid(text: str) -> re.Match[str] | None:
    general = text.partition("Inherits:")[0]
    return _UUID.search(general)


def _density(text: str, by_uuid: dict[str, tuple[Path, str]], depth: int) -> float | None:
    own = _DENSITY.search(text)
    if own is not None:
        return parse_density(own[1])
    parent = _INHERITS.search(text)
    if parent is None or depth > 8:
        return None
    above = by_uuid.get(parent[1].casefold())
    return _density(above[1], by_uuid, depth + 1) if above else None
