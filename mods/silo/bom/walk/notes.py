# SPDX-License-Identifier: LGPL-2.1-or-later
"""The walker's notebook: each finding once, however often it is met.

A finding reads the same whatever the order in which its objects were met: places and names are sorted.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from silo.bom.entry import BomEntry
from silo.bom.errors import DocumentError, listed
from silo.bom.findings import Finding, FindingCode, HiddenStanding, Place, Severity
from silo.bom.items.naming import display_name
from silo.bom.message import Message, counted_message, joined, message, template
from silo.bom.walk.document import DocumentRoot, LinkProblem, label_of, object_name, saved_by

_Slot = tuple[FindingCode, str]

# What may be wrong with a link; a problem with another code is a broken link.
_OF_LINKS = (
    *(FindingCode.MISSING_FILE, FindingCode.MISSING_OBJECT, FindingCode.UNREADABLE_FILE),
    *(FindingCode.LFS_POINTER, FindingCode.OUTSIDE_ROOT, FindingCode.LOST_ASSEMBLY),
    *(FindingCode.UNSET_LINK, FindingCode.CYCLE, FindingCode.DELETED_COPY),
)

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


@dataclass
class _Note:
    severity: Severity
    message: str
    tail: str = ""
    file: str = ""
    users: dict[Place, str] = field(default_factory=dict)

    def finding(self, code: FindingCode) -> Finding:
        where = sorted(self.users)
        text = self.message
        if self.tail:
            names = listed(list(dict.fromkeys(self.users[place] for place in where)), 8)
            tail = Message(self.tail, {"users": names})
            text = message("{text}; {tail}.", text=text, tail=tail)
        return Finding(code, self.severity, text, tuple(where), self.file)


class Notes:
    """Collects findings while walking; the same fact from several places becomes one finding.

    ``path_of`` gives the file of an object, the same path for one file however it was opened.
    """

    def __init__(self, path_of: Callable[[Any], str]) -> None:
        self._path_of = path_of
        self.reading = ""  # the file that is being read; for objects that do not know theirs
        self._notes: dict[_Slot, _Note] = {}

    def findings(self) -> tuple[Finding, ...]:
        """Return all findings, in the order in which they were first noted."""
        return tuple(note.finding(code) for (code, _), note in self._notes.items())

    def any_blocking(self) -> bool:
        """Return True if a finding keeps the BOM from being synced."""
        return any(note.severity is Severity.ERROR for note in self._notes.values())

    def place(self, obj: Any) -> Place:
        """Return the place of an object: its file and its name."""
        return Place(self._path_of(obj) or self.reading, object_name(obj))

    def add(
        self,
        code: FindingCode,
        obj: Any,
        about: str | None = None,
        *,
        severity: Severity | None = None,
        sentence: str = "",
        tail: str | None = None,
        **values: Any,
    ) -> _Note:
        """Note a finding about an object in the words of its code; ``values`` fill in its sentence.

        about
            findings of one code about the same thing become one, which names all objects; None: the object
            itself.
        severity, sentence, tail
            in place of those of the code.
        """
        named = {
            name: value if isinstance(value, (str, int)) else label_of(value)
            for name, value in values.items()
        }
        text = Message(sentence or code.sentence, {"obj": label_of(obj), **named})
        if named.get("detail") and code is not FindingCode.LFS_POINTER:  # whose sentence says it all
            text = message("{text} ({detail})", text=text, detail=named["detail"])
        place = self.place(obj)
        made = _Note(severity or code.severity, text, code.tail if tail is None else tail)
        note = self._notes.setdefault((code, str(place) if about is None else about), made)
        note.users.setdefault(place, label_of(obj))
        return note

    def broken(self, link: Any, problem: LinkProblem | None) -> None:
        """Report each missing file or object, naming what uses it."""
        problem = problem or LinkProblem(FindingCode.BROKEN_LINK)
        code = problem.code if problem.code in _OF_LINKS else FindingCode.BROKEN_LINK
        text = code.sentence
        if code is FindingCode.BROKEN_LINK and problem.file:
            text = template("{file} was not loaded")
        elif code is FindingCode.CYCLE:
            text = template(message("A chain of links leads back to itself"))
        about = problem.file or str(self.place(link))
        if code in _BY_OBJECT:
            about = f"{about}#{problem.obj}"
        note = self.add(
            code,
            link,
            about,
            sentence=text,
            tail=template("used by {users}") if code is FindingCode.CYCLE else None,
            file=problem.file or message("the file"),
            part=problem.obj or message("that it is asked for"),
            detail=problem.detail,
        )
        if code not in (FindingCode.UNSET_LINK, FindingCode.DELETED_COPY):
            note.file = problem.file

    def unreadable(self, obj: Any, error: DocumentError) -> None:
        """Report that the file of ``obj`` is damaged at exactly this place."""
        text, tail = (
            template("The file {file} cannot be read in full ({reason})"),
            template("not counted: {users}"),
        )
        self.add(
            FindingCode.UNREADABLE_FILE,
            obj,
            str(error),
            sentence=text,
            tail=tail,
            file=error.path,
            reason=error.reason,
        )

    def cycle(self, link: Any, ring: Sequence[tuple[str, str]]) -> None:
        """Report a cycle. ``ring``: the assemblies that contain each other, the first not repeated."""
        path = " → ".join(str(Place(*key)) for key in (*ring, ring[0]))
        self.add(FindingCode.CYCLE, link, path, path=path)

    def loop(self, obj: Any) -> None:
        text = template("{file} holds links that lead back to what holds them")
        tail = template("the ring goes through {users}")
        file = self._path_of(obj)
        self.add(FindingCode.CYCLE, obj, file, sentence=text, tail=tail, file=file or label_of(obj))

    def in_document(self, link: Any, target: Any, *, leads_back: bool = False) -> None:
        """Report a link within the file that brings nothing.

        leads_back
            to what holds the link, which FreeCAD cannot show.
        """
        code = FindingCode.IN_DOCUMENT_LINK
        if leads_back:
            text = template("{obj} links to {target} in this same file: what holds it, and brings nothing.")
            self.add(code, link, severity=Severity.WARNING, sentence=text, tail="", target=target)
        else:
            self.add(code, link, self._path_of(link))

    def same_article(self, bom_entry: BomEntry, other: BomEntry) -> None:
        """Report one article under two standards."""
        places = {Place(*(entry.doc_path, entry.object_name)): entry.label for entry in (bom_entry, other)}
        self._notes[FindingCode.SAME_ARTICLE, f"{bom_entry.standard} {other.standard}"] = _Note(
            FindingCode.SAME_ARTICLE.severity,
            message(
                "{standard} and {other_standard} are the same article under two standards: two lines.",
                standard=bom_entry.standard,
                other_standard=other.standard,
            ),
            users=places,
        )

    def link_type(self, link: Any) -> None:
        """Report a type of link that no tested FreeCAD knows."""
        kind = getattr(link, "TypeId", "")
        if kind and kind not in _KNOWN_LINKS:
            self.add(FindingCode.UNKNOWN_LINK_TYPE, link, kind, kind=kind)

    def newer(self, document: Any) -> None:
        """Report a file that a FreeCAD newer than the tested ones saved."""
        version = saved_by(getattr(document, "ProgramVersion", ""))
        if version > NEWEST_TESTED:
            texts = [".".join(map(str, each)) for each in (version, NEWEST_TESTED)]
            root = DocumentRoot(document)
            self.add(FindingCode.NEWER_FREECAD, root, "", version=texts[0], newest=texts[1])

    def stale(self, link: Any, target: Any, gone: Sequence[str], new: Sequence[str]) -> None:
        parts = [message("no longer there: {gone}", gone=listed(gone, 8))] if gone else []
        parts += [message("not shown: {new}", new=listed(new, 8))] if new else []
        self.add(FindingCode.STALE_ASSEMBLY_LINK, link, target=target, parts=joined("; ", parts))

    def own_parts(self, container: Any, lines: Sequence[BomEntry]) -> None:
        """Report, once per assembly, the parts of its own file that it shows and that are no items yet."""
        if not lines:
            return
        self.add(
            FindingCode.LOCAL_GEOMETRY,
            container,
            what=message("1 own part is no item")
            if len(lines) == 1
            else message("{count} own parts are not items", count=len(lines)),
            links=sum(line.quantity for line in lines),
            names=listed(sorted(entry.label for entry in lines), 8),
        )

    def hidden(
        self, container: Any, counted: Sequence[Any], not_counted: Sequence[Any], references: Sequence[Any]
    ) -> None:
        """Say in one sentence which hidden objects of an assembly count, and which do not."""
        groups = (
            (
                counted,
                HiddenStanding.COUNTS,
                counted_message(len(counted), "{n} piece counts", "{n} pieces count"),
            ),
            (
                not_counted,
                HiddenStanding.NOT_COUNTED,
                counted_message(len(not_counted), "{n} body does not count", "{n} bodies do not count"),
            ),
            (
                references,
                HiddenStanding.REFERENCE,
                counted_message(
                    len(references),
                    "{n} link is only a reference",
                    "{n} links are only references",
                ),
            ),
        )
        parts = [
            message("{words}: {names}", words=words, names=", ".join(map(label_of, objects)))
            for objects, _, words in groups
            if objects
        ]
        if not parts:
            return
        severity = Severity.WARNING if not_counted else None
        note = self.add(FindingCode.HIDDEN, container, what=joined("; ", parts), severity=severity)
        note.users.clear()
        for objects, standing, _ in groups:
            for obj in objects:
                place = replace(self.place(obj), label=label_of(obj), standing=standing.value)
                note.users.setdefault(place, label_of(obj))

    def one_part(self, top: Any, head: BomEntry, shown: Sequence[Any]) -> None:
        """Say of a file without an assembly that it is one part, and of what."""
        names = listed(sorted({label_of(obj) for obj in shown}), 8)
        note = self.add(FindingCode.ONE_PART, top, file=display_name(head), names=names)
        note.users.clear()
        for obj in shown:
            note.users.setdefault(self.place(obj), label_of(obj))

    def empty(self, head: BomEntry) -> None:
        text = Message(FindingCode.EMPTY_BOM.sentence, {"obj": head.label})
        place = Place(head.doc_path, head.object_name)
        note = _Note(FindingCode.EMPTY_BOM.severity, text, users={place: head.label})
        self._notes[FindingCode.EMPTY_BOM, ""] = note

    def beside(self, objects: Sequence[Any], *, empty: bool = False) -> None:
        """Report objects in the top document that hold components but are not part of the assembly.

        empty
            the assembly holds no components at all, so it may be the wrong one.
        """
        code = FindingCode.BESIDE_ASSEMBLY
        text = template(
            message(
                "Components lie in the document itself, beside the assembly, which holds none; "
                "move them into it, or name the right assembly"
            )
        )
        for obj in objects:
            severity = Severity.ERROR if empty else None
            self.add(code, obj, "", severity=severity, sentence=text if empty else code.sentence)
