# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is modelled in an assembly's own file and can be declared a component there.

Nothing here counts: an identity on the object does, and the user gives it. The rules of this module:

* what is shown, how often, and what is used up, the count says (:mod:`silo.bom.walk.roles`);
* equal copies are proposed as one article: the same shape, or the same label but for FreeCAD's number;
* a configured copy of a part counts already, under the number of its original; its links in this file can
  carry a number of its own. Equal values are one article.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Sequence, Set
from dataclasses import dataclass, replace
from typing import Any

from silo.bom.entry import BomEntry
from silo.bom.errors import DocumentError, InputError, SiloError
from silo.bom.items.naming import is_generic, with_values
from silo.bom.key import Key
from silo.bom.message import message
from silo.bom.walk.contents import Count
from silo.bom.walk.document import label_of, located, object_name, own
from silo.bom.walk.identity import document_identity, own_identity
from silo.bom.walk.kinds import is_container
from silo.bom.walk.roles import DECLARABLE, Reader
from silo.bom.walk.roots import choose_assembly, silent_reader
from silo.bom.walk.survey import survey_of
from silo.bom.walk.variants import Variant
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
    no_part
        the user said that it is no part, and the file keeps that (``SiloBomExclude``).
    variant_of
        the name of the original of a configured copy, under whose number the copy counts until it has one.
        ``objects`` are then the links that show the copy. "" for anything else.
    """

    entry: BomEntry
    objects: tuple[str, ...]
    alike: str = ""
    source: str = ""
    no_part: bool = False
    variant_of: str = ""

    @property
    def decided(self) -> bool:
        """Return True if the user has said what it is: a component, or no part."""
        return self.declared or self.no_part

    @property
    def declared(self) -> bool:
        """Return True if it is a component already."""
        return self.entry.silo_uuid is not None

    def apart(self) -> tuple[Modelled, ...]:
        """Make each object an article of its own; the quantity of each is then unknown. Equal values are one
        variant.
        """
        if self.variant_of:
            return (self,)
        return tuple(
            replace(
                self, entry=replace(self.entry, object_name=name, label=name, quantity=1), objects=(name,)
            )
            for name in self.objects
        )


def modelled(path: str, assembly: str | None = None) -> list[Modelled]:
    """Find what is modelled in the file of an assembly, without FreeCAD. DocumentError, InputError."""
    with Library() as library:
        return modelled_in(choose_assembly(library.open(path), assembly), _shape_of)


def _shape_of(obj: object) -> str:
    try:
        return obj.shape_key() if isinstance(obj, FcstdObject) else ""
    except DocumentError:  # damaged: nothing is known of it
        return ""


def chosen(articles: Sequence[Modelled], names: Iterable[str], *, apart: bool = False) -> list[Modelled]:
    """Return the articles with these names (or labels), each once. InputError for a name that no
    article has.
    """
    by_chain: dict[tuple[str, ...], Modelled] = {}
    for name in names:
        fitting = [article for article in articles if name in article.objects] or [
            article for article in articles if name == article.entry.label
        ]
        if len(fitting) != 1:
            label_text = ", ".join(article.entry.object_name for article in articles) or "nothing"
            what = "nothing" if not fitting else message("{count} things", count=len(fitting))
            raise InputError(
                message(
                    "{name} means {what} that is modelled in this file; there is: {label_text}",
                    name=repr(name),
                    what=what,
                    label_text=label_text,
                )
            )
        for article in fitting[0].apart() if apart else fitting:
            by_chain[article.objects] = article
    return list(by_chain.values())


def source_identity(article: Modelled) -> str | None:
    """Read the identity of the file from which A2plus imported an article; None if there is none."""
    if not article.source or not os.path.isfile(article.source):
        return None
    try:
        with Library() as library:
            return document_identity(library.open(article.source))
    except SiloError:
        return None


def modelled_in(top: Any, shape_of: Callable[[Any], str]) -> list[Modelled]:
    """Find the articles modelled in the file of an assembly (or of a single part); decided ones come last.

    shape_of
        a text that is equal for equal shapes, wherever they are placed; "" if that is not known.
    """
    reader = silent_reader()
    contents = reader.contents(top)
    shown: dict[str, tuple[Any, int]] = {}
    for count in () if contents.is_part else contents.own:
        if reader.variant_of(count.target) is not None:
            continue
        name = object_name(count.target)
        shown[name] = (count.target, count.quantity + (shown[name][1] if name in shown else 0))
    articles = [
        _article(objects, alike, sum(shown[object_name(obj)][1] for obj in objects))
        for objects, alike in _alike([obj for obj, _ in shown.values()], shape_of)
    ]
    declared: dict[str, tuple[list[Any], int]] = {}
    for count in contents.counts:
        target = count.target
        is_here = getattr(target, "Document", None) is top.Document and reader.variant_of(target) is None
        if is_here and (identity := own_identity(target)):
            objects, before = declared.get(identity, ([], 0))
            objects += [] if target in objects else [target]
            declared[identity] = (objects, before + count.quantity)
    for identity, (objects, quantity) in declared.items():
        article = _article(objects, "", quantity)
        articles.append(replace(article, entry=replace(article.entry, silo_uuid=identity)))
    articles += _variants(reader, [*contents.own, *contents.counts], top)
    of_file = survey_of(top.Document).of(DECLARABLE)
    no_parts = _alike([obj for obj, _ in of_file if own(obj, "SiloBomExclude") is True], shape_of)
    return articles + [
        replace(_article(objects, alike, len(objects)), no_part=True) for objects, alike in no_parts
    ]


def _variants(reader: Reader, counts: Iterable[Count], top: Any) -> list[Modelled]:
    """Find the configured copies of parts. Each is an article; its links in this file carry the identity."""
    pieces: dict[Key, int] = {}
    by_key: dict[Key, Variant] = {}
    for count in counts:
        if (variant := reader.variant_of(count.target)) is not None:
            by_key[variant.key] = variant
            pieces[variant.key] = pieces.get(variant.key, 0) + count.quantity
    articles = []
    for key, variant in by_key.items():
        links = [link for link in reader.configured(variant) if link.Document is top.Document]
        if not links:
            continue
        of = label_of(variant.base)
        made = _article(links, "", pieces[key])
        entry = replace(
            made.entry,
            label=with_values(of, variant.values),
            silo_uuid=reader.variant_identity(variant),
            is_assembly=is_container(variant.copy) and reader.contents(variant.copy).holds_components,
        )
        articles.append(replace(made, entry=entry, variant_of=of))
    return articles


def label_stem(label: str, labels: Set[str]) -> str:
    """Cut the number that FreeCAD gives to copies from a label; "" if the rest says nothing.

    labels
        all labels: a number is from FreeCAD only if the label without it exists too.
    """
    stem = _NUMBER.sub("", label)
    stem = stem if stem in labels else label
    return "" if is_generic(stem) else stem


def _alike(objects: Iterable[Any], shape_of: Callable[[Any], str]) -> list[tuple[list[Any], str]]:
    """Group equal objects: those with one shape, and those with one label whose shapes do not differ."""
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
        match = next(((positions[key], why) for positions, key, why in keys if key in positions), None)
        if match is None:
            groups.append(([obj], ""))
            place = len(groups) - 1
        else:
            place, why = match
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
