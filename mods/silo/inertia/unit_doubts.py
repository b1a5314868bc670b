# SPDX-License-Identifier: LGPL-2.1-or-later
"""A unit of length that was meant and is not in the file: found by what all of its parts say together. Pure.

* Masses of the BOM: if nearly all parts are a thousand times too dense, the lengths are centimetres.
* Screws say in their names how long they are: M8x20 that is 200 mm long was drawn in another unit.

One part is no witness: it may have a wrong row, or a wrong name.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence

from silo.bom.message import Message, message
from silo.inertia.assembly import Prototype
from silo.inertia.geometry.together import Mesh

FACTORS = {
    "centimetres": 10.0,
    "inches": 25.4,
    "metres": 1000.0,
    "millimetres for centimetres": 0.1,
    "millimetres for inches": 1 / 25.4,
    "millimetres for metres": 0.001,
    "inches for centimetres": 2.54,
    "centimetres for inches": 1 / 2.54,
}
"""How many times longer the parts are than the file says, if what was meant is not what is read."""

NAMES = {
    "millimetres": message("millimetres"),
    "centimetres": message("centimetres"),
    "inches": message("inches"),
    "metres": message("metres"),
}

NEAR = 1.25
"""How far, as a factor of length, one witness may be from the unit that the others show."""

USUAL = (600.0, 9000.0)
"""[kg/m^3] of parts whose material is not known."""

_SCREW = re.compile(r"(?<![A-Za-z0-9])M(\d{1,2}(?:[.,]\d)?)\s*[xX×*-]\s*(\d{1,3})(?![\d.,])")


def meant_unit(
    prototypes: Mapping[str, Prototype], masses: Sequence[tuple[float, float, float | None]]
) -> Message | None:
    """Return a warning that names the unit that was probably meant; None if nothing says so.

    masses
        (kg, m³, expected kg/m³ or None) of parts whose mass the BOM gives.
    """
    by_mass = [
        (kg / (volume * density)) ** (1 / 3)
        for kg, volume, density in masses
        if kg > 0 and volume > 0 and density is not None
    ]
    name = _agreed(by_mass)
    if name is not None:
        return _words(name, message("the masses of {count} parts", count=str(len(by_mass))))
    lengths = list(_screw_lengths(prototypes.values()))
    if (name := _agreed(lengths)) is not None:
        return _words(name, message("the names of {count} screws", count=str(len(lengths))))
    return _by_bare_masses([kg / volume for kg, volume, _ in masses if kg > 0 and volume > 0])


def _agreed(factors: Sequence[float]) -> str | None:
    """Return the unit that at least two witnesses, and four of five, agree on; None if they say no other."""
    for name, factor in FACTORS.items():
        agree = sum(1 / NEAR <= value / factor <= NEAR for value in factors)
        if agree >= 2 and agree >= 0.8 * len(factors):
            return name
    return None


def _screw_lengths(prototypes: Iterable[Prototype]) -> Iterable[float]:
    for prototype in prototypes:
        found = _SCREW.search(prototype.name)
        if found is None or not isinstance(prototype.mesh, Mesh):
            continue
        thread, shank = float(found[1].replace(",", ".")) * 1e-3, float(found[2]) * 1e-3
        extent = float(prototype.mesh.extents.max())
        if thread > 0 and shank > 0 and extent > 0:  # a head adds up to one diameter of the thread
            yield (shank + thread / 2) / extent


def _by_bare_masses(densities: Sequence[float]) -> Message | None:
    """Judge by masses of parts of unknown materials: only if none of them can be, and all can in one unit."""
    if len(densities) < 2 or any(USUAL[0] / 8 <= density <= 23_000 for density in densities):
        return None
    middle = math.exp(sum(map(math.log, densities)) / len(densities))
    far = {name: factor for name, factor in FACTORS.items() if not 0.2 < factor < 5}
    fits = [name for name, factor in far.items() if USUAL[0] <= middle / factor**3 <= USUAL[1]]
    if not fits:
        return None
    best = min(fits, key=lambda name: abs(math.log(middle / FACTORS[name] ** 3 / 2700.0)))
    return _words(best, message("the masses of {count} parts", count=str(len(densities))))


def _words(name: str, witness: Message) -> Message:
    meant, _, read = name.partition(" for ")
    if read:
        return message(
            "by {witness}, the file was meant in {meant}, and says {read}: all lengths, volumes and moments "
            "are wrong; export it again with the right unit",
            witness=witness,
            meant=NAMES[meant],
            read=NAMES[read],
        )
    return message(
        "by {witness}, the lengths of the file are {meant}, and were read in a smaller unit: all volumes and "
        "moments are wrong; export it again with the right unit",
        witness=witness,
        meant=NAMES[meant],
    )
