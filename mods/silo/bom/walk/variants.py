# SPDX-License-Identifier: LGPL-2.1-or-later
"""Configured copies: what differs from the original, in words, and which copy stands for all equal ones.

A copy-on-change link has the values that it changed as properties of its own. Equal values make equal
variants, however many copies FreeCAD made.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from silo.bom.key import Key
from silo.bom.walk.document import own

# What each link and each object has besides the values of its configuration.
_USUAL = frozenset(
    {
        *("ElementCount", "ElementList", "ExpressionEngine", "Label", "Label2", "LinkClaimChild"),
        *("LinkCopyOnChange", "LinkCopyOnChangeGroup", "LinkCopyOnChangeSource", "LinkCopyOnChangeTouched"),
        *("LinkExecute", "LinkPlacement", "LinkTransform", "LinkedObject", "Placement", "PlacementList"),
        *("Scale", "ScaleList", "ScaleVector", "ShowElement", "SiloBomExclude", "SiloItemId", "SiloUUID"),
        *("Suppressed", "Type", "Visibility", "VisibilityList", "AttachedBy", "AttachedTo"),
        *("AttachmentOffset", "SolverId", "AssemblyType"),
    }
)
_UNITS = {
    "App::PropertyLength": "mm",
    "App::PropertyDistance": "mm",
    "App::PropertyAngle": "°",
    "App::PropertyArea": "mm²",
    "App::PropertyVolume": "mm³",
}
_LONGEST = 60


@dataclass(frozen=True, slots=True)
class Variant:
    """A configured copy that stands for all with its values.

    copy
        the object that is shown, in the document of the link.
    link
        the first link that shows it.
    values
        "L = 300 mm, N = 5".
    base
        the original, and ``base_key`` what identifies it.
    """

    copy: Any
    link: Any
    values: str
    base: Any
    base_key: Key

    @property
    def key(self) -> Key:
        """Return what identifies the variant: its original, and the values."""
        return variant_key(self.base_key, self.values)


def variant_key(base: Key, values: str) -> Key:
    """Return the key of the variant of a component with these values; no FreeCAD name holds a ``?``."""
    return (base[0], f"{base[1]}?{values}")


def values_in(key: Key) -> str:
    """Return the values in the key of a variant; "" for any other key."""
    return key[1].partition("?")[2]


def values_of(link: Any, base: Any) -> str:
    """Return the values with which a link shows something other than its original; "" if all are equal."""
    mine, theirs = (getattr(obj, "PropertiesList", None) or () for obj in (link, base))
    changed = []
    for name in sorted(set(mine) & set(theirs) - _USUAL):
        value, original = (_plain(own(obj, name)) for obj in (link, base))
        if value is not None and value != original:
            changed.append(f"{name} = {_text(value)}{_unit(link, name)}")
    return ", ".join(changed)


def _plain(value: Any) -> Any:
    value = getattr(value, "Value", value)  # of a quantity, in FreeCAD's own unit
    return value if isinstance(value, bool | int | float | str) else None


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    text = str(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"


def _unit(link: Any, name: str) -> str:
    ask = getattr(link, "getTypeIdOfProperty", None)
    unit = _UNITS.get(ask(name), "") if callable(ask) else ""
    return f" {unit}" if unit else ""
