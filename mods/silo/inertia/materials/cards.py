# SPDX-License-Identifier: LGPL-2.1-or-later
"""The material cards of an installed FreeCAD: INI files up to 0.21, YAML from 1.0.

They are read at run time and never copied: they carry their own licences (LGPL and CC-BY mixed). Only name,
UUID, inheritance and density are read. FreeCAD 1.0's "Default" card has 1 kg/m^3 and "None" has 0: those, and
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

from silo.bom.message import message
from silo.freecads.places import material_folders
from silo.inertia.materials.densities import parse_density
from silo.inertia.materials.material import Material

MAX_CARD_BYTES = 1_000_000

_CARD_NAME = re.compile(r"^[ \t]*+Name[ \t]*+[:=][ \t]*+(.+)$", re.MULTILINE)

_CARD_DENSITY = re.compile(r"^[ \t]*+Density[ \t]*+[:=][ \t]*+(.+)$", re.MULTILINE)

_UUID = re.compile(r"UUID\s*[:=]\s*[\"']?([0-9a-fA-F-]{36})")

_INHERITS = re.compile(
    r"^Inherits:[ \t\r]*+\n(?:(?:[ \t][^\n]*)?\n)*?[ \t]++UUID:[ \t]*+[\"']?([0-9a-fA-F-]{36})", re.MULTILINE
)


@dataclass(frozen=True)
class Card:
    """One card: its name (if it has one), density [kg/m^3] (its own or inherited), id and file."""

    name: str | None
    density: float | None
    uuid: str
    path: Path


@cache
def all_cards() -> tuple[Card, ...]:
    """Read the cards of every FreeCAD on this machine, in the order of :func:`card_folders`."""
    return tuple(cards_in(card_folders()))


@cache
def installed_cards() -> tuple[Material, ...]:
    """Return the materials of all cards with a density; of equal names the first wins."""
    return tuple(materials_of(all_cards()))


@cache
def card_of(uuid: str) -> Card | None:
    """Return the first card with this id; None if there is none."""
    return next((card for card in all_cards() if card.uuid == uuid.casefold()), None)


def card_folders() -> tuple[Path, ...]:
    """Return the folders with material cards on this machine: FREECAD_MATERIALS first, then the usual
    places.
    """
    given = [Path(p) for p in os.environ.get("FREECAD_MATERIALS", "").split(os.pathsep) if p]
    return tuple(folder for folder in (*given, *material_folders()) if folder.is_dir())


def cards_fingerprint() -> str:
    """Return a text that changes whenever a card is added, removed or edited. Caches keep it."""
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
    """Make a material of each card with a density, by its name and its file name; of equal names the first
    wins.
    """
    materials: dict[str, Material] = {}
    for card in cards:
        if card.density is not None:
            stem = card.path.stem
            title = card.name or stem
            aliases = {stem, stem.removesuffix("-Generic"), title.removesuffix(" Generic")} - {title}
            source = message("FreeCAD card {name}", name=card.path.name)
            made = Material(title, card.density, tuple(sorted(aliases)), source, card=card.path.name)
            materials.setdefault(title, made)
    return list(materials.values())


def cards_in(folders: Iterable[Path]) -> list[Card]:
    """Read all cards below ``folders`` (``.FCMat``, both formats), in path order."""
    texts = [(path, text, _own_uuid(text)) for folder in folders for path, text in _texts(folder)]
    by_uuid: dict[str, str] = {}
    for _, text, uuid in texts:
        by_uuid.setdefault(uuid, text)
    return [
        Card(
            _unquoted(name[1]) if (name := _CARD_NAME.search(text)) else None,
            _card_density(text, by_uuid, 0),
            uuid,
            path,
        )
        for path, text, uuid in texts
    ]


def _unquoted(value: str) -> str:
    return value.strip().removeprefix('"').removeprefix("'").removesuffix('"').removesuffix("'")


def _texts(folder: Path) -> Iterator[tuple[Path, str]]:
    for path in sorted(folder.rglob("*.FCMat")):
        try:
            if path.stat().st_size <= MAX_CARD_BYTES:
                yield path, path.read_text("utf-8", errors="replace")
        except OSError:
            continue  # a card that cannot be read is as if it were not installed


def _own_uuid(text: str) -> str:
    match = _UUID.search(text.partition("Inherits:")[0])
    return match[1].casefold() if match else ""


def _card_density(text: str, by_uuid: Mapping[str, str], depth: int) -> float | None:
    own = _CARD_DENSITY.search(text)
    if own is not None:
        return parse_density(_unquoted(own[1]))
    parent = _INHERITS.search(text)
    above = by_uuid.get(parent[1].casefold()) if parent is not None and depth < 8 else None
    return _card_density(above, by_uuid, depth + 1) if above is not None else None
