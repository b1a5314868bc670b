# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a run noticed: one code, one severity, one plain sentence, and where.

Everything that is not counted, or counted with a doubt, is explained by a finding; nothing is dropped in
silence. A finding of severity ERROR keeps a BOM from being synced until a user says otherwise: a missing
file must never read as "removed".
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Self

from silo.bom.message import message


class Severity(StrEnum):
    """How much a finding matters."""

    INFO = "info"  # for completeness: this is how it was counted
    WARNING = "warning"  # counted, or left out, in a way a user should look at
    ERROR = "error"  # the BOM cannot be trusted; it is not synced without consent


_E, _W, _I = Severity.ERROR, Severity.WARNING, Severity.INFO


class FindingCode(StrEnum):
    """The machine names of findings, which are stable and public, with all that follows from them.

    severity
        how much it usually matters.
    meaning
        what several of them have in common, in words, as in "15 × ...".
    remedy
        what a user does about it, for the reference; in Markdown.
    sentence, tail
        the message about an object, and how it ends: with all objects (``users``) that it is about, or with
        advice.
    """

    severity: Severity
    meaning: str
    remedy: str
    sentence: str
    tail: str

    def __new__(
        cls, code: str, severity: Severity, meaning: str, remedy: str, sentence: str = "", tail: str = ""
    ) -> Self:
        made = str.__new__(cls, code)
        made._value_ = code
        made.severity, made.meaning, made.remedy = severity, meaning, remedy
        made.sentence, made.tail = sentence, tail
        return made

    # broken links
    MISSING_FILE = (
        "missing_file",
        _E,
        "a file that an assembly links to is not there",
        "put the file back, or `silo-mod relink` where it has moved; `--allow-missing` syncs the rest",
        "The file {file} is missing",
        "used by {users}",
    )
    MISSING_OBJECT = (
        "missing_object",
        _E,
        "a file lacks the object that an assembly links to",
        "open the assembly and set the link again; the part was deleted or replaced in its file",
        "{file} no longer holds the object {part}",
        "used by {users}",
    )
    UNREADABLE_FILE = (
        "unreadable_file",
        _E,
        "a file that an assembly links to cannot be read",
        "open the file in FreeCAD and save it, or take an older state from a backup or from Silo",
        "The file {file} cannot be read",
        "used by {users}",
    )
    LFS_POINTER = (
        "lfs_pointer",
        _E,
        "a Git LFS pointer, not the file itself; `git lfs pull` fetches it",
        "`git lfs pull`",
        "{file} is a Git LFS pointer, not the file itself; fetch it with `git lfs pull`",
        "used by {users}",
    )
    OUTSIDE_ROOT = (
        "outside_root",
        _E,
        "a link leads out of the project's folder",
        "move the file into the project and link to it there",
        "{file} lies outside the folder that may be read",
        "used by {users}",
    )
    DELETED_COPY = (
        "deleted_copy",
        _E,
        "the configured copy that a link showed was deleted",
        "set the link again, or delete it; FreeCAD shows nothing there",
        "The changed copy that a link showed in {file} was deleted, so FreeCAD shows nothing",
        "used by {users}",
    )
    BROKEN_LINK = (
        "broken_link",
        _E,
        "a link is broken",
        "open the assembly and set the link again, or delete it",
        "A link has lost its target",
        "used by {users}",
    )
    CYCLE = (
        "cycle",
        _E,
        "an assembly contains itself",
        "delete one of the links of the cycle that the message names",
        "An assembly contains itself: {path}",
        "the cycle is closed by {users}",
    )
    TOO_DEEP = (
        "too_deep",
        _E,
        "an assembly is nested too deep",
        "look for a link that leads back into the assembly; else flatten a level",
        "The assembly is nested more than {levels} levels deep; what lies below was not read",
        "cut at {users}",
    )
    # counted or left out by a rule
    UNSET_LINK = (
        "unset_link",
        _W,
        "a link leads nowhere",
        "give the link a target, or delete it",
        "A link was never given a target",
        "not counted: {users}",
    )
    IN_DOCUMENT_LINK = (
        "in_document_link",
        _I,
        "a link leads to an object of its own file",
        "nothing; this is for information",
        "Links within the file lead to construction geometry, which is not a part: not counted",
        "these are: {users}",
    )
    SUB_ELEMENT_LINK = (
        "sub_element_link",
        _I,
        "a link leads to a part of an object",
        "nothing, if it is a reference; else link to the whole part",
        "{obj} is a reference to {element} of a part, not a component.",
    )
    NO_COMPONENT = (
        "no_component",
        _I,
        "a link leads to an object that is not a component",
        "nothing; this is for information",
        "{obj} links to {target}, {words}: not a component, not counted.",
    )
    SUPPRESSED = (
        "suppressed",
        _I,
        "suppressed, so not counted",
        "nothing, if this is intended; else end the suppression",
        "{obj} is suppressed and not counted.",
    )
    EXCLUDED = (
        "excluded",
        _I,
        "excluded by hand, so not counted",
        "nothing, if this is intended; else set `SiloBomExclude` to false",
        "{obj} is excluded by SiloBomExclude on {by} and not counted.",
    )
    MIRRORED = (
        "mirrored",
        _W,
        "a mirrored part, counted as the part itself",
        "make the mirrored part a separate part if it is bought or made differently",
        "{obj} is a mirrored {target} and counted as one; the other hand of a part usually needs a number"
        " of its own.",
    )
    SCALED = (
        "scaled",
        _W,
        "a part that a link makes larger or smaller, counted as the part itself",
        "make the scaled part a separate part if it is bought or made differently",
        "{obj} is a scaled {target} and counted as one; another size of a part usually needs a number of its"
        " own.",
    )
    VARIANT = (
        "variant",
        _W,
        "a variant with values of its own, in the line of its original's number",
        "`silo-mod register TOP.FCStd --declare OBJECT` gives the variant a number of its own",
        "{obj} is a variant of {target} ({values}): a line of its own here, and counted under the number of"
        " {target} until it has one.",
    )
    DRAFT_ARRAY = (
        "draft_array",
        _I,
        "a Draft array",
        "nothing; a link array would be clearer",
        "{obj} is a Draft array: counted as {count} × {target}.",
    )
    ARRAY_SIZE = (
        "array_size",
        _E,
        "the size of an array is not known",
        "recompute the array in FreeCAD and save",
        "{obj} is a Draft array of {target} and does not say how many it shows; open it in FreeCAD, "
        "recompute and save.",
    )
    CONSUMED = (
        "consumed",
        _I,
        "used up by another object, so not counted",
        "nothing, if nobody buys or makes it separately; else take it out of the cut or fusion",
        "{obj} is used up by {target} (a cut, a boolean or a fusion) and not counted.",
    )
    COINCIDENT = (
        "coincident",
        _I,
        "an object lies where another shows it again",
        "hide the original of an array, or the members of a compound",
        "{target} shows {obj} at the place of {obj}, so it is counted once.",
    )
    HIDDEN = (
        "hidden",
        _I,
        "hidden pieces, counted or not",
        "*Count It* or *Reference* in the preview; `silo-mod register TOP.FCStd --count-hidden OBJECT`,"
        " `--reference OBJECT`. The file keeps the answer (`SiloBomExclude`)",
        "Hidden in {obj}: {what}.",
    )
    MODIFIED_HERE = (
        "modified_here",
        _I,
        "linked parts that the assembly machines or joins",
        "nothing; the linked parts count, and their new shape is what is weighed",
        "{obj} is made here of linked parts ({parts}): they count once, and {obj} is no part of its own.",
    )
    NO_HARDWARE = (
        "no_hardware",
        _I,
        "standard parts are left out",
        "leave out `--no-hardware`, or change the setting, to count them",
        "Standard parts are left out, as the settings say",
        "not counted: {users}",
    )
    SAME_ARTICLE = (
        "same_article",
        _I,
        "several designations name one standard part",
        "use one of the standards in the project",
    )
    LOCAL_GEOMETRY = (
        "local_geometry",
        _W,
        "modelled in the assembly's file, so not counted",
        "`silo-mod register TOP.FCStd --declare OBJECT` what is a part; set `SiloBomExclude` on the rest",
        "{what} yet in {obj} (pieces: {links}): {names}. Register them, or set SiloBomExclude on them.",
    )
    FOREIGN_COMPONENT = (
        "foreign_component",
        _W,
        "a component of another program",
        "import the part again from an FCStd file",
        "A2plus imported parts without naming a FreeCAD file; they count as parts of this file",
        "these are: {users}",
    )
    NO_CONTAINER = (
        "no_container",
        _W,
        "components lie in no assembly",
        "put the components into an assembly, or leave them there: they are counted",
        "The components lie in the document itself, in no assembly; they were counted.",
    )
    BESIDE_ASSEMBLY = (
        "beside_assembly",
        _W,
        "components lie beside the assembly, so they are not counted",
        "move the components of the assembly into it",
        "Components lie in the document itself, beside the assembly",
        "not counted: {users}",
    )
    COUNTED_BESIDE = (
        "counted_beside",
        _I,
        "components lie beside the assembly, and are counted",
        "move them into the assembly",
        "Standard parts lie in the document beside {target} and are counted with it",
        "these are: {users}",
    )
    UNKNOWN_LINK_TYPE = (
        "unknown_link_type",
        _W,
        "an unknown kind of link",
        "check the quantity; report the type",
        "The object type {kind} is not known; it looks like a link and was read as one",
        "check the quantity of {users}",
    )
    NEWER_FREECAD = (
        "newer_freecad",
        _I,
        "saved by a FreeCAD newer than the newest that was tried",
        "check the quantities with `silo-mod bom --verify`",
        "Saved by FreeCAD {version}, newer than {newest}, the newest tested",
        "the files: {users}",
    )
    STALE_ASSEMBLY_LINK = (
        "stale_assembly_link",
        _W,
        "a link to an assembly shows an old state of it",
        "recompute the assembly in FreeCAD and save",
        "{obj} shows an old state of {target} ({parts}); the BOM counts the real one.",
    )
    LOST_ASSEMBLY = (
        "lost_assembly",
        _E,
        "FreeCAD 0.20 lost the assembly of a newer one",
        "use FreeCAD 1.0 or newer for this file, and do not save it in 0.20",
        "{file} holds the assembly {part}, which this FreeCAD is too old to load",
        "used by {users}",
    )
    RESPELT = (
        "respelt",
        _W,
        "a path differs from the file's name in upper and lower case",
        "rename the file as the link spells it, or `silo-mod relink`: other systems do not find it",
    )
    EMPTY_BOM = (
        "empty_bom",
        _W,
        "an assembly without components",
        "nothing, if the assembly is empty; else see which parts the other findings leave out",
        "{obj} holds no components that are linked from other files, so its BOM is empty.",
    )
    ONE_PART = (
        "one_part",
        _I,
        "a file that is one part, and no assembly",
        "nothing; a part has no BOM of its own",
        "{file} is one part and no assembly: it counts as one piece, with all that it shows ({names}).",
    )
    NO_ROLE = (
        "no_role",
        _E,
        "an object has no role in the count; please report this",
        "report it, with the file if you are allowed to share it",
        "{obj} has no role in the count; please report this.",
    )
    UNEXPLAINED = (
        "unexplained",
        _W,
        "an object is neither counted nor named; please report this",
        "count it by hand, and report it, with the file if you are allowed to share it",
        "{obj} lies in the assembly, and is neither counted nor named; please report this.",
    )
    TWO_ROLES = (
        "two_roles",
        _E,
        "an object has two roles in the count; please report this",
        "report it, with the file if you are allowed to share it",
        "{obj} counts in two roles; please report this.",
    )
    CONSOLIDATION = (
        "consolidation",
        _W,
        "many single links to one part; an array would be clearer",
        "nothing; the count is right. An array is easier to change",
        "{who} has {what}",
        "Consider using a link array (ElementCount) for cleaner assembly management.",
    )
    # identity
    COPIED_IDENTITY = (
        "copied_identity",
        _W,
        "several files carry one Silo identity",
        "say in the register dialog whether it is the same part or a new part",
        "{count} files carry the same Silo identity ({identity}): {names}. Is it the same part, or is one of"
        " them a new part that needs its own number?",
    )
    SHARED_IDENTITY = (
        "shared_identity",
        _W,
        "several components of a file carry one Silo identity",
        "remove the identity of the copy, then register it",
        "{count} components of {file} share the Silo identity ({identity}): {names}. They will count as one"
        " item; register them apart if they are different parts.",
    )
    UNREGISTERED = (
        "unregistered",
        _W,
        "a component without a part number",
        "`silo-mod register`, or *Register Parts…* in FreeCAD",
    )
    # against the server
    UNREFERENCED = (
        "unreferenced",
        _W,
        "a line that no component uses any more",
        "on the BOM page: *Remove* it, or *Keep as intentional*",
    )
    CONFLICT = (
        "conflict",
        _W,
        "a manual line for a part that is a component as well",
        "on the BOM page: take the quantity of CAD, or keep that of Silo",
    )


class HiddenStanding(StrEnum):
    """What the count makes of a hidden object."""

    COUNTS = "counts"
    NOT_COUNTED = "not counted"
    REFERENCE = "reference"


@dataclass(frozen=True, slots=True, order=True)
class Place:
    """An object in a file; ``doc_path`` as the document names itself, ``obj`` its FreeCAD ``Name``.

    label, standing
        of a hidden object: its label, and what the count makes of it.
    """

    doc_path: str
    obj: str = ""
    label: str = field(default="", compare=False)
    standing: str = field(default="", compare=False)

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
        """Return True if the BOM is not synced until the user says so."""
        return self.severity is Severity.ERROR


def respelt_findings(notes: Iterable[str], top: str) -> tuple[Finding, ...]:
    """Make the findings about files that were found by another spelling: another system does not find
    them.
    """
    return tuple(
        Finding(FindingCode.RESPELT, Severity.WARNING, message("{note}.", note=note), (Place(top),))
        for note in notes
    )
