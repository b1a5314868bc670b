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
    NO_ROLE = "no_role"
    TWO_ROLES = "two_roles"
    CONSOLIDATION = "consolidation"
    # identity
    COPIED_IDENTITY = "copied_identity"
    SHARED_IDENTITY = "shared_identity"
    UNREGISTERED = "unregistered"
    # against the server
    UNREFERENCED = "unreferenced"
    CONFLICT = "conflict"

    @property
    def meaning(self) -> str:
        """What several of them have in common, in words, as in "15 × ..."."""
        return _TABLE[self][0]

    @property
    def remedy(self) -> str:
        """What a person does about it, for the reference; in Markdown."""
        return _TABLE[self][1]


# What it is, and what a person does about it.
_TABLE = {
    FindingCode.MISSING_FILE: (
        "a file that an assembly links to is not there",
        "put the file back, or `silo-mod relink` where it has moved; `--allow-missing` syncs the rest",
    ),
    FindingCode.MISSING_OBJECT: (
        "a file lacks the object that an assembly links to",
        "open the assembly and set the link anew; the part was deleted or replaced in its file",
    ),
    FindingCode.UNREADABLE_FILE: (
        "a file that an assembly links to cannot be read",
        "open the file in FreeCAD and save it, or take an older state from a backup or from Silo",
    ),
    FindingCode.LFS_POINTER: (
        "a Git LFS pointer, not the file itself; `git lfs pull` fetches it",
        "`git lfs pull`",
    ),
    FindingCode.OUTSIDE_ROOT: (
        "a link leads out of the project's folder",
        "move the file into the project and link to it there",
    ),
    FindingCode.BROKEN_LINK: ("a link is broken", "open the assembly and set the link anew, or delete it"),
    FindingCode.CYCLE: (
        "an assembly contains itself",
        "delete one of the links of the ring that the message names",
    ),
    FindingCode.TOO_DEEP: (
        "an assembly is nested too deep",
        "look for a link that leads back into the assembly; else flatten a level",
    ),
    FindingCode.TWO_ROLES: (
        "an object has two roles in the count; please report this",
        "report it, with the file if you may",
    ),
    FindingCode.NO_ROLE: (
        "an object has no role in the count; please report this",
        "report it, with the file if you may",
    ),
    FindingCode.UNSET_LINK: ("a link leads nowhere", "give the link a target, or delete it"),
    FindingCode.IN_DOCUMENT_LINK: (
        "a link leads to an object of its own file",
        "nothing; it says how the link was counted",
    ),
    FindingCode.SUB_ELEMENT_LINK: (
        "a link leads to a part of an object",
        "nothing, if it is a reference; else link to the whole part",
    ),
    FindingCode.NO_COMPONENT: (
        "a link leads to what is no component",
        "nothing; it says what was not counted",
    ),
    FindingCode.SUPPRESSED: (
        "suppressed, so not counted",
        "nothing, if it is meant; else end the suppression",
    ),
    FindingCode.EXCLUDED: (
        "excluded by hand, so not counted",
        "nothing, if it is meant; else set `SiloBomExclude` to false",
    ),
    FindingCode.MIRRORED: (
        "a mirrored part, counted as the part itself",
        "make the mirrored part a part of its own if it is bought or made differently",
    ),
    FindingCode.VARIANT: (
        "a variant, counted as the part itself",
        "save the variant as a part of its own if it needs a number",
    ),
    FindingCode.DRAFT_ARRAY: ("a Draft array", "nothing; a link array would be clearer"),
    FindingCode.ARRAY_SIZE: ("the size of an array is not known", "recompute the array in FreeCAD and save"),
    FindingCode.CONSUMED: (
        "used up by another object, so not counted",
        "nothing, if it is no piece to buy; else take it out of the cut or fusion",
    ),
    FindingCode.NO_HARDWARE: (
        "standard parts are left out",
        "leave out `--no-hardware`, or change the setting, to count them",
    ),
    FindingCode.SAME_ARTICLE: (
        "several designations are one standard part",
        "use one standard for it in the project",
    ),
    FindingCode.LOCAL_GEOMETRY: (
        "modelled in the assembly's file, so not counted",
        "`silo-mod register TOP.FCStd --declare OBJECT` what is a part; set `SiloBomExclude` on the rest",
    ),
    FindingCode.FOREIGN_COMPONENT: (
        "a component of another program",
        "import the part again from an FCStd file",
    ),
    FindingCode.NO_CONTAINER: (
        "components lie in no assembly",
        "put the components into an assembly, or leave it: they are counted",
    ),
    FindingCode.BESIDE_ASSEMBLY: (
        "components lie beside the assembly, so they are not counted",
        "move into the assembly what belongs to it",
    ),
    FindingCode.COUNTED_BESIDE: (
        "components lie beside the assembly, and are counted",
        "move them into the assembly",
    ),
    FindingCode.UNKNOWN_LINK_TYPE: ("an unknown kind of link", "check the quantity; report the type"),
    FindingCode.NEWER_FREECAD: (
        "saved by a FreeCAD newer than the newest that was tried",
        "check the quantities with `silo-mod bom --verify`",
    ),
    FindingCode.STALE_ASSEMBLY_LINK: (
        "a link to an assembly shows an old state of it",
        "recompute the assembly in FreeCAD and save",
    ),
    FindingCode.LOST_ASSEMBLY: (
        "FreeCAD 0.20 lost the assembly of a newer one",
        "use FreeCAD 1.0 or newer for this file, and do not save it in 0.20",
    ),
    FindingCode.RESPELT: (
        "a path is recorded in other letters than the file's",
        "name the file in the letters of the link, or `silo-mod relink`: other systems do not find it",
    ),
    FindingCode.EMPTY_BOM: (
        "an assembly without components",
        "nothing, if it is empty; else look at what the other findings leave out",
    ),
    FindingCode.CONSOLIDATION: (
        "many single links to one part; an array would be clearer",
        "nothing; the count is right. An array is easier to change",
    ),
    FindingCode.COPIED_IDENTITY: (
        "several files carry one Silo identity",
        "say in the register dialog whether it is the same part or a new part",
    ),
    FindingCode.SHARED_IDENTITY: (
        "several components of a file carry one Silo identity",
        "remove the identity of the copy, then register it",
    ),
    FindingCode.UNREGISTERED: (
        "a component without a part number",
        "`silo-mod register`, or *Register Parts…* in FreeCAD",
    ),
    FindingCode.UNREFERENCED: (
        "a line that no component uses any more",
        "on the BOM page: *Remove* it, or *Keep as intentional*",
    ),
    FindingCode.CONFLICT: (
        "a manual line that is a component as well",
        "on the BOM page: take the quantity of CAD, or keep that of Silo",
    ),
}


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
