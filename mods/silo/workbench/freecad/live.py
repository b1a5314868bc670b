# SPDX-License-Identifier: LGPL-2.1-or-later
"""Live FreeCAD documents for the walker: what a link without a target has lost, and one path per file.

The walker takes FreeCAD's own objects as they are. What it cannot ask them is why a link has no target; the
target that the link has stored knows (:mod:`silo.workbench.freecad.stored_links`).
"""

from __future__ import annotations

import os
import re
import zipfile
import zlib
from collections.abc import Callable, Collection
from typing import Any

from silo.bom.entry import BomEntry, Extraction
from silo.bom.errors import DocumentError
from silo.bom.findings import Finding, FindingCode, Place, Severity
from silo.bom.key import Key
from silo.bom.message import message
from silo.bom.walk.document import LinkProblem, object_name, own, saved_by
from silo.bom.walk.links import extract, why
from silo.bom.walk.roots import choose_assembly
from silo.bom.walk.targets import is_assembly_link, is_link
from silo.platform.spelling import Spelling, one_path
from silo.workbench.freecad import host
from silo.workbench.freecad.cached import CachedDocument, FactCache
from silo.workbench.freecad.damage import damage
from silo.workbench.freecad.lost import lost_objects
from silo.workbench.freecad.opening import open_fully
from silo.workbench.freecad.stored_links import stored_target

# A document type declaration stands before the root element, which FreeCAD writes within some hundred bytes.
_BEFORE_ROOT = 1 << 16

# From this FreeCAD on Document.xml says what is hidden.
_VIEW_IN_DOCUMENT = (0, 19)
# The first FreeCAD with an Assembly workbench of its own.
ASSEMBLY_SINCE = (0, 22)


def read(path: str, assembly: str | None = None, *, hardware: bool = True) -> Extraction:
    """Open a file in this FreeCAD, unless it is open, and read its BOM. Raises DocumentError, InputError."""
    return extract_live(open_fully(path), assembly, hardware=hardware)


def read_checked(path: str, assembly: str | None = None, *, hardware: bool = True) -> Extraction:
    """Do what :func:`read` does, but do not open a file that could harm FreeCAD.

    If FreeCAD only says that it cannot open a file, the error has the reason that our reader finds. A FreeCAD
    without a window shows what the file shows, also of old files.
    """
    from silo.fcstd import Library

    _refuse_entities(path)
    try:
        document = open_fully(path)
        if not host.has_gui():
            _show_as_saved()
        return extract_live(document, assembly, hardware=hardware)
    except DocumentError:
        Library().open(path)
        raise


def _show_as_saved() -> None:
    """Hide what the view of an old file hides: a FreeCAD without a window reads no view."""
    from silo.fcstd import Library

    old = [doc for doc in host.documents() if () < saved_by(doc.getProgramVersion()) < _VIEW_IN_DOCUMENT]
    with Library() as library:
        for doc in old:
            saved = library.open(doc.FileName)
            for obj in doc.Objects:
                if own(saved.getObject(obj.Name), "Visibility", True) is False:
                    obj.Visibility = False


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
            path, message("its Document.xml declares a DOCTYPE, which FreeCAD never writes; not opened")
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

    def imported(owner: str, file: str, part: str) -> Any:
        from silo.fcstd import Library

        nonlocal library
        library = library or Library()
        return library.imported(_Owner(owner), file, part)

    return FactCache(host.is_object, imported, host.has_gui()).document(document)


def extract_object(assembly_obj: Any, *, hardware: bool = True) -> Extraction:
    """Read the BOM of one assembly object, live or of a :func:`cached_document`."""
    return extract(assembly_obj, **_walking(), hardware=hardware)


def why_object(document: Any, assembly: str, parts: Collection[Key], *, hardware: bool = True) -> list[str]:
    """Say why an assembly of an open document has this quantity of a part.

    See :func:`silo.bom.walk.links.why`.
    """
    cached = cached_document(document)
    top = cached.getObject(assembly) if assembly else choose_assembly(cached)
    if top is None:
        raise DocumentError(document.FileName, message("it no longer holds {assembly}", assembly=assembly))
    return why(top, parts, **_walking(), hardware=hardware)


def _walking() -> dict[str, Any]:
    return {"inspect": LinkInspector(), "canonical": canonical_paths(), "whole": WholeDocuments()}


def in_file(document: Any) -> Any:
    """Read the document from its file, if this FreeCAD did not know the types of some objects; None if it
    knew them all.
    """
    if not lost_objects(document):
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
        if not getattr(real, "Partial", False) and not lost_objects(real):
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
            error = damage(path, name)
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
        from silo.fcstd.values import Ref

        if self._library is None:
            self._library = Library()
        problem = self._library.follow(_Owner(owner), Ref(file=file, name=name))
        if isinstance(problem, LinkProblem):
            return problem
        if problem.TypeId.startswith("Assembly::") and host.version() < ASSEMBLY_SINCE:
            return LinkProblem(FindingCode.LOST_ASSEMBLY, file, name)
        return LinkProblem(FindingCode.BROKEN_LINK, file, name, message("FreeCAD did not load it"))


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
    text = message(
        "{label} was saved by FreeCAD {getprogramversion}; this FreeCAD {major}.{minor} "
        "cannot load its assemblies ({names}). Do not save it here, that would destroy "
        "them; open it with FreeCAD 1.0 or newer.",
        label=document.Label,
        getprogramversion=document.getProgramVersion(),
        major=major,
        minor=minor,
        names=", ".join(names),
    )
    finding = Finding(
        FindingCode.LOST_ASSEMBLY, Severity.ERROR, text, tuple(Place(path, name) for name in names)
    )
    head = BomEntry(
        doc_path=path, level=0, object_name=names[0], label=document.Label, document_label=document.Label
    )
    return Extraction(assembly=head, findings=(finding,))
