# SPDX-License-Identifier: LGPL-2.1-or-later
"""A material with its density, and the two answers to a material's text: understood, or not."""

from __future__ import annotations

from dataclasses import dataclass

from silo.bom.message import message


@dataclass(frozen=True)
class Material:
    """One material.

    density
        [kg/m^3] at room temperature; it varies by ± ``spread`` of itself between kinds of the material.
    family
        the more general row, or "".
    card
        the file of the FreeCAD card that it is from, so that it is known on this machine alone; else "".
    """

    name: str
    density: float
    aliases: tuple[str, ...] = ()
    source: str = ""
    family: str = ""
    spread: float = 0.0
    card: str = ""


@dataclass(frozen=True)
class MaterialHit:
    """A material text that was understood; ``doubt`` says why it may mean another material, or is empty."""

    material: Material
    doubt: str = ""


@dataclass(frozen=True)
class MaterialMiss:
    """A material text that was not understood, and why, in words that end a sentence.

    nearest
        the material that it may mean, for a user to decide; None if nothing is near.
    """

    reason: str
    nearest: Material | None = None

    @property
    def advice(self) -> str:
        """Return the reason, with the nearest material if there is one."""
        if self.nearest is None:
            return self.reason
        return message(
            "{reason} (the nearest is {name}, {density} kg/m³)",
            reason=self.reason,
            name=self.nearest.name,
            density=f"{self.nearest.density:g}",
        )
