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
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
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


@dataclass(frozen=True)
class Card:
    """One card: its name (where it has one), density [kg/m^3] (its own or inherited), id and file."""

    name: str | None
    density: float | None
    uuid: str
    path: Path


@cache
def all_cards() -> tuple[Card, ...]:
    """Cards of every FreeCAD found on this machine, in the order of :func:`card_folders`."""
    return tuple(cards_in(card_folders()))


@cache
def installed_cards() -> tuple[Material, ...]:
    """Those with a density; the first of a name wins."""
    return tuple(materials_of(all_cards()))


@cache
def card_of(uuid: str) -> Card | None:
    """The card with this id, None where there is none; the first one wins."""
    return next((card for card in all_cards() if card.uuid == uuid.casefold()), None)


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


def materials_of(cards: Iterable[Card]) -> list[Material]:
    """All cards with a density, by name and by file name, in order; the first of a name wins."""
    found: dict[str, Material] = {}
    for card in cards:
        if card.density is not None:
            stem = card.path.stem
            title = card.name or stem
            aliases = {stem, stem.removesuffix("-Generic"), title.removesuffix(" Generic")} - {title}
            source = f"FreeCAD card {card.path.name}"
            found.setdefault(title, Material(title, card.density, tuple(sorted(aliases)), source))
    return list(found.values())


def cards_in(folders: Iterable[Path]) -> list[Card]:
    """All cards below ``folders`` (``.FCMat``, both formats), in path order."""
    texts = [(path, text, _own_uuid(text)) for folder in folders for path, text in _texts(folder)]
    by_uuid: dict[str, str] = {}
    for _, text, uuid in texts:
        by_uuid.setdefault(uuid, text)
    return [
        Card(name[1] if (name := _NAME.search(text)) else None, _density(text, by_uuid, 0), uuid, path)
        for path, text, uuid in texts
    ]


def _texts(folder: Path) -> Iterator[tuple[Path, str]]:
    for path in sorted(folder.rglob("*.FCMat")):
        try:
            if path.stat().st_size <= MAX_CARD_BYTES:
                yield path, path.read_text("utf-8", errors="replace")
        except OSError:
            continue  # a card that cannot be read is as if it were not installed


def _own_uuid(text: str) -> str:
    found = _UUID.search(text.partition("Inherits:")[0])
    return found[1].casefold() if found else ""


def _density(text: str, by_uuid: Mapping[str, str], depth: int) -> float | None:
    own = _DENSITY.search(text)
    if own is not None:
        return parse_density(own[1])
    parent = _INHERITS.search(text)
    above = by_uuid.get(parent[1].casefold()) if parent is not None and depth < 8 else None
    return _density(above, by_uuid, depth + 1) if above is not None else None
