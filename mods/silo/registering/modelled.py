# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is modelled in an assembly's own file and can be declared a component there.

Nothing here counts: an identity on the object does, and a person gives it. The rules of this module:

* an inline part that holds geometry and no component is offered as a whole, not piece by piece;
* equal copies are proposed as one article: the same shape, or the same label but for FreeCAD's number;
* what another feature consumes is no part.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Sequence, Set
from dataclasses import dataclass, replace
from typing import Any

from silo.bom.document import label_of, located, object_name, own
from silo.bom.errors import DocumentError, InputError, SiloError
from silo.bom.identity import document_identity, own_identity
from silo.bom.model import BomEntry
from silo.bom.naming import is_generic
from silo.bom.roots import choose_assembly, silent_reader
from silo.bom.walk.consumed import consumed
from silo.bom.walk.kinds import Kind, flattened
from silo.fcstd import Library
from silo.fcstd.objects import FcstdObject

# FreeCAD numbers copies with three digits.
_NUMBER = re.compile(r"\d{3}$")


@dataclass(frozen=True)
class Modelled:
    """One article that is modelled in the file.

    entry
        its first object, as a BOM entry; ``quantity`` is what the BOM would count of all its objects.
    objects
        names of the objects that are equal, the first one first.
    alike
        why they are taken for equal: "shape" or "label"; "" for a single one.
    source
        the file that A2plus imported it from.
    """

    entry: BomEntry
    objects: tuple[str, ...]
    alike: str = ""
    source: str = ""

    @property
    def declared(self) -> bool:
        """True where it is a component already."""
        return self.entry.silo_uuid is not None

    def apart(self) -> tuple[Modelled, ...]:
        """Each object as an article of its own; the quantity of each is not known then."""
        return tuple(
            replace(
                self, entry=replace(self.entry, object_name=name, label=name, quantity=1), objects=(name,)
            )
            for name in self.objects
        )


def modelled(path: str, assembly: str | None = None) -> list[Modelled]:
    """What is modelled in the file of an assembly, read without FreeCAD. DocumentError, InputError."""
    with Library() as library:
        return modelled_in(choose_assembly(library.open(path), assembly), _shape_of)


def _shape_of(obj: object) -> str:
    try:
        return obj.shape_key() if isinstance(obj, FcstdObject) else ""
    except DocumentError:  # damaged: nothing is known of it
        return ""


def chosen(articles: Sequence[Modelled], names: Iterable[str], *, apart: bool = False) -> list[Modelled]:
    """The articles that these names (or labels) mean, each once. InputError for a name that means none."""
    found: dict[tuple[str, ...], Modelled] = {}
    for name in names:
        fitting = [one for one in articles if name in one.objects] or [
            one for one in articles if name == one.entry.label
        ]
        if len(fitting) != 1:
            known = ", ".join(one.entry.object_name for one in articles) or "nothing"
            what = "nothing" if not fitting else f"{len(fitting)} things"
            raise InputError(f"{name!r} means {what} that is modelled in this file; there is: {known}")
        for one in fitting[0].apart() if apart else fitting:
            found[one.objects] = one
    return list(found.values())


def source_identity(article: Modelled) -> str | None:
    """The identity of the file that A2plus imported an article from; None where there is none to be read."""
    if not article.source or not os.path.isfile(article.source):
        return None
    try:
        with Library() as library:
            return document_identity(library.open(article.source))
    except SiloError:
        return None


def modelled_in(top: Any, shape_of: Callable[[Any], str]) -> list[Modelled]:
    """The articles modelled in the file of an assembly (or of a single part), those declared already last.

    shape_of
        something equal for equal shapes wherever they are placed; "" where that is not known.
    """
    document = top.Document
    found = _offered(top)
    counts = _counts(top, found)
    articles = []
    for objects, alike in _alike(found, shape_of):
        articles.append(_article(objects, alike, sum(counts[object_name(obj)] for obj in objects)))
    reader = silent_reader()
    declared: dict[str, tuple[list[Any], int]] = {}
    for count in reader.contents(top).counts:
        target = count.target
        if getattr(target, "Document", None) is document and (identity := own_identity(target)):
            objects, before = declared.get(identity, ([], 0))
            objects += [] if target in objects else [target]
            declared[identity] = (objects, before + count.quantity)
    for identity, (objects, quantity) in declared.items():
        article = _article(objects, "", quantity)
        articles.append(replace(article, entry=replace(article.entry, silo_uuid=identity)))
    return articles


def _offered(top: Any) -> list[Any]:
    """What could be declared, in the order of the tree."""
    reader = silent_reader()
    local = {object_name(obj): obj for obj in reader.contents(top).local}
    eaten = consumed(local.values(), object_name)
    members = [(obj, kind) for _, obj, kind in flattened(top, object_name)]
    inside: set[str] = set()
    found = []
    for obj, kind in members:
        name = object_name(obj)
        if name in inside:
            continue
        if kind is Kind.CONTAINER and not reader.brings(obj):
            held = [one for _, one, _ in flattened(obj, object_name)]
            if any(object_name(one) in local for one in held):
                inside.update(map(object_name, held))
                found.append(obj)
        elif (name in local and name not in eaten) or (kind is Kind.FOREIGN and not own_identity(obj)):
            found.append(obj)
    return found


def _counts(top: Any, offered: Sequence[Any]) -> dict[str, int]:
    """How often the BOM would count each, were it declared: links and arrays in the file included."""
    names = {object_name(obj) for obj in offered}
    reader = silent_reader(declare=names)
    counts = dict.fromkeys(names, 0)
    for count in reader.contents(top).counts:
        name = object_name(count.target)
        if name in counts and getattr(count.target, "Document", None) is top.Document:
            counts[name] += count.quantity
    return {name: count or 1 for name, count in counts.items()}


def label_stem(label: str, labels: Set[str]) -> str:
    """A label without the number that FreeCAD gives to copies; "" where that says nothing.

    labels
        all labels: a number is FreeCAD's only where the label without it is there too.
    """
    stem = _NUMBER.sub("", label)
    stem = stem if stem in labels else label
    return "" if is_generic(stem) else stem


def _alike(objects: Iterable[Any], shape_of: Callable[[Any], str]) -> list[tuple[list[Any], str]]:
    """Equal objects together: those of one shape, and those of one label whose shapes do not differ."""
    groups: list[tuple[list[Any], str]] = []
    by_shape: dict[tuple[str, str], int] = {}
    by_stem: dict[str, int] = {}
    offered = list(objects)
    labels = {label_of(obj) for obj in offered}
    for obj in offered:
        shape, stem = shape_of(obj), label_stem(label_of(obj), labels)
        keys: list[tuple[dict[Any, int], Any, str]] = []
        if shape:
            keys.append((by_shape, (getattr(obj, "TypeId", ""), shape), "shape"))
        if stem:
            keys.append((by_stem, stem, "label"))
        known = next(((known[key], why) for known, key, why in keys if key in known), None)
        if known is None:
            groups.append(([obj], ""))
            place = len(groups) - 1
        else:
            place, why = known
            members, before = groups[place]
            members.append(obj)
            groups[place] = (members, "label" if "label" in (why, before) else "shape")
        for index, key, _ in keys:
            index.setdefault(key, place)
    return groups


def _article(objects: Sequence[Any], alike: str, quantity: int) -> Modelled:
    first = objects[0]
    path = getattr(first.Document, "FileName", "") or ""
    source = own(first, "sourceFile") or ""
    entry = BomEntry(
        path,
        quantity=quantity,
        object_name=object_name(first),
        label=label_of(first),
        document_label=getattr(first.Document, "Label", "") or "",
    )
    return Modelled(
        entry,
        tuple(map(object_name, objects)),
        alike,
        located(source, path) if isinstance(source, str) and source else "",
    )
