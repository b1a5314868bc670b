# SPDX-License-Identifier: LGPL-2.1-or-later
"""Standard parts: objects of the Fasteners workbench, their designation in trade form, and their identity.

An object is recognised by its properties, so with and without that add-on in FreeCAD, and in both spellings
(upper case since its version 0.4, lower case before). What makes the article is part of the designation;
how it is drawn and attached is not. Sources: the add-on's ``FastenersCmd.py`` and ``PEMInserts.py``.

One designation is one article everywhere: its UUID is of version 5, made from the designation in
:data:`NAMESPACE`. No file is stamped for it.
"""

from __future__ import annotations

import re
import uuid
from collections.abc import Iterable, Mapping
from fractions import Fraction
from functools import lru_cache
from typing import Any

from silo.bom.walk.document import derived, own, property_names

# The namespace of standard parts; it never changes, or every screw would become a new item.
NAMESPACE = uuid.UUID("5d8d3a1e-6f0b-5c7a-9a54-2f1d7c0e4b36")

# Replaces the file in the key of a standard part, which only its designation identifies.
STANDARD_PARTS = "standard part:"

_TYPES = ("Part::FeaturePython", "PartDesign::FeaturePython")
# The add-on gives every fastener some of these beside its size.
_TRAITS = ("Thread", "MatchOuter", "Invert", "Offset", "BaseObject", "LeftHanded", "LengthCustom")
_STANDARD = re.compile(r"(ISO|DIN|EN|ASME|ASTM|ANSI|BS|GOST|GB|GN|JIS|NF|SAE|UNI|AS)[ _-]?([A-Z]{0,2}\d.*)")
_NAMES = {
    "4PWTI": "Tee nut 4PWTI",
    "IUTHeatInsert": "IUT heat insert",
    "PCBSpacer": "PCB spacer",
    "PCBStandoff": "PCB standoff",
    "PEMPressNut": "PEM press nut",
    "PEMStandoff": "PEM standoff",
    "PEMStud": "PEM stud",
    "ThreadedRod": "Threaded rod",
    "ThreadedRodInch": "Threaded rod",
}
_RENAMED = {"ISO7380": "ISO7380-1", "DIN1624": "4PWTI"}
_TOOLS = ("ScrewTap", "ScrewDie")
# Objects of the add-on's first years have no type; their class says what they are.
_CLASSES = {
    "FSPcbSpacerObject": "PCBSpacer",
    "FSPcbStandOffObject": "PCBStandoff",
    "FSPressNutObject": "PEMPressNut",
    "FSScrewDieObject": "ScrewDie",
    "FSScrewRodObject": "ScrewTap",
    "FSStandOffObject": "PEMStandoff",
    "FSStudObject": "PEMStud",
    "FSThreadedRodObject": "ThreadedRod",
}
_MODULES = ("FastenersCmd", "PEMInserts")
_SAME_ARTICLE = {"DIN 934": "ISO 4032", "DIN 933": "ISO 4017", "DIN 84": "ISO 1207", "DIN 961": "ISO 8676"}

_MM_PER_INCH = 25.4
_NUMBER = re.compile(r"\d+(?:\.\d+)?")
_INCHES = re.compile(r"(?:(\d+)[ -])?(?:(\d+)/(\d+)|(\d+(?:\.\d+)?)) ?in")


@lru_cache(maxsize=4096)
def standard_uuid(designation: str) -> str:
    """Make the identity of the article with this designation, the same in every project."""
    return str(uuid.uuid5(NAMESPACE, designation))


def is_tool(designated_type: str) -> bool:
    """Return True for taps and dies: they cut threads, and are no parts."""
    return designated_type.startswith(_TOOLS)


def fastener_type(obj: Any) -> str:
    """Return the present name of a fastener's type (``ISO4762``, ``ScrewTap``, …); "" for anything else."""
    if not (derived(obj, _TYPES[0]) or derived(obj, _TYPES[1])):
        return ""
    diameter = _property(obj, "Diameter")
    if not isinstance(diameter, str) or not diameter:
        return ""
    kind = _property(obj, "Type")
    if isinstance(kind, str) and kind:
        if _is_known(kind) or any(_property(obj, name) is not None for name in _TRAITS):
            return _RENAMED.get(kind, kind)
        return ""
    return _type_of_old(obj)


@lru_cache(maxsize=1024)
def _is_known(kind: str) -> bool:
    named = kind in _NAMES or kind in _RENAMED or kind.startswith(_TOOLS)
    return named or _STANDARD.match(kind) is not None


def _type_of_old(obj: Any) -> str:
    """Find the type of an object without a type by its class; without the add-on, by its properties."""
    module, name = _class_of(obj)
    if module in _MODULES and name in _CLASSES:
        return _CLASSES[name]
    if _property(obj, "Invert") is None and _property(obj, "BaseObject") is None:
        return ""
    length = _property(obj, "Length")
    if _property(obj, "Tcode") is not None:
        return "PEMPressNut"
    if _property(obj, "Blind") is not None:
        return "PEMStandoff"
    if _property(obj, "Width") is not None:
        return "PCBStandoff" if _property(obj, "LengthCustom") is not None else "PCBSpacer"
    if isinstance(length, str):
        return "PEMStud"
    return "ThreadedRod" if length is not None else ""


def _class_of(obj: Any) -> tuple[str, str]:
    proxy = own(obj, "Proxy")
    if isinstance(proxy, tuple) and len(proxy) == 2:  # as the FCStd reader has it
        return str(proxy[0]), str(proxy[1])
    kind = type(proxy)
    return kind.__module__, kind.__name__


def designation(obj: Any) -> str:
    """Return the trade name of a fastener, such as "ISO 4762 M4×16"; "" for tools and everything else."""
    kind = fastener_type(obj)
    if not kind or is_tool(kind):
        return ""
    names = property_names(obj)
    known = _MAKING if names is None else [name for name in _MAKING if name in _spelling(names)]
    given = ((name, _property(obj, name)) for name in known)
    return _designated(kind, tuple((name, getattr(value, "Value", value)) for name, value in given))


@lru_cache(maxsize=4096)
def _designated(kind: str, properties: tuple[tuple[str, Any], ...]) -> str:
    return designated(kind, dict(properties))


# The properties that make the article, under their names of today.
_MAKING = (
    *("Diameter", "DiameterCustom", "PitchCustom", "Length", "LengthCustom", "LeftHanded", "Width", "Tcode"),
    *("Blind", "SlotWidth", "ExternalDiam", "KeySize", "NumStarts", "Pitch", "ScrewLength"),
)


def designated(kind: str, properties: Mapping[str, Any]) -> str:
    """Write the designation of a type with these properties (their present names; lengths in mm)."""
    kind = _RENAMED.get(kind, kind)
    inches = kind.startswith("ASME") or kind.endswith("Inch")
    get = properties.get
    diameter = _size(get("Diameter"))
    inches = inches or "in" in diameter or diameter.startswith("#")
    sizes = [diameter]
    if diameter == "Custom":
        sizes = [f"M{_number(get('DiameterCustom'))}" if not inches else _length(get("DiameterCustom"), True)]
        if _is_above(get("PitchCustom")):
            sizes.append(_number(get("PitchCustom")))
    if _is_above(get("Pitch")):
        sizes.append(_number(get("Pitch")))
    sizes.append(_size(get("SlotWidth")))
    length = get("Length")
    sizes.append(_length(get("LengthCustom"), inches) if length == "Custom" else _length(length, inches))
    text = f"{_standard_name(kind)} {'×'.join(size for size in sizes if size)}"
    further = (
        (get("Tcode") is not None, f"-{_size(get('Tcode'))}"),
        (get("Width") is not None, f" SW{_size(get('Width'))}"),
        (_is_above(get("ExternalDiam")), f" ⌀{_number(get('ExternalDiam'))}"),
        (get("KeySize") is not None, f" {_size(get('KeySize'))}"),
        (_is_above(get("ScrewLength")), f" thread {_number(get('ScrewLength'))}"),
        (_is_above(get("NumStarts"), 1), f" {_size(get('NumStarts'))} starts"),
        (get("Blind") is True, " blind"),
        (get("LeftHanded") is True, " LH"),
    )
    return text + "".join(part for given, part in further if given)


def _standard_name(kind: str) -> str:
    if kind in _NAMES:
        return _NAMES[kind]
    match = _STANDARD.match(kind)
    return f"{match[1]} {match[2]}" if match else kind


def _property(obj: Any, name: str) -> Any:
    """Return a property by its present or its old name; None if the object has neither."""
    names = property_names(obj)
    if names is not None:
        spelt = _spelling(names).get(name)
        return getattr(obj, spelt, None) if spelt else None
    value = own(obj, name)
    return own(obj, name[0].lower() + name[1:]) if value is None else value


# Thousands of screws have the same few lists of properties.
@lru_cache(maxsize=1024)
def _spelling(names: frozenset[str] | tuple[str, ...]) -> dict[str, str]:
    """Map the present names of a fastener's properties to the names that an object with these
    properties has.
    """
    listed = frozenset(names)
    spelt = {}
    for name in ("Type", *_MAKING, *_TRAITS):
        if name in listed:
            spelt[name] = name
        elif (old := name[0].lower() + name[1:]) in listed:
            spelt[name] = old
    return spelt


def _size(value: Any) -> str:
    """Write a size: no brackets (which mark sizes that are not preferred), no zeros at the end, inches as
    "in".
    """
    if value is None:
        return ""
    if not isinstance(value, str):
        return _number(value)
    text = " ".join(value.replace("″", "in").replace('"', "in").split())
    if text.startswith("(") and text.endswith(")"):
        text = text[1:-1].strip()
    return _number(float(text)) if _NUMBER.fullmatch(text) else text


def _length(value: Any, inches: bool) -> str:
    """Write a length; for sizes in inches, in inches if it is a fraction of one, otherwise with its unit."""
    text = _size(value)
    if not inches or not text:
        return text
    match = _INCHES.fullmatch(text)
    if match:
        whole, top, bottom, plain = match.groups()
        length = Fraction(plain or 0) + int(whole or 0) + (Fraction(int(top), int(bottom)) if top else 0)
        return _fraction(length)
    if _NUMBER.fullmatch(text):
        length = Fraction(round(float(text) / _MM_PER_INCH * 64), 64)
        exact = abs(float(length) * _MM_PER_INCH - float(text)) < 1e-3
        return _fraction(length) if exact and length else f"{text}mm"
    return text


def _fraction(length: Fraction) -> str:
    whole, rest = divmod(length, 1)
    parts = [str(whole)] if whole or not rest else []
    return " ".join([*parts, str(rest)] if rest else parts) + "in"


def millimetres(value: Any) -> float | None:
    """Return a number as a float; for a FreeCAD quantity, its value in mm. None for anything else."""
    value = getattr(value, "Value", value)
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


def _number(value: Any) -> str:
    number = millimetres(value)
    return "" if number is None else f"{round(number, 4):.4f}".rstrip("0").rstrip(".")


def _is_above(value: Any, least: float = 0) -> bool:
    return (millimetres(value) or 0) > least


def same_articles(designations: Iterable[str]) -> list[tuple[str, str]]:
    """Find pairs of designations for one article under two standards, such as DIN 934 and ISO 4032."""
    unique = set(designations)
    pairs = []
    for old in sorted(unique):
        name, size = _split(old)
        if name in _SAME_ARTICLE and (new := f"{_SAME_ARTICLE[name]} {size}") in unique:
            pairs.append((old, new))
    return pairs


def _split(text: str) -> tuple[str, str]:
    body, number, size = (*text.split(" ", 2), "", "")[:3]
    return f"{body} {number}", size
