# SPDX-License-Identifier: LGPL-2.1-or-later
"""The entry of a BOM as the CAD model has it.

Entries are frozen. Equality is that of the spec's fields and the component's key; where a value was found
(labels, places), and what follows from the component itself, is not compared.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from silo.bom.findings import Finding, FindingCode, Severity
from silo.bom.frozen import Frozen, freeze
from silo.bom.walk.standard import STANDARD_PARTS, standard_uuid
from silo.bom.walk.variants import values_in, variant_key


@dataclass(frozen=True)
class BomEntry:
    """One BOM line as the CAD model has it: a component and how often its parent contains it directly.

    doc_path
        file of the component, as its document names it (``FileName``).
    silo_uuid
        identity found in the component, None while unregistered.
    part_number, name
        from the server, None until resolved.
    quantity
        instances per ONE parent (never multiplied down the tree).
    level
        nesting depth; direct children of the top assembly have level 1.
    children
        direct children, where the component is an assembly.
    consolidation_warning
        several individual links where one link array would do.
    object_name, label
        FreeCAD ``Name`` (with ``doc_path`` the component's key) and ``Label`` (for people only).
    standard
        designation of a standard part in trade form ("ISO 4762 M4×16"), None for any other component.
        ``doc_path`` and ``object_name`` then say where it first occurs.
    is_assembly
        True for a sub-assembly, also for an empty one.
    missing
        the component's file or object is not there (or cannot be read). ``doc_path`` and ``object_name``
        are then what the link records, and nothing is known of its children.
    individual_links, link_objects
        plain ``App::Link`` objects (no array), and all ``App::Link`` objects, that were counted.
    document_label
        ``Label`` of the component's document (the spec pre-fills names from it).
    instances
        names of the objects in the parent's document that were counted, to select them on screen.
    also
        keys of the other components that have the same part number and were added to this line.
    unregistered
        direct children without a part number, which ``children`` no longer has once they are resolved.
    own
        what an assembly shows of its own file and is no item yet: never sent, until a user declares it.
    variant
        the values of a configured copy ("L = 300 mm"); ``doc_path`` and ``object_name`` are its original's,
        the children its own. "" for anything else.
    copy
        (file, object) of the configured copy.
    is_own_item
        True for a variant with an identity of its own; any other is counted under its original's number.
    find_number
        what the first of its links proposes (``SiloFindNumber``); the server gives the number. "" for none.
    """

    doc_path: str
    silo_uuid: str | None = None
    part_number: str | None = None
    name: str | None = None
    quantity: int = 1
    level: int = 1
    children: tuple[BomEntry, ...] = Frozen()
    consolidation_warning: bool = False
    object_name: str = ""
    missing: bool = False
    label: str = field(default="", compare=False)
    is_assembly: bool = field(default=False, compare=False)
    individual_links: int = field(default=0, compare=False)
    link_objects: int = field(default=0, compare=False)
    instances: tuple[str, ...] = field(default=Frozen(), compare=False, repr=False)
    document_label: str = field(default="", compare=False, repr=False)
    standard: str | None = None
    also: tuple[tuple[str, str], ...] = field(default=Frozen(), compare=False, repr=False)
    unregistered: tuple[BomEntry, ...] = field(default=Frozen(), compare=False, repr=False)
    own: tuple[BomEntry, ...] = field(default=Frozen(), compare=False, repr=False)

    variant: str = ""
    copy: tuple[str, str] = field(default=("", ""), compare=False, repr=False)
    find_number: str = field(default="", compare=False, repr=False)
    is_own_item: bool = field(default=False, compare=False)

    def __post_init__(self) -> None:
        freeze(self, "children", "instances", "also", "unregistered", "own")

    @property
    def key(self) -> tuple[str, str]:
        """Return the key of a component: (file, object), with the values of a variant; or the designation of
        a standard part. Never a label.
        """
        if self.is_standard:
            return (STANDARD_PARTS, self.standard or "")
        if self.variant:
            return variant_key((self.doc_path, self.object_name), self.variant)
        return (self.doc_path, self.object_name)

    @property
    def counted_variants(self) -> tuple[str, ...]:
        """Return the values of the variants that were added to this line, since they have no number of their
        own.
        """
        return tuple(values for key in self.also if (values := values_in(key)) and values != self.variant)

    @property
    def is_standard(self) -> bool:
        """Return True if its designation identifies the article; no file gets its identity.

        False for a fastener that somebody registered as an item of its own; its object has the identity.
        """
        return self.standard is not None and self.silo_uuid == standard_uuid(self.standard)


@dataclass(frozen=True)
class Extraction:
    """What a walk found: the assembly itself, its entries, and its findings."""

    assembly: BomEntry
    entries: tuple[BomEntry, ...] = Frozen()
    findings: tuple[Finding, ...] = Frozen()

    def __post_init__(self) -> None:
        freeze(self, "entries", "findings")

    @property
    def blocked(self) -> bool:
        """Return True if a finding keeps this BOM from being synced."""
        return any(f.severity is Severity.ERROR for f in self.findings)

    def findings_of(self, *codes: FindingCode) -> tuple[Finding, ...]:
        """Return the findings with one of these codes, in order."""
        return tuple(f for f in self.findings if f.code in codes)


def walk_entries(entries: Iterable[BomEntry]) -> Iterator[BomEntry]:
    """Yield every distinct component below, each once, parents before children.

    Looks below each distinct value of a component: if a walk was cut (a ring, too deep), a component may have
    fewer children in one place than in another.
    """
    yielded: set[tuple[str, str]] = set()
    seen: dict[int, BomEntry] = {}  # nested assemblies share their values; kept, so that ids stay theirs
    stack = list(reversed(tuple(entries)))
    while stack:
        entry = stack.pop()
        if id(entry) in seen:
            continue
        seen[id(entry)] = entry
        if entry.key not in yielded:
            yielded.add(entry.key)
            yield entry
        stack.extend(reversed(entry.children))
