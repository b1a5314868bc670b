# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is asked of single objects and documents, each once: identity, target, consumers, view, variants."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from silo.bom.key import Key
from silo.bom.walk.document import object_name
from silo.bom.walk.identity import document_identity, own_identity
from silo.bom.walk.kinds import Kind, kind_of, no_component
from silo.bom.walk.operands import Consumers
from silo.bom.walk.references import References
from silo.bom.walk.seen import has_view
from silo.bom.walk.standard import STANDARD_PARTS, designation
from silo.bom.walk.survey import survey_of
from silo.bom.walk.targets import Inspect, Target, resolve_target
from silo.bom.walk.variants import Variant, values_of, variant_key

Canonical = Callable[[str], str]


class Files:
    """What identifies an object: its file, by one path, and its name in it."""

    def __init__(self, canonical: Canonical | None = None) -> None:
        self._canonical = canonical
        self._paths: dict[str, str] = {}

    def key(self, obj: Any) -> Key:
        return (self.path(obj), object_name(obj))

    def path(self, obj: Any) -> str:
        return self.canonical(getattr(getattr(obj, "Document", None), "FileName", "") or "")

    def canonical(self, path: str) -> str:
        if not path or self._canonical is None:
            return path
        if path not in self._paths:
            self._paths[path] = self._canonical(path)
        return self._paths[path]


class Facts:
    """Facts of objects and documents, remembered for one walk."""

    def __init__(self, inspect: Inspect | None, files: Files) -> None:
        self.key = files.key
        self._inspect = inspect
        self._not_components: dict[Key, str] = {}
        self._designations: dict[Key, tuple[str, bool]] = {}
        self._eaten: dict[str, Consumers[Key]] = {}
        self._views: dict[str, bool] = {}
        self._references: dict[str, References] = {}
        self._variants: dict[Key, Variant] = {}
        self._copies: dict[Key, Variant] = {}
        self._configured: dict[Key, list[Any]] = {}

    def resolve(self, link: Any) -> Target:
        """Follow a link to its end."""
        return resolve_target(link, self._inspect)

    def eaten(self, document: Any, features: Iterable[Any]) -> Consumers[Key]:
        """Return who consumes the objects of a document.

        features
            of a document that does not say which objects it has.
        """
        path = _path_or_id(document)
        if path not in self._eaten:
            listed = [obj for obj, _ in survey_of(document).of({Kind.LOCAL})]
            self._eaten[path] = Consumers(listed or features, self.key, lambda: self.has_view(document))
        return self._eaten[path]

    def has_view(self, document: Any) -> bool:
        """Return True if a view of the document was saved."""
        path = _path_or_id(document)
        if path not in self._views:
            self._views[path] = has_view(document)
        return self._views[path]

    def supported_by(self, link: Any) -> list[Any]:
        """Return what a hidden link supports if it is only a reference; else []."""
        path = _path_or_id(link.Document)
        if path not in self._references:
            self._references[path] = References(link.Document)
        return self._references[path].supported_by(link)

    def variant(self, target: Target) -> Variant | None:
        """Return the configured copy at the end of a link; None if there is none, or if its values are those
        of its original.
        """
        if target.variant is None or not (values := values_of(target.configured, target.obj)):
            return None
        base = self.key(target.obj)
        made = Variant(target.variant, target.configured, values, target.obj, base)
        found = self._variants.setdefault(variant_key(base, values), made)
        links = self._configured.setdefault(found.key, [])
        if not any(link is target.configured for link in links):
            links.append(target.configured)
        self._copies[self.key(target.variant)] = found
        return found

    def variant_of(self, copy: Any) -> Variant | None:
        """Return the variant that a configured copy makes."""
        return self._copies.get(self.key(copy)) if self._copies else None

    def configured(self, variant: Variant) -> tuple[Any, ...]:
        """Return the links that show a variant, as far as they were read."""
        return tuple(self._configured[variant.key])

    def variant_identity(self, variant: Variant) -> str | None:
        """Return the identity that a variant has of its own: on one of its links, or on the copy. FreeCAD
        copies that of the original, which is none.
        """
        places = (*self.configured(variant), variant.copy)
        inherited = {None, own_identity(variant.base)}
        return next((found for found in map(own_identity, places) if found not in inherited), None)

    def declared_identity(self, obj: Any) -> str | None:
        """Return the identity of an object's own; a configured copy has that of its original unless it has
        one.
        """
        if (variant := self.variant_of(obj)) is None:
            return own_identity(obj)
        return self.variant_identity(variant) or own_identity(variant.base)

    def no_component(self, key: Key, target: Any) -> str:
        """Return what the target is if it is no component; "" if it may be one."""
        if key not in self._not_components:
            self._not_components[key] = no_component(target)
        return self._not_components[key]

    def standard(self, obj: Any, key: Key | None = None) -> tuple[str, bool]:
        """Return the designation of a standard part ("" for anything else), and if it has an item of its own.

        It has one if somebody registered this very object. The identity of its document is that of the part
        beside it, unless there is none.
        """
        key = key or self.key(obj)
        known = self._designations.get(key)
        if known is None:
            text = designation(obj)
            known = self._designations[key] = (text, bool(text) and _is_registered(obj))
        return known

    def component(self, obj: Any) -> Key:
        """Return the identity of a component: the designation of a standard part, the key of any other; of a
        configured copy its original and its values.
        """
        key = self.key(obj)
        if self._copies and (variant := self._copies.get(key)) is not None:
            return variant.key
        text, registered = self.standard(obj, key)
        return (STANDARD_PARTS, text) if text and not registered else key


def _path_or_id(document: Any) -> str:
    return getattr(document, "FileName", "") or f"{id(document):x}"


def _is_registered(fastener: Any) -> bool:
    if own_identity(fastener):
        return True
    document = getattr(fastener, "Document", None)
    if not document_identity(document):
        return False
    others = (obj for obj in getattr(document, "Objects", ()) or () if obj is not fastener)
    return all(kind_of(obj) in (Kind.NOTHING, Kind.FOLDER) for obj in others)
