# SPDX-License-Identifier: LGPL-2.1-or-later
"""What an FCStd file says of an object's material.

Two ways: FreeCAD >= 1.0 gives each shape a ``ShapeMaterial``, of which the file holds the id only, so that
the density is in the cards of an installed FreeCAD; and any version may link a material object
(``Material``), which carries name and density itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from silo.bom.document import own
from silo.inertia.materials import DENSEST, LIGHTEST, card_of, parse_density

NO_MATERIAL = "7f9fd73b-50c9-41d8-b7b2-575a030c1eeb"
"""FreeCAD's "Default": what every untouched part has. Its 1 kg/m^3 is nobody's density."""


@dataclass(frozen=True)
class Material:
    """Name and density [kg/m^3] as far as they are known; ``problem`` says what is not."""

    name: str | None = None
    density: float | None = None
    problem: str = ""


NOTHING = Material()


def linked_material(obj: Any) -> Material | None:
    """Return the material object that is linked to an object, stored or live; None if there is none."""
    linked = own(obj, "Material")
    linked = linked[0] if isinstance(linked, tuple) and linked else linked
    told = own(linked, "Material") if linked is not None and not isinstance(linked, dict) else None
    return _from_map(told) if isinstance(told, dict) and told else None


def told_material(name: str, density: float | None) -> Material:
    """Return a material by name and density [kg/m^3], of which only a sane one counts."""
    sane = _sane(density)
    if sane is None:
        return Material(name, problem=f"its material '{name}' has no density that can be used")
    return Material(name, sane)


def _from_map(told: dict[str, str]) -> Material:
    name = next((told[key].strip() for key in ("Name", "CardName") if told.get(key, "").strip()), None)
    text = told.get("Density", "").strip()
    if not text:
        return Material(name)
    density = _sane(parse_density(text))
    problem = "" if density is not None else f"the density '{text}' of its material cannot be used"
    return Material(name, density, problem)


def card_material(uuid: str) -> Material:
    """Return the material of a card in an installed FreeCAD, or what is wrong with it."""
    if uuid == NO_MATERIAL:
        return NOTHING
    card = card_of(uuid)
    if card is None:
        return Material(
            problem=f"its material (id {uuid}) is in no material library found on this machine; install "
            "FreeCAD, or name the folder of its cards in FREECAD_MATERIALS"
        )
    if card.density is None:
        return Material(card.name, problem=f"the card of its material '{card.name}' has no usable density")
    return Material(card.name, card.density)


def _sane(density: float | None) -> float | None:
    return density if density is not None and LIGHTEST <= density <= DENSEST else None
