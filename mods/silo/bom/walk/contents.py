# SPDX-License-Identifier: LGPL-2.1-or-later
"""Reads assemblies, each once, and keeps what it learnt of the objects met on the way.

How one assembly is counted stands in :mod:`silo.bom.walk.reading`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Set
from typing import Any

from silo.bom.errors import DocumentError
from silo.bom.identity import document_identity, own_identity
from silo.bom.walk.counts import Contents, Key, KeyOf
from silo.bom.walk.kinds import Kind, kind_of, no_component
from silo.bom.walk.notes import Notes
from silo.bom.walk.reading import Reading
from silo.bom.walk.standard import STANDARD_PARTS, designation
from silo.bom.walk.targets import Inspect, Target, resolve_target

# Objects that lie beside an assembly in its document and count with it all the same.
Beside = Callable[[Any], Iterable[Any]]


def _nothing_beside(_container: Any) -> Iterable[Any]:
    return ()


class Reader:
    """Reads the contents of assemblies, and reports to a notebook what it met.

    beside
        finds what counts with an assembly though it lies beside it.
    hardware
        False leaves standard parts out.
    declare
        names of objects that count as if a person had declared them.
    """

    def __init__(
        self,
        notes: Notes,
        key: KeyOf,
        inspect: Inspect | None,
        *,
        beside: Beside = _nothing_beside,
        hardware: bool = True,
        declare: Set[str] = frozenset(),
    ) -> None:
        self.notes = notes
        self.key = key
        self.beside = beside
        self.hardware = hardware
        self.declare = declare
        self._inspect = inspect
        self._known: dict[Key, Contents] = {}
        self._not_components: dict[Key, str] = {}
        self._designations: dict[Key, tuple[str, bool]] = {}

    def contents(self, container: Any) -> Contents:
        """What an assembly holds; read once however often it is used."""
        key = self.key(container)
        if key not in self._known:
            self.notes.reading = key[0]
            self._known[key] = self._read(container)
        return self._known[key]

    def _read(self, container: Any) -> Contents:
        try:
            return Reading(self, container).of(container)
        except DocumentError as error:
            self.notes.unreadable(container, error)
            return Contents(holds_components=True)

    def brings(self, obj: Any) -> list[Any]:
        """The components that one object shows, each once."""
        try:
            return Reading(self, obj).brought_by(obj)
        except DocumentError:
            return []

    def resolve(self, link: Any) -> Target:
        """The end of a link."""
        return resolve_target(link, self._inspect)

    def no_component(self, key: Key, target: Any) -> str:
        """What the target is instead of a component; "" where it may be one."""
        if key not in self._not_components:
            self._not_components[key] = no_component(target)
        return self._not_components[key]

    def standard(self, obj: Any, key: Key | None = None) -> tuple[str, bool]:
        """The designation of a standard part, "" for anything else; and whether it is an item of its own.

        It is where somebody registered that very object. What identifies the document it lies in is that of
        the part beside it, except where there is none.
        """
        key = key or self.key(obj)
        known = self._designations.get(key)
        if known is None:
            text = designation(obj)
            known = self._designations[key] = (text, bool(text) and _is_registered(obj))
        return known

    def component(self, obj: Any) -> Key:
        """What identifies a component: of standard parts their designation, of others the key."""
        key = self.key(obj)
        text, registered = self.standard(obj, key)
        return (STANDARD_PARTS, text) if text and not registered else key


def _is_registered(fastener: Any) -> bool:
    if own_identity(fastener):
        return True
    document = getattr(fastener, "Document", None)
    if not document_identity(document):
        return False
    others = (obj for obj in getattr(document, "Objects", ()) or () if obj is not fastener)
    return all(kind_of(obj) in (Kind.NOTHING, Kind.FOLDER) for obj in others)
