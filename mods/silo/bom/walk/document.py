# SPDX-License-Identifier: LGPL-2.1-or-later
"""The small part of FreeCAD's document model that the walker touches, under FreeCAD's own names.

Live FreeCAD objects, objects read from an FCStd file (:mod:`silo.fcstd`) and the tests' fakes all have this
shape. Only what the spec's listing touches is required; every other attribute may be absent and then counts
as unset. Paths and sub-names are read here too, as text: no file is looked at. Two traps of the live objects
shape the helpers below (measured, FreeCAD 0.20 to 1.1):

* attributes of a link are forwarded to its target, so ``hasattr(link, "Group")`` says nothing about the link;
  ``own()`` asks ``PropertiesList`` first where the object has one;
* a type is asked with ``isDerivedFrom``, which is not forwarded and is False for unknown names.
"""

from __future__ import annotations

import os.path
import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from types import ModuleType
from typing import Any, Protocol, runtime_checkable

from silo.bom.errors import DocumentError
from silo.bom.findings import FindingCode
from silo.bom.message import message


@runtime_checkable
class DocumentLike(Protocol):
    """A FreeCAD document. ``FileName`` is an absolute path, "" while unsaved.

    Optional: ``Label``, ``Name``, ``Objects`` (all objects, in document order), ``Meta`` (str → str),
    ``getPropertyByName(name)`` (AttributeError where there is no such property), ``getObject(name)``.
    """

    @property
    def FileName(self) -> str: ...


@runtime_checkable
class ObjectLike(Protocol):
    """A FreeCAD document object.

    Optional: ``Name``, ``Label``, ``TypeId``, ``PropertiesList``, ``Group``, ``LinkedObject`` (an object,
    None, or a tuple ``(object, sub_name)``), ``ElementCount``, ``ElementList``, ``Visibility``,
    ``ScaleVector``, ``ScaleList``, ``LinkCopyOnChangeSource``, ``Suppressed``, ``SiloBomExclude``,
    ``SiloFindNumber``, ``SiloItemId``, ``SiloUUID``, ``LinkProblem`` (ours, below), and for Draft arrays
    ``Base`` and ``Count``.
    ``own_property(name, default)`` answers :func:`own` where an object knows its own properties at once.
    """

    @property
    def Document(self) -> DocumentLike: ...

    def isDerivedFrom(self, type_name: str, /) -> bool: ...


class DocumentRoot:
    """The document itself as a container, for links that lie in no assembly and no part; or as a place."""

    is_document_root = True

    def __init__(self, document: Any, group: Sequence[Any] = ()) -> None:
        self.Document = document
        self.Name = ""
        self.Label = getattr(document, "Label", "") or getattr(document, "FileName", "")
        self.Group = tuple(group)

    def isDerivedFrom(self, _type_name: str, /) -> bool:
        return False


def saved_by(program: str | None) -> tuple[int, ...]:
    """Return the version of FreeCAD in a file's ``ProgramVersion``, such as (1, 0); () if it has none.

    The numbers of realthunder's branch are dates (2022.111), not versions of FreeCAD.
    """
    match = re.match(r"(\d{1,3})\.(\d+)", program or "")
    return tuple(map(int, match.groups())) if match else ()


def derived(obj: Any, type_name: str) -> bool:
    """Return True if ``obj`` says that its type is ``type_name``, or is derived from it."""
    try:
        return bool(obj.isDerivedFrom(type_name))
    except (AttributeError, TypeError):  # a plain object that says nothing of its type
        return False


def own(obj: object, name: str, default: Any = None) -> Any:
    """Return the object's own property ``name``, never that of a link's target."""
    if (ask := getattr(type(obj), "own_property", None)) is not None:
        return ask(obj, name, default)
    value = getattr(obj, name, default)
    # Most optional properties are unset on most objects; only a value that matters is worth asking the
    # list of the object's own properties, which takes much longer.
    if not value or value is default:
        return value
    names: Sequence[str] | None = getattr(obj, "PropertiesList", None)
    return value if names is None or name in names else default


def property_names(obj: object) -> frozenset[str] | tuple[str, ...] | None:
    """Return the names of the object's own properties, usable as a key; None if it does not list them."""
    names: Sequence[str] | frozenset[str] | None = getattr(obj, "PropertiesList", None)
    return names if names is None or isinstance(names, tuple | frozenset) else tuple(names)


def first_of(linked: Any) -> Any:
    """Return the object of a ``LinkedObject``, which is a tuple (object, sub-name) if the link has a
    sub-name.
    """
    return linked[0] if isinstance(linked, tuple) else linked


def same_document(a: object, b: object) -> bool:
    """Return True if both are one document: the same object, or two objects of one file."""
    # Not by ==, which never ends for plain objects that hold each other; FreeCAD has one object per document.
    if a is b:
        return True
    path = getattr(a, "FileName", "")
    return bool(path) and bool(path == getattr(b, "FileName", ""))


# No name in FreeCAD holds a dash.
NAMELESS = "object-"


def object_name(obj: object) -> str:
    """Return the object's ``Name``; if it has none, a text that is unique to it."""
    name = getattr(obj, "Name", None)
    if isinstance(name, str) and (name or getattr(obj, "is_document_root", False)):
        return name
    return f"{NAMELESS}{id(obj):x}"


# A damaged or hostile file may hold megabytes; no more than this is read.
_LONGEST_LABEL = 300


def label_of(obj: object) -> str:
    """Return the object's ``Label``, for people only; its ``Name`` if it has no label that can be read."""
    for name in ("Label", "Name"):
        try:
            text = getattr(obj, name, None)
        except DocumentError:  # a message about a damaged object must not fail for its label
            continue
        if isinstance(text, str) and text:
            return text if len(text) <= _LONGEST_LABEL else f"{text[:_LONGEST_LABEL]}…"
    return message("an unnamed object")


def document_property(doc: object, name: str) -> Any:
    """Return a property of the document; None if there is none (FreeCAD 0.20 has no such properties at
    all).
    """
    ask = getattr(doc, "getPropertyByName", None)
    if callable(ask):
        try:
            return ask(name)
        except (AttributeError, KeyError):
            return None
    return getattr(doc, name, None)


@dataclass(frozen=True, slots=True)
class LinkProblem:
    """Why a link has no target, or only a changed copy of one that is lost.

    ``file`` and ``obj`` stand as the link records them ("" where unknown).
    A relative ``file`` is relative to the folder of the document that holds the link, as FreeCAD writes it;
    an empty one is that document itself.

    A reader that knows more than ``LinkedObject is None`` puts this on its link objects as ``LinkProblem``
    (:mod:`silo.fcstd` does); for live objects the walker is given a function that finds it out.
    ``code`` UNSET_LINK means that the link never had a target.
    """

    code: FindingCode
    file: str = ""
    obj: str = ""
    detail: str = ""


# FreeCAD's names of geometry; ";" and "?" begin mapped and missing names (src/App/ElementNamingUtils.h).
_ELEMENT = re.compile(r"(?:Face|Edge|Vertex|Wire|Shell|Solid|CompSolid|Compound)\d+")
_MAPPED = (";", "?")

_ABSOLUTE = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+://|[A-Za-z]:[\\/]|\\\\|//")


def located(recorded: str, owner: str) -> str:
    """Return in full the path that a link records relative to its owner's folder; one spelling per file.

    Complete paths (absolute ones, ``https://…``) and those of unsaved documents stay unchanged.
    """
    if _ABSOLUTE.match(recorded) or not owner:
        return recorded
    return os.path.normpath(os.path.join(os.path.dirname(owner), recorded))


def relative(path: str, base: str, rules: ModuleType = os.path) -> str:
    """Return ``path`` as seen from the folder ``base``, with ``/``; the whole path if it is on another
    Windows drive.

    ``rules``: ``ntpath`` or ``posixpath``, whatever the platform.
    """
    if not path or not base:
        return path
    with suppress(ValueError):  # there is no way from one drive to another
        path = rules.relpath(path, base)
    return path.replace(rules.sep, "/")


def is_element_name(name: str) -> bool:
    """Return True for geometry (``Face1``), False for a name that an object may have."""
    return bool(_ELEMENT.fullmatch(name)) or name.startswith(_MAPPED)


def split_sub_name(sub: Any) -> tuple[list[str], str]:
    """Split a sub-name into the objects that it passes through and the geometry at its end ("": the whole
    object).

    Object names end in a dot, geometry names do not: ``"Sub.Bolt."``, ``"Inner.Face1"``. Only the first of
    several sub-names counts: FreeCAD links only one object, so all of them lead to it in the same way.
    """
    first = sub if isinstance(sub, str) else next((str(part) for part in sub or ()), "")
    parts = first.split(".")
    for position, part in enumerate(parts):
        if part.startswith(_MAPPED):  # mapped names have dots of their own
            return [step for step in parts[:position] if step], ".".join(parts[position:])
    *steps, last = parts
    return [step for step in steps if step], last
