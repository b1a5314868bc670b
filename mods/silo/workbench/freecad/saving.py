# SPDX-License-Identifier: LGPL-2.1-or-later
"""Documents and their files: open them whole, know their unsaved edits, save them, write identities.

No edit is lost and nothing is half written: what FreeCAD would silently not do is an error here. FreeCAD's
main thread only.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from silo.platform import stamp_of
from silo.workbench.freecad import host
from silo.workbench.freecad.edits import EditWatch

if TYPE_CHECKING:
    from silo.fcstd.container import FcstdError

DAMAGED = (
    "FreeCAD opens what it can of a damaged file, and saving that would make the loss final: fetch the file "
    "again, or check that nothing is missing and save it in FreeCAD yourself"
)

# File and object → the file's state when all that the object needs could be read.
_SOUND: dict[tuple[str, str], object] = {}
_REMEMBERED = 20_000


def is_modified(doc: Any) -> bool:
    """Return True if the document has edits that are not on disk."""
    if not host.has_gui():
        return bool(doc.isTouched()) if hasattr(doc, "isTouched") else False
    view = host.view_of(doc)
    return bool(view is not None and view.Modified)


@cache
def watch_edits() -> EditWatch:
    """Watch edits from now on, for :func:`is_edited`."""
    watch = EditWatch()
    watch.begin([doc for doc in host.documents() if not is_modified(doc)])
    host.add_document_observer(watch)
    return watch


def is_edited(doc: Any, until: float) -> bool:
    """Return True if a modified document differs from its file; False if it was only recomputed.

    until
        the time (``time.thread_time``) after which nothing more is compared; the rest counts as edited.
    """
    return watch_edits().is_edited(doc, until)


def open_fully(path: str) -> Any:
    """Open the document of a file with all its objects, or complete it if it is open in part.

    FreeCAD completes a partly loaded document by closing and reading it again, so unsaved edits in it would
    be lost. In this case, and if the file cannot be read, it raises :class:`DocumentError`.
    """
    from silo.bom.errors import DocumentError

    document = host.find_document(path)
    if document is not None and not host.is_partial(document):
        return document
    if document is not None and is_modified(document):
        raise DocumentError(
            path, "FreeCAD has loaded it only in part and it has unsaved edits, which opening it would lose"
        )
    with host.same_active_document():
        try:
            return host.open_document(document.FileName if document is not None else path)
        except (OSError, RuntimeError) as problem:
            raise DocumentError(path, f"FreeCAD cannot open it: {problem}") from problem


def damage(path: str, name: str = "") -> FcstdError | None:
    """Find why a file cannot be read as far as an object in it needs ("": to its end); None if it can.

    FreeCAD reads a file from its beginning and opens what it finds: objects without shapes if the file is cut
    short, some of the objects if its Document.xml is damaged. At most it says so in the report view. A file
    that is missing or may not be read is no damage: the session keeps what it has.
    """
    from silo.bom.findings import FindingCode
    from silo.fcstd import Library
    from silo.fcstd.container import ANY_SIZE, FcstdError, FileState
    from silo.fcstd.xmltext import Refused

    if not path or not os.access(path, os.R_OK):
        return None
    try:
        state = FileState.of(os.stat(path))
        if _SOUND.get((path, name)) == state:
            return None
        with Library(limits=ANY_SIZE) as library:
            document = library.glance(path)
            if not name:
                document.complete()
            elif (obj := document.getObject(name)) is not None:
                document.check(obj)
    except FcstdError as error:
        sound = error.finding is FindingCode.MISSING_FILE or isinstance(error.__cause__, Refused)
        return None if sound else error
    except OSError:
        return None
    if len(_SOUND) >= _REMEMBERED:
        _SOUND.clear()
    _SOUND[path, name] = state
    return None


# File → its state, and the name, label and type of each object of a type that this FreeCAD does not know.
_UNKNOWN: dict[str, tuple[object, dict[str, tuple[str, str]]]] = {}


def lost_objects(doc: Any) -> list[str]:
    """List the objects of a document's file that this FreeCAD could not load: "LCS (App::Point)".

    FreeCAD drops objects of types that it does not know, and says so only in the report view; saving the
    document then destroys them in the file. Only the version that saved the file is checked first, since
    reading each file takes too long.
    """
    if not doc.FileName or _is_ours(doc.getProgramVersion()):
        return []
    return [
        f"{label} ({kind})"
        for name, (label, kind) in _of_unknown_types(doc).items()
        if doc.getObject(name) is None
    ]


def refuse_loss(doc: Any) -> None:
    """Raise DocumentError for a document whose saving would destroy objects of a newer FreeCAD."""
    from silo.bom.errors import DocumentError

    if lost := lost_objects(doc):
        text = f"made by a newer FreeCAD; saving it here would destroy {', '.join(lost)}"
        raise DocumentError(doc.FileName, f"{text}. Open and change it in the newer FreeCAD")


def _is_ours(program: str) -> bool:
    from silo.bom.document import saved_by  # late: FreeCAD's start waits for this module

    by = saved_by(program)
    return bool(by) and by[:2] <= host.version()


def _of_unknown_types(doc: Any) -> dict[str, tuple[str, str]]:
    from silo.bom.errors import DocumentError
    from silo.fcstd import Library
    from silo.fcstd.container import ANY_SIZE, FileState

    path = doc.FileName
    try:
        state = FileState.of(os.stat(path))
        if (types_unknown := _UNKNOWN.get(path)) is not None and types_unknown[0] == state:
            return types_unknown[1]
        with Library(limits=ANY_SIZE) as library:
            document = library.open(path)
            types = frozenset(() if _is_ours(document.ProgramVersion) else doc.supportedTypes())
            objects = [obj for obj in document.Objects if types and obj.TypeId not in types]
            unknown = {
                obj.Name: (obj.Label, obj.TypeId) for obj in objects if not _is_made_again(obj, objects)
            }
    except (OSError, DocumentError):
        return {}
    _UNKNOWN[path] = state, unknown
    return unknown


def _is_made_again(obj: Any, unknown: list[Any]) -> bool:
    """Return True for the point of an origin to which nothing else refers: FreeCAD 1.1 makes it again if it
    is missing.

    Each origin of 1.1 has such a point, and so each file with a body.
    """
    if obj.TypeId != "App::Point":
        return False
    # A coordinate system that is lost as well is named itself.
    lost = {other.Name for other in unknown}
    others = [obj.Document.getObject(name) for name in obj.Document.mentioning(obj.Name) if name not in lost]
    return all(other.TypeId == "App::Origin" for other in others)


def save(doc: Any, *, mark_parents: bool = False) -> None:
    """Save a document to its file; :class:`DocumentError` unless the file was really written.

    mark_parents
        let FreeCAD mark the documents that link to this one; the caller saves them as well.
    """
    from silo.bom.errors import DocumentError

    path = doc.FileName
    if not path:
        raise DocumentError(doc.Label, "it has never been saved; save it under a name first")
    if host.is_partial(doc):
        raise DocumentError(path, "FreeCAD has loaded it only in part and cannot save it")
    if not is_writable(path):
        raise DocumentError(path, "the file is read-only")
    if (damaged := damage(path)) is not None:
        raise DocumentError(path, f"{damaged.reason}; {DAMAGED}")
    refuse_loss(doc)
    before = stamp_of(path)
    try:
        with nullcontext() if mark_parents else others_unmarked(doc):
            _save(doc)
    except (OSError, RuntimeError) as problem:
        raise DocumentError(path, f"FreeCAD could not save it: {problem}") from problem
    if stamp_of(path) == before:
        raise DocumentError(path, "FreeCAD did not write the file; its report view says why")


def _save(doc: Any) -> None:
    view = host.view_of(doc) if host.has_gui() else None
    if view is None:
        doc.save()
    elif host.version() >= (0, 21):
        doc.save()
        view.Modified = False
    elif not view.Modified:
        doc.save()
    else:
        # In 0.20 only FreeCAD's own save takes the mark of unsaved edits away.
        from silo.workbench.gui.widgets import save_in_view

        save_in_view(doc)


def mark_modified(name: str) -> None:
    """Mark the document of this name as one with edits that are not on disk."""
    for doc in (document for document in host.documents() if document.Name == name):
        if host.version() < (0, 21):
            for obj in doc.Objects[:1]:
                obj.touch()  # 0.20 takes no mark, and marks a document for this
        elif (view := host.view_of(doc)) is not None:
            view.Modified = True


@contextmanager
def others_unmarked(doc: Any = None) -> Iterator[None]:
    """Keep other documents unmarked while this one is changed and saved; None: all of them.

    FreeCAD marks each document that links to a saved one, because it keeps the time of saving of that (0.20
    does so whatever we do), and each document that shows an axis cross, because the size of the cross
    changes. Nobody edited them.
    """
    clean = [other for other in host.documents() if other != doc and not is_modified(other)]
    if not host.has_gui():
        yield
    elif host.version() >= (0, 21):
        yield
        for other in clean:
            if is_modified(other):
                host.view_of(other).Modified = False
    else:
        with ExitStack() as stack:
            for other in clean:
                for obj in other.Objects:
                    if obj.TypeId in ("App::Origin", "App::Line", "App::Plane"):
                        stack.enter_context(_unmarking(obj.ViewObject, "Size"))
            yield


@contextmanager
def _unmarking(owner: Any, name: str) -> Iterator[None]:
    """Keep a change of this property from marking the document as edited."""
    if name not in owner.PropertiesList:
        yield
        return
    owner.setPropertyStatus(name, "NoModify")
    try:
        yield
    finally:
        owner.setPropertyStatus(name, "-NoModify")


def save_copy(doc: Any, path: Path) -> None:
    """Write a document, with its unsaved edits, to another file. DocumentError unless that was written.

    A document that FreeCAD has loaded only in part cannot be written; its file is copied.
    """
    from silo.bom.errors import DocumentError

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if host.is_partial(doc):
            shutil.copy2(doc.FileName, path)
        else:
            doc.saveCopy(str(path))
    except (OSError, RuntimeError) as problem:
        raise DocumentError(str(path), f"no copy could be kept: {problem}") from problem
    if not path.is_file():
        raise DocumentError(str(path), "FreeCAD wrote no copy; its report view says why")


def save_marked(doc: Any) -> None:
    """Save a document that FreeCAD marked because something below it was saved, if that is possible."""
    from silo.bom.errors import DocumentError

    if is_modified(doc) and not host.is_partial(doc):
        # If it cannot be saved, FreeCAD's mark is right.
        with suppress(DocumentError):
            save(doc, mark_parents=True)


def is_writable(path: str) -> bool:
    """Return True if the file may be replaced; a file marked read-only may not."""
    folder = os.path.dirname(path) or "."
    if not os.path.exists(path):
        return os.access(folder, os.W_OK)
    marked = not os.stat(path).st_mode & 0o222
    return os.access(path, os.W_OK) and os.access(folder, os.W_OK) and not marked


def write_identity(doc: Any, name: str, identity: str, *, whole_document: bool) -> None:
    """Write a Silo identity in every place that survives in all versions; the caller saves.

    name
        ``Name`` of the component's object; "" for the document itself.
    whole_document
        the document is this one component, so it carries the identity as well. Otherwise only the object has
        the identity (:mod:`silo.bom.model` says where it is looked for).
    """
    from silo.bom.errors import DocumentError
    from silo.bom.model import meta_key

    obj = doc.getObject(name) if name else None
    if name and obj is None:
        raise DocumentError(doc.FileName, f"it has no object {name} any more")
    with others_unmarked(doc):
        if obj is not None:
            _set(obj, "SiloItemId", identity)
            if "SiloUUID" in obj.PropertiesList:
                _set(obj, "SiloUUID", identity)
        # Meta gives a copy: only assigning a whole dictionary changes it.
        doc.Meta = {**doc.Meta, meta_key("" if whole_document else name): identity}
        if whole_document and hasattr(doc, "addProperty"):
            _set(doc, "SiloUUID", identity)


def remove_identity(doc: Any, name: str, *, no_part: bool = False, whole_document: bool = False) -> None:
    """Remove the identity of one object from every place. The caller saves.

    no_part
        the object gets ``SiloBomExclude``, since a person decided that it is no part. Otherwise the property
        is removed.
    whole_document
        the document's own identity is removed too; otherwise it stays.
    """
    from silo.bom.model import meta_key

    obj = doc.getObject(name)
    with others_unmarked(doc):
        for place in ("SiloItemId", "SiloUUID", "SiloBomExclude") if obj is not None else ():
            if place in obj.PropertiesList and not obj.removeProperty(place):
                _set(obj, place, type(obj.getPropertyByName(place))())
        if obj is not None and no_part:
            _set(obj, "SiloBomExclude", True, "App::PropertyBool", "True: no part of any BOM", locked=False)
        gone = {meta_key(name), *([meta_key()] if whole_document else [])}
        doc.Meta = {key: value for key, value in doc.Meta.items() if key not in gone}
        if whole_document and "SiloUUID" in getattr(doc, "PropertiesList", ()):
            _set(doc, "SiloUUID", "")


# FreeCAD's number for "a change of it asks for no recompute" (Prop_Output of App::PropertyType).
_OUTPUT = 8


def _set(
    owner: Any,
    name: str,
    value: Any,
    kind: str = "App::PropertyString",
    tip: str = "Identity of the item in Silo",
    *,
    locked: bool = True,
) -> None:
    """Set a property without touching its object.

    A touched object touches all links to it, and the next recompute marks their documents as edited.
    """
    if name not in owner.PropertiesList:
        owner.addProperty(kind, name, "Silo", tip, _OUTPUT, locked)
    if hasattr(owner, "State") and "Output" not in owner.getPropertyStatus(name):
        owner.setPropertyStatus(name, "Output")
    setattr(owner, name, value)
