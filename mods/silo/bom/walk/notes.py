# SPDX-License-Identifier: LGPL-2.1-or-later
"""The walker's notebook: what was seen, in plain words, each thing once however often it is met.

A finding reads the same whatever the order in which its objects were met: places and names are sorted.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from silo.bom.document import DocumentRoot, LinkProblem, label_of, object_name, saved_by
from silo.bom.errors import DocumentError
from silo.bom.findings import Finding, FindingCode, Place, Severity
from silo.bom.model import BomEntry

_Slot = tuple[FindingCode, str]

_BROKEN_TEXT = {
    FindingCode.MISSING_FILE: "The file {file} is missing",
    FindingCode.MISSING_OBJECT: "{file} no longer holds the object {obj}",
    FindingCode.UNREADABLE_FILE: "The file {file} cannot be read",
    FindingCode.LFS_POINTER: "{file} is a Git LFS pointer, not the file itself; fetch it with `git lfs pull`",
    FindingCode.OUTSIDE_ROOT: "{file} lies outside the folder that may be read",
    FindingCode.UNSET_LINK: "A link was never given a target",
    FindingCode.CYCLE: "A chain of links leads back to itself",
    FindingCode.BROKEN_LINK: "A link has lost its target",
    FindingCode.LOST_ASSEMBLY: "{file} holds the assembly {obj}, which this FreeCAD is too old to load",
}
_KNOWN_LINKS = frozenset(
    {
        *("App::Link", "App::LinkPython", "Part::LinkArray", "Part::LinkArrayLinear", "Part::LinkArrayPolar"),
        *("Part::LinkArrayCircular", "Part::LinkArrayPath", "Part::LinkArrayPoint"),
        *("Assembly::AssemblyLink", "App::LinkElement", "App::LinkElementPython"),
    }
)
# The newest FreeCAD of the test matrix.
NEWEST_TESTED = (1, 1)
_BY_OBJECT = (FindingCode.MISSING_OBJECT, FindingCode.LOST_ASSEMBLY)


def _names(labels: Sequence[str], most: int = 8) -> str:
    shown = ", ".join(labels[:most])
    return f"{shown} and {len(labels) - most} more" if len(labels) > most else shown


@dataclass
class _Note:
    severity: Severity
    message: str
    tail: str = ""
    file: str = ""
    users: dict[Place, str] = field(default_factory=dict)

    def finding(self, code: FindingCode) -> Finding:
        where = sorted(self.users)
        message = self.message
        if self.tail:
            names = _names(list(dict.fromkeys(self.users[place] for place in where)))
            message = f"{message}; {self.tail.format(users=names)}."
        return Finding(code, self.severity, message, tuple(where), self.file)


class Notes:
    """Collects findings while walking; the same fact from several places becomes one finding.

    ``path_of`` gives the file of an object, the same path for one file however it was opened.
    """

    def __init__(self, path_of: Callable[[Any], str]) -> None:
        self._path_of = path_of
        self.reading = ""  # the file that is being read; for objects that do not know theirs
        self._notes: dict[_Slot, _Note] = {}

    def findings(self) -> tuple[Finding, ...]:
        """All findings, in the order in which they were first met."""
        return tuple(note.finding(code) for (code, _), note in self._notes.items())

    def any_blocking(self) -> bool:
        """True where a finding keeps the BOM from being synced."""
        return any(note.severity is Severity.ERROR for note in self._notes.values())

    def _place(self, obj: Any) -> Place:
        return Place(self._path_of(obj) or self.reading, object_name(obj))

    def _add(
        self, code: FindingCode, about: str, severity: Severity, message: str, obj: Any, tail: str = ""
    ) -> None:
        note = self._notes.setdefault((code, about), _Note(severity, message, tail))
        note.users.setdefault(self._place(obj), label_of(obj))

    def broken(self, link: Any, problem: LinkProblem | None) -> None:
        """One finding per missing file or object, naming what uses it."""
        problem = problem or LinkProblem(FindingCode.BROKEN_LINK)
        code = problem.code if problem.code in _BROKEN_TEXT else FindingCode.BROKEN_LINK
        text = _BROKEN_TEXT[code]
        if code is FindingCode.BROKEN_LINK and problem.file:
            text = "{file} was not loaded"
        text = text.format(file=problem.file or "the file", obj=problem.obj or "that it is asked for")
        if problem.detail:
            text += f" ({problem.detail})"
        about = problem.file or str(self._place(link))
        if code in _BY_OBJECT:
            about = f"{about}#{problem.obj}"
        if code is FindingCode.UNSET_LINK:
            self._add(code, about, Severity.WARNING, text, link, "not counted: {users}")
        else:
            self._add(code, about, Severity.ERROR, text, link, "used by {users}")
            self._notes[code, about].file = problem.file

    def unreadable(self, obj: Any, error: DocumentError) -> None:
        """The file that ``obj`` lies in is damaged at this very place."""
        self._add(
            FindingCode.UNREADABLE_FILE,
            str(error),
            Severity.ERROR,
            f"The file {error.path} cannot be read in full ({error.reason})",
            obj,
            "not counted: {users}",
        )

    def cycle(self, link: Any, ring: Sequence[tuple[str, str]]) -> None:
        """``ring``: the assemblies that contain each other, the first not repeated."""
        path = " → ".join(str(Place(*key)) for key in (*ring, ring[0]))
        self._add(
            FindingCode.CYCLE,
            path,
            Severity.ERROR,
            f"An assembly contains itself: {path}",
            link,
            "the ring is closed by {users}",
        )

    def loop(self, obj: Any) -> None:
        self._add(
            FindingCode.CYCLE,
            self._path_of(obj),
            Severity.ERROR,
            f"{self._path_of(obj) or label_of(obj)} holds links that lead back to what holds them",
            obj,
            "the ring goes through {users}",
        )

    def too_deep(self, obj: Any, levels: int) -> None:
        self._add(
            FindingCode.TOO_DEEP,
            str(levels),
            Severity.ERROR,
            f"The assembly is nested more than {levels} levels deep; what lies below was not read",
            obj,
            "cut at {users}",
        )

    def suppressed(self, obj: Any) -> None:
        self._each(FindingCode.SUPPRESSED, obj, Severity.INFO, "is suppressed and not counted")

    def excluded(self, link: Any, target: Any = None) -> None:
        by = "itself" if target is None else f"its part {label_of(target)}"
        self._each(
            FindingCode.EXCLUDED,
            link,
            Severity.INFO,
            f"is excluded by SiloBomExclude on {by} and not counted",
        )

    def mirrored(self, link: Any, target: Any) -> None:
        self._each(
            FindingCode.MIRRORED,
            link,
            Severity.WARNING,
            f"is a mirrored {label_of(target)} and counted as one; the other hand of a part usually needs "
            "a number of its own",
        )

    def variant(self, link: Any, target: Any) -> None:
        self._each(
            FindingCode.VARIANT,
            link,
            Severity.WARNING,
            f"is a variant of {label_of(target)} (copy on change) and counted as one of it",
        )

    def draft_array(self, array: Any, base: Any, count: int) -> None:
        self._each(
            FindingCode.DRAFT_ARRAY,
            array,
            Severity.INFO,
            f"is a Draft array: counted as {count} × {label_of(base)}",
        )

    def foreign(self, obj: Any) -> None:
        self._add(
            FindingCode.FOREIGN_COMPONENT,
            self._path_of(obj),
            Severity.WARNING,
            "A2plus imported parts that name no FreeCAD file; they are own parts of this file",
            obj,
            "these are: {users}",
        )

    def sub_element(self, link: Any, element: str) -> None:
        self._each(
            FindingCode.SUB_ELEMENT_LINK,
            link,
            Severity.INFO,
            f"is a reference to {element} of a part, not a component",
        )

    def no_component(self, link: Any, target: Any, words: str) -> None:
        self._each(
            FindingCode.NO_COMPONENT,
            link,
            Severity.INFO,
            f"links to {label_of(target)}, {words}: no component, not counted",
        )

    def in_document(self, link: Any, target: Any, *, leads_back: bool = False) -> None:
        """A link within the file that brings nothing.

        leads_back
            to what holds the link, which FreeCAD cannot show.
        """
        if leads_back:
            text = f"links to {label_of(target)} in this same file: what holds it, and brings nothing"
            self._each(FindingCode.IN_DOCUMENT_LINK, link, Severity.WARNING, text)
        else:
            self._add(
                FindingCode.IN_DOCUMENT_LINK,
                self._path_of(link),
                Severity.INFO,
                "Links within the file lead to what is no part: construction geometry, not counted",
                link,
                "these are: {users}",
            )

    def consumed(self, obj: Any, feature: Any) -> None:
        self._each(
            FindingCode.CONSUMED,
            obj,
            Severity.INFO,
            f"is used up by {label_of(feature)} (a cut, a boolean or a fusion) and not counted",
        )

    def no_hardware(self, fastener: Any) -> None:
        self._add(
            FindingCode.NO_HARDWARE,
            "",
            Severity.INFO,
            "Standard parts are left out, as the settings say",
            fastener,
            "not counted: {users}",
        )

    def same_article(self, one: BomEntry, other: BomEntry) -> None:
        """One article under two standards."""
        places = {Place(*(entry.doc_path, entry.object_name)): entry.label for entry in (one, other)}
        self._notes[FindingCode.SAME_ARTICLE, f"{one.standard} {other.standard}"] = _Note(
            Severity.INFO,
            f"{one.standard} and {other.standard} are the same article under two standards: two lines.",
            users=places,
        )

    def unknown_array(self, array: Any, base: Any) -> None:
        self._each(
            FindingCode.ARRAY_SIZE,
            array,
            Severity.ERROR,
            f"is a Draft array of {label_of(base)} and does not say how many it shows; open it in FreeCAD, "
            "recompute and save",
        )

    def link_type(self, link: Any) -> None:
        """A type of link that no tested FreeCAD knows."""
        kind = getattr(link, "TypeId", "")
        if kind and kind not in _KNOWN_LINKS:
            self._add(
                FindingCode.UNKNOWN_LINK_TYPE,
                kind,
                Severity.WARNING,
                f"The object type {kind} is not known; it looks like a link and was read as one",
                link,
                "check the quantity of {users}",
            )

    def newer(self, document: Any) -> None:
        """A file that a FreeCAD saved which nothing here was tested with."""
        version = saved_by(getattr(document, "ProgramVersion", ""))
        if version > NEWEST_TESTED:
            texts = [".".join(map(str, one)) for one in (version, NEWEST_TESTED)]
            self._add(
                FindingCode.NEWER_FREECAD,
                "",
                Severity.INFO,
                f"Saved by FreeCAD {texts[0]}, newer than {texts[1]}, the newest tested",
                DocumentRoot(document),
                "the files: {users}",
            )

    def stale(self, link: Any, target: Any, gone: Sequence[str], new: Sequence[str]) -> None:
        parts = [f"no longer there: {_names(gone)}"] if gone else []
        parts += [f"not shown: {_names(new)}"] if new else []
        self._each(
            FindingCode.STALE_ASSEMBLY_LINK,
            link,
            Severity.WARNING,
            f"shows an old state of {label_of(target)} ({'; '.join(parts)}); the BOM counts the real one",
        )

    def _each(self, code: FindingCode, obj: Any, severity: Severity, text: str) -> None:
        self._add(code, str(self._place(obj)), severity, f"{label_of(obj)} {text}.", obj)

    def own_parts(self, container: Any, lines: Sequence[BomEntry]) -> None:
        """One finding per assembly: what it shows of its own file is no item yet."""
        if not lines:
            return
        links = sum(line.quantity for line in lines)
        what = "1 own part is no item" if len(lines) == 1 else f"{len(lines)} own parts are not items"
        self._add(
            FindingCode.LOCAL_GEOMETRY,
            str(self._place(container)),
            Severity.WARNING,
            f"{what} yet in {label_of(container)} (pieces: {links}): "
            f"{_names(sorted(one.label for one in lines))}. Register them, or set SiloBomExclude on them.",
            container,
        )

    def without_role(self, obj: Any) -> None:
        """The first law of counting is broken: a fault of this program."""
        self._each(FindingCode.NO_ROLE, obj, Severity.ERROR, "has no role in the count; please report this")

    def two_roles(self, obj: Any) -> None:
        """The second law is broken: a fault of this program."""
        self._each(FindingCode.TWO_ROLES, obj, Severity.ERROR, "counts in two roles; please report this")

    def container(self, top: Any) -> None:
        """The links lie in the document itself, in no assembly or part."""
        if getattr(top, "is_document_root", False):
            self._add(
                FindingCode.NO_CONTAINER,
                "",
                Severity.WARNING,
                "The components lie in the document itself, in no assembly; they were counted.",
                top,
            )

    def empty(self, head: BomEntry) -> None:
        text = f"{head.label} holds no components that are linked from other files, so its BOM is empty."
        place = Place(head.doc_path, head.object_name)
        self._notes[FindingCode.EMPTY_BOM, ""] = _Note(Severity.WARNING, text, users={place: head.label})

    def beside(self, objects: Sequence[Any], *, empty: bool = False) -> None:
        """What lies in the top document, but not in the assembly, and holds components.

        empty
            the assembly holds none at all, so it may be the wrong one.
        """
        for obj in objects:
            self._add(
                FindingCode.BESIDE_ASSEMBLY,
                "",
                Severity.ERROR if empty else Severity.WARNING,
                "Components lie in the document itself, beside the assembly"
                + (", which holds none; move them into it, or name the one that is meant" if empty else ""),
                obj,
                "not counted: {users}",
            )

    def beside_counted(self, container: Any, objects: Sequence[Any]) -> None:
        """Standard parts that lie beside an assembly, and can only belong to it."""
        for obj in objects:
            self._add(
                FindingCode.COUNTED_BESIDE,
                str(self._place(container)),
                Severity.INFO,
                f"Standard parts lie in the document beside {label_of(container)} and are counted with it",
                obj,
                "these are: {users}",
            )
