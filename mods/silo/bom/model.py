# SPDX-License-Identifier: LGPL-2.1-or-later
"""The values that travel: BOM entries, and what a comparison with the server says of them.

All are frozen. Equality is that of the spec's fields and the component's key; where a value was found
(labels, places) and what follows from the component itself takes no part in it.

A component's Silo identity is read in this order (the real Silo writes ``SiloItemId`` on objects, the spec
``SiloUUID`` on documents):

1. the object's own ``SiloItemId``, then its own ``SiloUUID``;
2. ``Meta["SiloUUID/<object Name>"]`` of its document: one file may give several parts, and FreeCAD 0.20 has
   no document properties but keeps ``Meta``;
3. the document's ``SiloUUID`` property;
4. ``Meta["SiloUUID"]`` of its document.

Part numbers are never parsed, and never taken from labels.

:class:`Notes` is the walker's notebook: each finding once, however often it is met. A finding reads the
same whatever the order in which its objects were met: places and names are sorted.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, TypeVar
from uuid import UUID

from silo.bom.document import (
    DocumentRoot,
    LinkProblem,
    document_property,
    label_of,
    object_name,
    own,
    saved_by,
)
from silo.bom.errors import DocumentError, listed
from silo.bom.findings import Finding, FindingCode, Place, Severity
from silo.bom.standard import STANDARD_PARTS, standard_uuid

T = TypeVar("T")


class Frozen(tuple[T, ...]):
    """A tuple that also equals a list of equal items: the spec's values hold lists, ours cannot change."""

    __slots__ = ()

    def __eq__(self, other: object) -> bool:
        return tuple.__eq__(self, tuple(other) if isinstance(other, list) else other)

    def __ne__(self, other: object) -> bool:
        return not self == other

    __hash__ = tuple.__hash__


def _freeze(value: object, *names: str) -> None:
    """Turn these fields into tuples: a caller may give any iterable, but a frozen value holds a tuple."""
    for name in names:
        if type(given := getattr(value, name)) is not Frozen:
            object.__setattr__(value, name, Frozen(given))


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
        what an assembly shows of its own file and is no item yet: never sent, until a person declares it.
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

    def __post_init__(self) -> None:
        _freeze(self, "children", "instances", "also", "unregistered", "own")

    @property
    def key(self) -> tuple[str, str]:
        """Return the key of a component: (file, object), or the designation of a standard part. Never a
        label.
        """
        if self.is_standard:
            return (STANDARD_PARTS, self.standard or "")
        return (self.doc_path, self.object_name)

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
        _freeze(self, "entries", "findings")

    @property
    def blocked(self) -> bool:
        """Return True if a finding keeps this BOM from being synced."""
        return any(f.severity is Severity.ERROR for f in self.findings)

    def findings_of(self, *codes: FindingCode) -> tuple[Finding, ...]:
        """Return the findings with one of these codes, in order."""
        return tuple(f for f in self.findings if f.code in codes)


class Row(Mapping[str, Any]):
    """A frozen row that reads as a mapping (the spec's dicts) and as attributes; equal to an equal dict."""

    def __getitem__(self, key: str) -> Any:
        if key not in self._names():
            raise KeyError(key)
        return getattr(self, key)

    def __iter__(self) -> Iterator[str]:
        return iter(self._names())

    def __len__(self) -> int:
        return len(self._names())

    def _names(self) -> tuple[str, ...]:
        return tuple(f.name for f in fields(self))  # type: ignore[arg-type]


@dataclass(frozen=True, eq=False)
class BomChange(Row):
    """A part number and its quantity (added, removed, unchanged, manual)."""

    part_number: str
    quantity: float | None

    def __hash__(self) -> int:
        return hash((self.part_number, self.quantity))


@dataclass(frozen=True, eq=False)
class QuantityChange(Row):
    """A line that both sides have, with different quantities (changed, or a conflict with a manual line).

    unit
        that of the server's quantity if it does not count pieces, as CAD does; else no key of the mapping.
    """

    part_number: str
    local_quantity: float
    remote_quantity: float | None
    unit: str = ""

    def _names(self) -> tuple[str, ...]:
        return ("part_number", "local_quantity", "remote_quantity", *(("unit",) if self.unit else ()))

    def __hash__(self) -> int:
        return hash((self.part_number, self.local_quantity, self.remote_quantity))

    def on_server(self, written: str) -> str:
        """Return the server's quantity, as the caller writes it, with its unit."""
        return f"{written} {self.unit}".rstrip()


@dataclass(frozen=True)
class BomDiff:
    """CAD against server, by the spec's §4 table.

    added              in the assembly, not on the server          → will be added
    quantity_changed   assembly line with another quantity         → will take the assembly's quantity
    removed            assembly line, not in the assembly now      → stays, flagged unreferenced
    unchanged          both, same quantity                         → nothing
    manual             lines that people own                       → never touched, listed apart
    conflicts          in the assembly, and manual with another quantity → a person decides
    kept               lines of components that are missing now        → stay as they are
    """

    added: tuple[BomChange, ...] = ()
    removed: tuple[BomChange, ...] = ()
    quantity_changed: tuple[QuantityChange, ...] = ()
    unchanged: tuple[BomChange, ...] = ()
    manual: tuple[BomChange, ...] = ()
    conflicts: tuple[QuantityChange, ...] = ()
    kept: tuple[BomChange, ...] = ()

    def __post_init__(self) -> None:
        _freeze(self, *(f.name for f in fields(self)))

    @property
    def drifted(self) -> bool:
        """Return True if CAD and server differ in a way that a check reports."""
        return bool(self.added or self.removed or self.quantity_changed or self.conflicts)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Make findings of what the comparison leaves to a person; :meth:`findings_at` adds the place."""
        return self.findings_at()

    def findings_at(self, parent: BomEntry | None = None) -> tuple[Finding, ...]:
        """Report unreferenced lines in one finding, each conflict in one. ``parent``: the assembly
        compared.
        """
        places = (Place(parent.doc_path, parent.object_name),) if parent is not None else ()
        findings = []
        if self.removed:
            count, numbers = len(self.removed), ", ".join(change.part_number for change in self.removed)
            items = "1 item in the Silo BOM is" if count == 1 else f"{count} items in the Silo BOM are"
            message = (
                f"{items} not referenced by components in this assembly. Nothing was deleted: {numbers}."
            )
            findings.append(Finding(FindingCode.UNREFERENCED, Severity.WARNING, message, places))
        for change in self.conflicts:
            kept = "no quantity" if change.remote_quantity is None else f"{change.remote_quantity:g}"
            kept = change.on_server(kept)
            message = (
                f"{change.part_number}: the assembly has {change.local_quantity:g}, a line kept by hand in "
                f"the Silo BOM has {kept}. It stays as it is until somebody decides."
            )
            findings.append(Finding(FindingCode.CONFLICT, Severity.WARNING, message, places))
        return tuple(findings)


def rows_as_dicts(rows: Iterable[Row]) -> list[dict[str, Any]]:
    """Return dicts of plain values, for JSON."""
    return [dict(row) for row in rows]


META_KEY = "SiloUUID"


def meta_key(obj_name: str = "") -> str:
    """Return the key in ``Meta`` for the identity of the whole document, or of one of its objects."""
    return f"{META_KEY}/{obj_name}" if obj_name else META_KEY


def _text(value: object) -> str | None:
    return value.strip() or None if isinstance(value, str) else None


def identity_of(obj: object) -> str | None:
    """Return the Silo UUID of a component (the real part or assembly, not a link to it); None while
    unregistered.
    """
    return own_identity(obj) or document_identity(getattr(obj, "Document", None))


def as_uuid(text: str) -> str:
    """Return a UUID in its one written form; "" if the text is none. Files have it in capitals, or in
    braces.
    """
    try:
        return str(UUID(text))
    except ValueError:
        return ""


def own_identity(obj: object) -> str | None:
    """Return the identity that is written for this very object, not that of its document."""
    for name in ("SiloItemId", "SiloUUID"):
        if identity := _text(own(obj, name)):
            return identity
    name = object_name(obj)
    return _text(_meta(getattr(obj, "Document", None)).get(meta_key(name))) if name else None


def document_identity(doc: object) -> str | None:
    """Return the identity that is written for the whole document."""
    if doc is None:
        return None
    return _text(document_property(doc, "SiloUUID")) or _text(_meta(doc).get(META_KEY))


def held_items(doc: object) -> tuple[tuple[str, str], ...]:
    """Return the items that a document says it holds: (identity, object), in document order.

    The object is "" for the identity of the file as a whole, which comes first.
    """
    whole = document_identity(doc)
    own = [(own_identity(obj), object_name(obj)) for obj in getattr(doc, "Objects", None) or ()]
    return (*([(whole, "")] if whole else ()), *((identity, name) for identity, name in own if identity))


def sole_identity(doc: object) -> str | None:
    """Return the item to which a file without an assembly belongs; None if it has several or none."""
    if whole := document_identity(doc):
        return whole
    items = {identity for identity, _ in held_items(doc)}
    return items.pop() if len(items) == 1 else None


def _meta(doc: object) -> Mapping[str, str]:
    meta = getattr(doc, "Meta", None)
    return meta if isinstance(meta, Mapping) else {}


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


def identity_findings(entries: Iterable[BomEntry]) -> tuple[Finding, ...]:
    """Find one UUID in two files ("copied identity"), or on two parts of one file ("shared identity")."""
    users: dict[str, dict[tuple[str, str], BomEntry]] = {}
    for entry in sorted(walk_entries(entries), key=lambda entry: entry.key):
        if entry.silo_uuid:
            users.setdefault(entry.silo_uuid.lower(), {})[entry.key] = entry
    findings = []
    for uuid, components in users.items():
        if len(components) < 2:
            continue
        where = tuple(Place(*key) for key in components)
        if len({place.doc_path for place in where}) > 1:
            findings.append(copied_identity(uuid, where))
            continue
        code, names = FindingCode.SHARED_IDENTITY, [entry.label for entry in components.values()]
        message = code.sentence.format(
            count=len(names), file=where[0].doc_path, identity=uuid, names=", ".join(names)
        )
        findings.append(Finding(code, code.severity, message, where))
    return tuple(findings)


def copied_identity(uuid: str, where: tuple[Place, ...]) -> Finding:
    """Make the finding that several files carry one identity."""
    code, files = FindingCode.COPIED_IDENTITY, list(dict.fromkeys(place.doc_path for place in where))
    message = code.sentence.format(count=len(files), identity=uuid, names=", ".join(files))
    return Finding(code, code.severity, message, where)


_Slot = tuple[FindingCode, str]

# What may be wrong with a link; a problem with another code is a broken link.
_OF_LINKS = (
    *(FindingCode.MISSING_FILE, FindingCode.MISSING_OBJECT, FindingCode.UNREADABLE_FILE),
    *(FindingCode.LFS_POINTER, FindingCode.OUTSIDE_ROOT, FindingCode.LOST_ASSEMBLY),
    *(FindingCode.UNSET_LINK, FindingCode.CYCLE),
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
        message = self.message
        if self.tail:
            names = listed(list(dict.fromkeys(self.users[place] for place in where)), 8)
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
        message = (sentence or code.sentence).format(obj=label_of(obj), **named)
        place = self.place(obj)
        made = _Note(severity or code.severity, message, code.tail if tail is None else tail)
        note = self._notes.setdefault((code, str(place) if about is None else about), made)
        note.users.setdefault(place, label_of(obj))
        return note

    def broken(self, link: Any, problem: LinkProblem | None) -> None:
        """Report each missing file or object, naming what uses it."""
        problem = problem or LinkProblem(FindingCode.BROKEN_LINK)
        code = problem.code if problem.code in _OF_LINKS else FindingCode.BROKEN_LINK
        text = code.sentence
        if code is FindingCode.BROKEN_LINK and problem.file:
            text = "{file} was not loaded"
        elif code is FindingCode.CYCLE:
            text = "A chain of links leads back to itself"
        about = problem.file or str(self.place(link))
        if code in _BY_OBJECT:
            about = f"{about}#{problem.obj}"
        note = self.add(
            code,
            link,
            about,
            sentence=f"{text} ({{detail}})" if problem.detail else text,
            tail="used by {users}" if code is FindingCode.CYCLE else None,
            file=problem.file or "the file",
            part=problem.obj or "that it is asked for",
            detail=problem.detail,
        )
        if code is not FindingCode.UNSET_LINK:
            note.file = problem.file

    def unreadable(self, obj: Any, error: DocumentError) -> None:
        """Report that the file of ``obj`` is damaged at exactly this place."""
        text, tail = "The file {file} cannot be read in full ({reason})", "not counted: {users}"
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
        text, tail = "{file} holds links that lead back to what holds them", "the ring goes through {users}"
        file = self._path_of(obj)
        self.add(FindingCode.CYCLE, obj, file, sentence=text, tail=tail, file=file or label_of(obj))

    def in_document(self, link: Any, target: Any, *, leads_back: bool = False) -> None:
        """Report a link within the file that brings nothing.

        leads_back
            to what holds the link, which FreeCAD cannot show.
        """
        code = FindingCode.IN_DOCUMENT_LINK
        if leads_back:
            text = "{obj} links to {target} in this same file: what holds it, and brings nothing."
            self.add(code, link, severity=Severity.WARNING, sentence=text, tail="", target=target)
        else:
            self.add(code, link, self._path_of(link))

    def same_article(self, bom_entry: BomEntry, other: BomEntry) -> None:
        """Report one article under two standards."""
        places = {Place(*(entry.doc_path, entry.object_name)): entry.label for entry in (bom_entry, other)}
        self._notes[FindingCode.SAME_ARTICLE, f"{bom_entry.standard} {other.standard}"] = _Note(
            FindingCode.SAME_ARTICLE.severity,
            f"{bom_entry.standard} and {other.standard} are the same article under two standards: two lines.",
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
            texts = [".".join(map(str, version_parts)) for version_parts in (version, NEWEST_TESTED)]
            root = DocumentRoot(document)
            self.add(FindingCode.NEWER_FREECAD, root, "", version=texts[0], newest=texts[1])

    def stale(self, link: Any, target: Any, gone: Sequence[str], new: Sequence[str]) -> None:
        parts = [f"no longer there: {listed(gone, 8)}"] if gone else []
        parts += [f"not shown: {listed(new, 8)}"] if new else []
        self.add(FindingCode.STALE_ASSEMBLY_LINK, link, target=target, parts="; ".join(parts))

    def own_parts(self, container: Any, lines: Sequence[BomEntry]) -> None:
        """Report, once per assembly, the parts of its own file that it shows and that are no items yet."""
        if not lines:
            return
        self.add(
            FindingCode.LOCAL_GEOMETRY,
            container,
            what="1 own part is no item" if len(lines) == 1 else f"{len(lines)} own parts are not items",
            links=sum(line.quantity for line in lines),
            names=listed(sorted(entry.label for entry in lines), 8),
        )

    def empty(self, head: BomEntry) -> None:
        text = FindingCode.EMPTY_BOM.sentence.format(obj=head.label)
        place = Place(head.doc_path, head.object_name)
        note = _Note(FindingCode.EMPTY_BOM.severity, text, users={place: head.label})
        self._notes[FindingCode.EMPTY_BOM, ""] = note

    def beside(self, objects: Sequence[Any], *, empty: bool = False) -> None:
        """Report objects in the top document that hold components but are not part of the assembly.

        empty
            the assembly holds no components at all, so it may be the wrong one.
        """
        code = FindingCode.BESIDE_ASSEMBLY
        more = ", which holds none; move them into it, or name the right assembly" if empty else ""
        for obj in objects:
            severity = Severity.ERROR if empty else None
            self.add(code, obj, "", severity=severity, sentence=code.sentence + more)
