# SPDX-License-Identifier: LGPL-2.1-or-later
"""Live FreeCAD documents for the walker: what a link without a target has lost, and one path per file.

The walker takes FreeCAD's own objects as they are. What it cannot ask them is why a link has no target:
``LinkedObject`` is None for a missing file, a missing object and an unset link alike. The link's stored form
knows (``dumpPropertyContent``), also while the document has unsaved edits.

The geometry as witness: the solids that FreeCAD itself shows, against those that the BOM explains.

FreeCAD says by sub-object paths what an assembly shows (:class:`host.Pieces`); nothing of the BOM goes into
that. Each object of the assembly is then compared with what its role predicts: so many components, with so
many solids each; and the lines of the BOM are compared with the roles.
"""

from __future__ import annotations

import io
import os
import re
import zipfile
import zlib
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any
from xml.sax.saxutils import unescape

from silo.bom.document import LinkProblem, object_name
from silo.bom.errors import DocumentError
from silo.bom.findings import Finding, FindingCode, Place, Severity
from silo.bom.links import extract, why
from silo.bom.model import BomEntry, Extraction, walk_entries
from silo.bom.objects import COMPONENTS, REPEATERS, Count, Key, Kind, Lost, ObjectRole, Tree, chains, kind_of
from silo.bom.roots import choose_assembly, fates, silent_reader
from silo.bom.standard import STANDARD_PARTS
from silo.bom.targets import is_assembly_link, is_link
from silo.platform import Spelling, one_path
from silo.workbench.freecad import host, saving
from silo.workbench.freecad.cached import CachedDocument, FactCache

# <XLink file="parts/b.FCStd" stamp="…" name="Box" …>, written by FreeCAD itself into memory just now.
_XLINK = re.compile(r"<XLink\b([^>]*)>")
_ATTRIBUTE = re.compile(r'(\w+)="([^"]*)"')
_ENTITIES = {"&quot;": '"', "&apos;": "'", "&#10;": "\n", "&#13;": "\r", "&#9;": "\t"}

# A document type declaration stands before the root element, which FreeCAD writes within some hundred bytes.
_BEFORE_ROOT = 1 << 16

# The first FreeCAD with an Assembly workbench of its own.
ASSEMBLY_SINCE = (0, 22)


def read(path: str, assembly: str | None = None, *, hardware: bool = True) -> Extraction:
    """Open a file in this FreeCAD, unless it is open, and read its BOM. Raises DocumentError, InputError."""
    return extract_live(saving.open_fully(path), assembly, hardware=hardware)


def read_checked(path: str, assembly: str | None = None, *, hardware: bool = True) -> Extraction:
    """Do what :func:`read` does, but do not open a file that could harm FreeCAD.

    If FreeCAD only says that it cannot open a file, the error has the reason that our reader finds.
    """
    from silo.fcstd import Library

    _refuse_entities(path)
    try:
        return read(path, assembly, hardware=hardware)
    except DocumentError:
        Library().open(path)
        raise


def _refuse_entities(path: str) -> None:
    """Refuse external entities: FreeCAD before its fix of CVE-2026-73235 follows them while it opens a
    document.
    """
    try:
        with zipfile.ZipFile(path) as file, file.open("Document.xml") as xml:
            beginning = xml.read(_BEFORE_ROOT)
    except (OSError, KeyError, RuntimeError, EOFError, zipfile.BadZipFile, zlib.error):
        return  # FreeCAD will say so
    if b"<!" in re.sub(rb"<!--.*?-->", b"", beginning.split(b"<Document")[0], flags=re.DOTALL):
        raise DocumentError(
            path, "its Document.xml declares a DOCTYPE, which FreeCAD never writes; not opened"
        )


def extract_live(document: Any, assembly: str | None = None, *, hardware: bool = True) -> Extraction:
    """Read the BOM of an open document as it is in this session, saved or not.

    If this FreeCAD could load a document only without some of its objects, its file is read instead.

    assembly
        ``Name`` or ``Label`` of the assembly, if the document holds several.
    hardware
        False leaves standard parts out.
    """
    if lost := lost_assemblies(document):
        return _lost(document, lost)
    if (whole := in_file(document)) is not None:
        return extract(choose_assembly(whole, assembly), hardware=hardware)
    cached = cached_document(document)
    return extract_object(choose_assembly(cached, assembly), hardware=hardware)


def cached_document(document: Any) -> CachedDocument:
    """Return a view of a live document for one walk. It answers quickly, and is not kept, so that it is never
    out of date.
    """
    library: Any = None

    def imported(owner: str, file: str) -> Any:
        from silo.fcstd import Library

        nonlocal library
        library = library or Library()
        return library.imported(_Owner(owner), file)

    return FactCache(host.is_object, imported).document(document)


def extract_object(assembly_obj: Any, *, hardware: bool = True) -> Extraction:
    """Read the BOM of one assembly object, live or of a :func:`cached_document`."""
    return extract(assembly_obj, **_walking(), hardware=hardware)


def why_object(document: Any, assembly: str, parts: Collection[Key], *, hardware: bool = True) -> list[str]:
    """Say why an assembly of an open document has this quantity of a part; see :func:`silo.bom.links.why`."""
    cached = cached_document(document)
    top = cached.getObject(assembly) if assembly else choose_assembly(cached)
    if top is None:
        raise DocumentError(document.FileName, f"it no longer holds {assembly}")
    return why(top, parts, **_walking(), hardware=hardware)


def _walking() -> dict[str, Any]:
    return {"inspect": LinkInspector(), "canonical": canonical_paths(), "whole": WholeDocuments()}


def in_file(document: Any) -> Any:
    """Read the document from its file, if this FreeCAD did not know the types of some objects; None if it
    knew them all.
    """
    if not saving.lost_objects(document):
        return None
    from silo.fcstd import Library

    return Library().open(document.FileName)


class WholeDocuments:
    """Gives a document with all its objects for one that FreeCAD loaded in part: read from its file.

    A document in part cannot be saved, so its file is what there is; and so is one of a newer FreeCAD, with
    objects of types that are unknown here. For one walk.
    """

    def __init__(self) -> None:
        self._library: Any = None

    def __call__(self, document: Any) -> Any:
        real = getattr(document, "real", document)
        if not hasattr(real, "getProgramVersion"):
            return document  # read from its file, so whole: the target of an import by A2plus
        if not getattr(real, "Partial", False) and not saving.lost_objects(real):
            return document
        from silo.fcstd import Library

        self._library = self._library or Library()
        try:
            return self._library.open(document.FileName)
        except DocumentError:
            return document


def canonical_paths() -> Callable[[str], str]:
    """Return a function that finds the one path of a file, and remembers it for one walk: a file opened by
    two paths is one file.
    """
    return Spelling().real


def stored_target(link: Any, name: str = "LinkedObject") -> tuple[str, str] | None:
    """Return the file and the object ``Name`` that a link has stored; ("", "") if it was never set, None if
    unknown.
    """
    stored = _stored(link, name)
    return None if stored is None else (stored.get("file", ""), stored.get("name", ""))


def stored_sub_name(link: Any) -> str:
    """Return the sub-name that a link has stored with its target."""
    return (_stored(link, "LinkedObject") or {}).get("sub", "")


def _stored(link: Any, name: str) -> dict[str, str] | None:
    try:
        packed = link.dumpPropertyContent(name, Compression=0)
        with zipfile.ZipFile(io.BytesIO(bytes(packed))) as content:
            text = content.read("Persistence.xml").decode("utf-8", "replace")
    except (AttributeError, NameError, RuntimeError, KeyError, zipfile.BadZipFile):
        return None
    element = _XLINK.search(text)
    if element is None:
        return None
    return {name: unescape(value, _ENTITIES) for name, value in _ATTRIBUTE.findall(element[1])}


class LinkInspector:
    """Says why a link has no target, or only a changed copy of a lost original; and of what links show, that
    FreeCAD opened it from a damaged file.

    For one walk, so that no file is looked at twice.
    """

    def __init__(self) -> None:
        self._library: Any = None
        self._damage: dict[tuple[str, str], LinkProblem | None] = {}

    def __call__(self, obj: Any) -> LinkProblem | None:
        """Return the problem of a link or a target; None if it is not known, or if nothing is missing."""
        return self._of_link(obj) if is_link(obj) or is_assembly_link(obj) else self._of_target(obj)

    def _of_target(self, obj: Any) -> LinkProblem | None:
        path, name = obj.Document.FileName, object_name(obj)
        if (path, name) not in self._damage:
            error = saving.damage(path, name)
            problem = None if error is None else LinkProblem(error.finding, path, name, error.reason)
            self._damage[path, name] = problem
        return self._damage[path, name]

    def _of_link(self, link: Any) -> LinkProblem | None:
        if getattr(link, "LinkedObject", None) is None:
            stored = stored_target(link)
        elif getattr(link, "LinkCopyOnChangeSource", None) is None:
            stored = stored_target(link, "LinkCopyOnChangeSource")
            stored = stored if stored != ("", "") else None
        else:
            stored = None
        if stored is None:
            return None
        file, name = stored
        if not file:
            return (
                LinkProblem(FindingCode.MISSING_OBJECT, obj=name)
                if name
                else LinkProblem(FindingCode.UNSET_LINK)
            )
        owner = getattr(link.Document, "FileName", "")
        return self._look(owner, file, name) if owner else LinkProblem(FindingCode.BROKEN_LINK, file, name)

    def _look(self, owner: str, file: str, name: str) -> LinkProblem:
        """Let the reader of files find the problem of a target, since it knows more than FreeCAD does."""
        from silo.fcstd import Library
        from silo.fcstd.properties import Ref

        if self._library is None:
            self._library = Library()
        problem = self._library.follow(_Owner(owner), Ref(file=file, name=name))
        if isinstance(problem, LinkProblem):
            return problem
        if problem.TypeId.startswith("Assembly::") and host.version() < ASSEMBLY_SINCE:
            return LinkProblem(FindingCode.LOST_ASSEMBLY, file, name)
        return LinkProblem(FindingCode.BROKEN_LINK, file, name, "FreeCAD did not load it")


class _Owner:
    """The document that holds a link, as far as the reader of files needs it."""

    def __init__(self, path: str) -> None:
        self.FileName = os.path.realpath(path)
        opened = os.path.dirname(os.path.abspath(path))
        real = os.path.dirname(self.FileName)
        self.folders = (opened, real) if real != opened else (opened,)


def lost_assemblies(document: Any) -> list[str]:
    """Return the assemblies of the file that this FreeCAD (before 1.0) could not load."""
    if host.version() >= ASSEMBLY_SINCE or (whole := in_file(document)) is None:
        return []
    return [
        object_name(obj)
        for obj in whole.Objects
        if obj.TypeId.startswith("Assembly::Assembly") and document.getObject(obj.Name) is None
    ]


def _lost(document: Any, names: list[str]) -> Extraction:
    path = one_path(document.FileName)
    major, minor = host.version()
    message = (
        f"{document.Label} was saved by FreeCAD {document.getProgramVersion()}; this FreeCAD {major}.{minor} "
        f"cannot load its assemblies ({', '.join(names)}). Do not save it here, that would destroy them; "
        "open it with FreeCAD 1.0 or newer."
    )
    finding = Finding(
        FindingCode.LOST_ASSEMBLY, Severity.ERROR, message, tuple(Place(path, name) for name in names)
    )
    head = BomEntry(
        doc_path=path, level=0, object_name=names[0], label=document.Label, document_label=document.Label
    )
    return Extraction(assembly=head, findings=(finding,))


# What is shown and not counted, on purpose.
_LEFT_OUT = (ObjectRole.LEFT_OUT, ObjectRole.OPERAND, ObjectRole.CONSTRUCTION)
_BOUGHT = COMPONENTS | {Kind.STANDARD}
_USERS = ("LinkedObject", "Base", "Source", "Links", "Objects", "Tool", "Shapes", "LinkCopyOnChangeSource")


@dataclass(frozen=True)
class SolidDifference:
    """An object that shows other solids than the BOM explains."""

    object: str
    label: str
    shown: int
    explained: int
    why: str


@dataclass
class SolidCount:
    """One assembly: the solids shown, and those that its lines explain.

    hidden
        explained, and hidden in the view: hidden components count.
    beside
        shown and explained, and lie beside the assembly.
    sources
        hidden, and shown through others only: they do not count.
    left_out
        shown, and not counted on purpose: suppressed, excluded, used up, a tool.
    """

    doc_path: str
    object: str
    label: str
    shown: int = 0
    explained: int = 0
    hidden: int = 0
    beside: int = 0
    sources: int = 0
    left_out: int = 0
    differences: list[SolidDifference] = field(default_factory=list)

    @property
    def agrees(self) -> bool:
        """Return True if every solid is explained, and every explained solid is there."""
        return not self.differences

    @property
    def unexplained(self) -> tuple[str, ...]:
        """Return the names of the objects that differ."""
        return tuple(difference.object for difference in self.differences)

    def differ(self, obj: Any, shown: int, explained: int, why: str) -> None:
        """Add a difference."""
        self.differences.append(SolidDifference(obj.Name, obj.Label, shown, explained, why))

    def sentence(self) -> str:
        """Describe the comparison in a sentence, for people."""
        solids = "1 solid" if self.shown == 1 else f"{self.shown} solids"
        text = f"{self.label}: the view has {solids}, the BOM explains {self.explained}"
        further = (
            (self.hidden, "of these hidden"),
            (self.beside, "beside the assembly"),
            (self.sources, "hidden sources that do not count"),
            (self.left_out, "left out as the findings say"),
        )
        text = ", ".join((text, *(f"{number} {words}" for number, words in further if number)))
        if self.agrees:
            return f"{text}."
        texts = [
            f"{row.label} ({row.why}: shown {row.shown}, explained {row.explained})"
            for row in self.differences[:8]
        ]
        return f"{text}. They differ; look at: {', '.join(texts)}."

    def as_dict(self) -> dict[str, Any]:
        """Return the comparison as JSON values."""
        more = {"unexplained": list(self.unexplained), "agrees": self.agrees, "sentence": self.sentence()}
        return {**asdict(self), **more}


def accounts(extraction: Extraction, *, hardware: bool = True) -> list[SolidCount]:
    """Compare the solids of the assembly and of every sub-assembly, each once; their documents are open.

    hardware
        False if the extraction leaves standard parts out.
    """
    return _Witness(hardware).accounts(extraction)


class _Witness:
    """Looks at each object once."""

    def __init__(self, hardware: bool) -> None:
        self._reader = silent_reader(hardware=hardware, counts_beside=True, inspect=LinkInspector())
        self._documents: dict[str, Any] = {}
        self._own_shapes: dict[tuple[str, str], int] = {}
        self._canonical = canonical_paths()

    def accounts(self, extraction: Extraction) -> list[SolidCount]:
        head = extraction.assembly
        document = self._document(head.doc_path)
        if document is None:
            return []
        top = document.getObject(head.object_name) if head.object_name else choose_assembly(document)
        if top is None:  # this FreeCAD is too old to load it; the extraction says so
            return []
        read = [(top, head, (*extraction.entries, *head.own))]
        for entry in walk_entries(extraction.entries):
            if entry.is_assembly and (obj := self._object(entry)) is not None:
                read.append((obj, entry, (*entry.children, *entry.own)))
        return [self._account(*account) for account in read]

    def _document(self, path: str) -> Any:
        if path not in self._documents:
            document = host.find_document(path)
            self._documents[path] = None if document is None else cached_document(document)
        return self._documents[path]

    def _object(self, entry: BomEntry) -> Any:
        document = self._document(entry.doc_path)
        return None if document is None or entry.missing else document.getObject(entry.object_name)

    def _account(self, obj: Any, head: BomEntry, lines: Sequence[BomEntry]) -> SolidCount:
        account = SolidCount(head.doc_path, head.object_name, head.label)
        contents = self._reader.contents(obj)
        roles = fates(obj, contents, self._reader)
        top, is_array = host.real(obj), kind_of(obj) in REPEATERS
        see = host.Pieces(self._own_shapes, None if is_array else top)
        own = contents.own if head.own or not contents.is_assembly(obj) else []
        predicted: Counter[str] = Counter()
        pieces: Counter[Key] = Counter()
        beside = {}
        for count in (*contents.counts, *own):
            name = object_name(count.shown.obj)
            pieces[self._component(count.target)] += count.quantity
            if not isinstance(count.target, Lost):
                predicted[name] += count.quantity * see.of(self._drawn(count, contents.tree))[0]
            if count.beside:
                beside[name] = host.real(count.shown.obj)
        if getattr(obj, "is_document_root", False):
            inside = host.root_objects(host.real(obj.Document))
        else:
            inside = host.sub_objects(top) or []
        # An array is its own only member.
        shown = [(top, True)] if is_array else _members(inside, roles)
        seen_by_path: dict[str, _Seen] = {}
        for one, is_visible in (*shown, *((member, member.Visibility) for member in beside.values())):
            seen_by_path.setdefault(one.Name, _Seen(one)).add(see.of(one, is_visible))
        for name in {**seen_by_path, **predicted}:
            seen = seen_by_path.get(name) or _Seen(obj.Document.getObject(name))
            account.shown += seen.shown
            account.left_out += seen.left_out
            account.beside += seen.shown if name in beside else 0
            account.explained += predicted[name]
            _judge(account, seen, roles, predicted[name], may_hide=name not in beside)
        if own or not contents.own:  # a part is not an assembly of its bodies
            self._compare_lines(account, lines, pieces)
        return account

    def _drawn(self, count: Count, tree: Tree | None) -> Any:
        """Return the component; if it is not open in FreeCAD, the object that stands for it in the
        assembly.
        """
        if host.is_object(host.real(count.target)):
            return count.target
        return next(chains(count, tree))[-1][0]

    def _component(self, target: Any) -> Key:
        path, name = target.key if isinstance(target, Lost) else self._reader.component(target)
        return (path if path == STANDARD_PARTS else self._canonical(path), name)

    def _compare_lines(self, account: SolidCount, lines: Sequence[BomEntry], pieces: Counter[Key]) -> None:
        """Report lines whose quantity differs from the number of pieces, and pieces without a line."""
        left = Counter(pieces)
        for line in lines:
            registered = (line.doc_path, line.object_name)
            key = registered if registered in pieces or not line.standard else (STANDARD_PARTS, line.standard)
            left[key] -= line.quantity
        for (path, name), number in left.items():
            if number:
                total = pieces[path, name]
                account.differences.append(
                    SolidDifference(name, name, total, total - number, "line of the BOM")
                )


def _members(
    listed: Sequence[tuple[Any, bool]], roles: Mapping[str, ObjectRole | None], visible: bool = True
) -> Iterator[tuple[Any, bool]]:
    """Yield each object that is not only a holder, once for each path, with its visibility there."""
    for member, is_visible in listed:
        if roles.get(member.Name) is ObjectRole.HOLDER:
            yield from _members(host.sub_objects(member) or [], roles, visible and is_visible)
        else:
            yield member, visible and is_visible


@dataclass
class _Seen:
    """The solids of one object over all paths to it."""

    obj: Any
    shown: int = 0
    hidden: int = 0
    left_out: int = 0

    def add(self, solids: tuple[int, int, int]) -> None:
        self.shown += solids[0]
        self.hidden += solids[1]
        self.left_out += solids[2]


def _judge(
    account: SolidCount,
    seen: _Seen,
    roles: Mapping[str, ObjectRole | None],
    explained: int,
    *,
    may_hide: bool,
) -> None:
    obj, role = seen.obj, roles.get(seen.obj.Name)
    kind = kind_of(obj)
    is_source = _is_used_by(obj, roles)
    if seen.shown == explained:
        if role is ObjectRole.SOURCE and is_source:
            account.sources += seen.hidden
        elif seen.hidden and not explained and role not in _LEFT_OUT and kind in _BOUGHT:
            account.differ(obj, 0, 0, "hidden and not counted")
    elif seen.shown < explained <= seen.shown + seen.hidden and may_hide and (seen.shown or not is_source):
        account.hidden += explained - seen.shown
    elif not explained and role in _LEFT_OUT and not (role is ObjectRole.CONSTRUCTION and kind in _BOUGHT):
        account.left_out += seen.shown
    else:
        account.differ(obj, seen.shown, explained, "no role" if role is None else role.value)


def _is_used_by(obj: Any, others: Mapping[str, ObjectRole | None]) -> bool:
    """Return True if one of these objects shows or consumes this one: a link, an array, a compound, a cut."""
    for user in obj.InList:
        for name in _USERS if user.Document == obj.Document and user.Name in others else ():
            value = getattr(user, name, None) if name in user.PropertiesList else None
            if obj in (value if isinstance(value, list | tuple) else (value,)):
                return True
    return False
