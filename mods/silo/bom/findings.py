# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a run noticed: one code, one severity, one plain sentence, and where.

Everything that is not counted, or counted with a doubt, is explained by a finding; nothing is dropped in
silence. A finding of severity ERROR keeps a BOM from being synced until a person says otherwise: a missing
file must never read as "removed".
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum


class Severity(StrEnum):
    """How much a finding matters."""

    INFO = "info"  # for completeness: this is how it was counted
    WARNING = "warning"  # counted, or left out, in a way a person should look at
    ERROR = "error"  # the BOM cannot be trusted as it stands; it is not synced without consent


class FindingCode(StrEnum):
    """The machine names of findings; stable, part of the public surface."""

    # broken links (ERROR)
    MISSING_FILE = "missing_file"
    MISSING_OBJECT = "missing_object"
    UNREADABLE_FILE = "unreadable_file"
    LFS_POINTER = "lfs_pointer"
    OUTSIDE_ROOT = "outside_root"
    BROKEN_LINK = "broken_link"
    CYCLE = "cycle"
    TOO_DEEP = "too_deep"
    # counted or left out by a rule
    UNSET_LINK = "unset_link"
    IN_DOCUMENT_LINK = "in_document_link"
    SUB_ELEMENT_LINK = "sub_element_link"
    NO_COMPONENT = "no_component"
    SUPPRESSED = "suppressed"
    EXCLUDED = "excluded"
    MIRRORED = "mirrored"
    VARIANT = "variant"
    DRAFT_ARRAY = "draft_array"
    ARRAY_SIZE = "array_size"
    CONSUMED = "consumed"
    NO_HARDWARE = "no_hardware"
    SAME_ARTICLE = "same_article"
    LOCAL_GEOMETRY = "local_geometry"
    FOREIGN_COMPONENT = "foreign_component"
    NO_CONTAINER = "no_container"
    BESIDE_ASSEMBLY = "beside_assembly"
    COUNTED_BESIDE = "counted_beside"
    UNKNOWN_LINK_TYPE = "unknown_link_type"
    NEWER_FREECAD = "newer_freecad"
    STALE_ASSEMBLY_LINK = "stale_assembly_link"
    LOST_ASSEMBLY = "lost_assembly"
    RESPELT = "respelt"
    EMPTY_BOM = "empty_bom"
    CONSOLIDATION = "consolidation"
    # identity
    COPIED_IDENTITY = "copied_identity"
    SHARED_IDENTITY = "shared_identity"
    UNREGISTERED = "unregistered"
    # against the server
    UNREFERENCED = "unreferenced"
    CONFLICT = "conflict"


@dataclass(frozen=True, slots=True, order=True)
class Place:
    """An object in a file; ``doc_path`` as the document names itself, ``obj`` its FreeCAD ``Name``."""

    doc_path: str
    obj: str = ""

    def __str__(self) -> str:
        return f"{self.doc_path}#{self.obj}" if self.obj else self.doc_path


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing a run noticed."""

    code: FindingCode
    severity: Severity
    message: str
    where: tuple[Place, ...] = ()
    # The file that a broken link records, in full; and the file that was probably meant instead.
    file: str = ""
    did_you_mean: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "where", tuple(self.where))

    @property
    def blocks(self) -> bool:
        """True where the BOM is not to be synced unless the user says so."""
        return self.severity is Severity.ERROR


def respelt_findings(notes: Iterable[str], top: str) -> tuple[Finding, ...]:
    """What was taken though it is recorded in other case: right here, missing on another system."""
    return tuple(Finding(FindingCode.RESPELT, Severity.WARNING, f"{note}.", (Place(top),)) for note in notes)
