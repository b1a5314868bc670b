# SPDX-License-Identifier: LGPL-2.1-or-later
"""A project folder and Silo: which files belong to a commit, how each stands, and what is sent.

The one rule of what belongs to a commit, for the add-on and the command line: what the committed files link
to inside the project's root, with themselves, if it differs from what is in Silo. Backups, locks and hidden
files are not files of the project; a link out of the root is reported, and so is one to nothing.

The file of one item goes to that item. A file of several items or of none has a UUID of its own, which the
project remembers (:class:`silo.project_folder.Project`) before the first request. A file that is known by its
identity and lies at another place than before has moved.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any
from uuid import uuid4

from silo.api.address import canonical
from silo.api.files import DocumentId
from silo.api.revisions import checksum_of
from silo.api.wire import Revision
from silo.bom.entry import Extraction
from silo.bom.errors import (
    DocumentError,
    InputError,
    NotFoundError,
    RouteMissingError,
    SeveralAssembliesError,
)
from silo.bom.message import message
from silo.bom.walk.identity import held_items
from silo.bom.walk.links import extract, file_bom
from silo.bom_sync.memory import server_of
from silo.bom_sync.resolved import resolve
from silo.bom_sync.steps import Status, decide, server_lines
from silo.checksums import content_hash
from silo.fcstd import Library
from silo.fcstd.linked import recorded_paths
from silo.file_state import ON_TOP, FileState, file_state, remembered_state
from silo.files import documents_in
from silo.locator import FoundFile, Locator
from silo.outbox.entry import SAME_PART, UNKNOWN, Commit, Entry, InFile, State, new_key, on_top
from silo.outbox.held_here import HeldHere
from silo.outbox.recorded import arrived
from silo.outbox.store import Store
from silo.platform.spelling import one_path
from silo.project_folder import FileRecord, Project
from silo.vault.former import documents_now, record_for
from silo.vault.revisions import file_revisions

if TYPE_CHECKING:
    from silo.api.client import SiloClient


@dataclass(frozen=True)
class ProjectFile:
    """A file of the project.

    place
        its path relative to the root, with ``/``.
    document
        its UUID in Silo; that of its item, if it has one.
    item
        the item whose revisions are the file's; "" for several or none.
    held
        (identity, object) of each item in it, the main part first.
    bom
        of its assembly, None for a part; ``problem`` says why there is none though there might be one.
    record
        of the file (:mod:`silo.project_folder`).
    moved_from
        its place before, which is empty now.
    former
        the document that the file was until a user at another desk registered it, or made it another
        document; ``document`` is what it became. "" where nothing like that happened.
    """

    path: str
    place: str
    sha256: str
    uid: str
    document: str
    item: str = ""
    held: tuple[tuple[str, str], ...] = ()
    bom: Extraction | None = field(default=None, repr=False)
    problem: str = ""
    record: FileRecord | None = None
    moved_from: str = ""
    former: str = ""

    @property
    def own_record(self) -> FileRecord | None:
        """Return its record, if that is of the document that the file is now, or of what that was before."""
        return record_for(self.record, self.document, self.former)


@dataclass(frozen=True)
class Belonging:
    """What belongs to a commit: files, linked ones before those that link to them.

    outside, missing
        (place, link as recorded): links out of the root, and links to nothing.
    unreadable
        (place, reason).
    gone
        places that the project remembers, where no file is any more.
    doubtful
        (place, place of the file of the same item): copies of a registered part.
    """

    project: Project
    files: tuple[ProjectFile, ...]
    outside: tuple[tuple[str, str], ...] = ()
    missing: tuple[tuple[str, str], ...] = ()
    unreadable: tuple[tuple[str, str], ...] = ()
    gone: tuple[str, ...] = ()
    doubtful: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class FileStanding:
    """A file and how it stands.

    newest
        its newest revision in Silo, None where there is none.
    held
        why its BOM could not be sent although its file was; "" if no BOM is held.
    """

    file: ProjectFile
    state: FileState
    newest: Revision | None = None
    held: str = ""

    @property
    def is_fine(self) -> bool:
        """Return True if Silo has the file as it is here, and its BOM."""
        return self.state is FileState.SAME and not self.held


def find_project(tops: Sequence[str], root: str | None = None) -> Project:
    """Find the project of files or folders.

    It is the given root, else the folder above them that is marked as one, else the folder that was named,
    else the folder that holds all files to which the file links. Raises InputError.
    """
    if root is not None:
        if not os.path.isdir(root):
            raise InputError(message("{root} is not a folder; name the folder of the project", root=root))
        return Project(one_path(root))
    roots = {marked.root for top in tops if (marked := Project.of(top)) is not None}
    if len(roots) > 1:
        raise InputError(
            message(
                "these files are of several projects: {roots}; commit each alone",
                roots=", ".join(sorted(roots)),
            )
        )
    if roots:
        return Project(roots.pop())
    folders = [one_path(top) for top in tops if os.path.isdir(top)]
    if len(folders) == len(tops) == 1:
        return Project(folders[0])
    files = [one_path(top) for top in documents_in(tops)]
    if not files:
        raise InputError(message("no FreeCAD files (*.FCStd) in {tops}", tops=", ".join(tops)))
    reached = [os.path.dirname(path) for path in _reached(files, Locator())[0]]
    try:
        common = os.path.commonpath(reached)
    except ValueError:  # on Windows: files on several drives
        common = os.path.dirname(files[0])
    # The root of the disk, or the home folder, is no project.
    if common == os.path.expanduser("~") or len(Path(common).parts) < 3:
        common = os.path.dirname(files[0])
    return Project(common)


def must_hold_files(tops: Sequence[str], project: Project) -> None:
    """Raise InputError if there is no FreeCAD file, and there was none: the folder is the wrong one."""
    if not documents_in(tops) and not project.records():
        raise InputError(message("no FreeCAD files (*.FCStd) in {tops}", tops=", ".join(tops)))


def read_project(tops: Sequence[str], project: Project, *, hardware: bool = True) -> Belonging:
    """Read what belongs to a commit of these files or folders. Changes nothing."""
    paths = [one_path(path) for path in documents_in(tops)]
    stray = [path for path in paths if project.place(path) is None]
    if stray:
        raise InputError(
            message(
                "{stray} lies outside the project {root}; name its folder with --root",
                stray=stray[0],
                root=project.root,
            )
        )
    locator = Locator(project.root)
    order, unreadable, outside, missing = _reached(paths, locator, project)
    noted = project.records()
    gone = {place: kept for place, kept in noted.items() if not os.path.exists(project.path(place))}
    files: list[ProjectFile] = []
    with Library(project.root) as library:
        for path in order:
            try:
                files.append(_read(path, project, noted, library, hardware=hardware))
            except (DocumentError, OSError) as error:
                reason = error.reason if isinstance(error, DocumentError) else str(error)
                unreadable.append((project.place(path) or path, reason))
    files, doubtful = _one_file_per_item(files)
    files = [_moved(file, gone, files) for file in files]
    moved = {file.moved_from for file in files}
    return Belonging(
        project,
        tuple(files),
        tuple(outside),
        tuple(missing),
        tuple(unreadable),
        tuple(sorted(set(gone) - moved)),
        tuple(doubtful),
    )


def _reached(
    paths: Iterable[str], locator: Locator, project: Project | None = None
) -> tuple[list[str], list[tuple[str, str]], list[tuple[str, str]], list[tuple[str, str]]]:
    """Return the files and all files to which they link, linked ones first; also the unreadable ones, and
    links that lead outside or to nothing.
    """
    order: list[str] = []
    unreadable: list[tuple[str, str]] = []
    outside: list[tuple[str, str]] = []
    missing: list[tuple[str, str]] = []
    entered: set[str] = set()

    def name(path: str) -> str:
        return (project.place(path) if project is not None else None) or path

    def links(path: str) -> Iterator[str]:
        try:
            recorded = recorded_paths(path)
        except DocumentError as error:
            if project is not None:
                unreadable.append((name(path), error.reason))
            return
        for link in recorded:
            location = locator.find(link, (os.path.dirname(path),))
            if isinstance(location, FoundFile):
                yield location.real
                continue
            anywhere = Locator().find(link, (os.path.dirname(path),))
            (outside if isinstance(anywhere, FoundFile) else missing).append((name(path), link))

    for top in paths:
        stack = [(top, links(top))] if top not in entered else []
        entered.add(top)
        while stack:
            path, below = stack[-1]
            following = next((source for source in below if source not in entered), None)
            if following is None:
                stack.pop()
                order.append(path)
            else:
                entered.add(following)
                stack.append((following, links(following)))
    bad = {place for place, _ in unreadable}
    return [path for path in order if name(path) not in bad], unreadable, outside, missing


def _read(
    path: str, project: Project, noted: Mapping[str, FileRecord], library: Library, *, hardware: bool
) -> ProjectFile:
    place = project.place(path) or path
    document, sha256 = library.open(path), content_hash(path)
    problem = ""
    item: str | None = None
    bom: Extraction | None = None
    try:
        item, bom = file_bom(document, walk=lambda top: extract(top, hardware=hardware))
    except SeveralAssembliesError as error:
        problem = str(error)
    held = held_items(document)
    main = [noted_files for noted_files in held if noted_files[0] == item]
    held = (*main, *(noted_files for noted_files in held if noted_files not in main))
    record = noted.get(place)
    # A file that had an item and has it no longer is a document of its own.
    own = record.document if record is not None and not record.item else ""
    return ProjectFile(
        path, place, sha256, str(document.Uid), item or own, item or "", held, bom, problem, record
    )


def _one_file_per_item(files: Sequence[ProjectFile]) -> tuple[list[ProjectFile], list[tuple[str, str]]]:
    """Let an item have one file: a copy with other content becomes a document of its own, and is reported."""
    owner: dict[str, ProjectFile] = {}
    for file in sorted(
        files,
        key=lambda project_file: (
            project_file.record is None or not project_file.record.is_of(project_file.item),
            project_file.place,
        ),
    ):
        if file.item:
            owner.setdefault(file.item.lower(), file)
    project_files, doubtful = [], []
    for file in files:
        first = owner.get(file.item.lower(), file)
        if first.place != file.place:
            doubtful.append((file.place, first.place))
            if first.sha256 != file.sha256:
                own = file.record.document if file.record and not file.record.is_of(file.item) else ""
                file = replace(file, document=own, item="", held=(), bom=None)
        project_files.append(file)
    return project_files, doubtful


def _moved(file: ProjectFile, gone: Mapping[str, FileRecord], files: Sequence[ProjectFile]) -> ProjectFile:
    """Give the file its previous place, if exactly one remembered file is gone and can only be this one."""
    if file.record is not None and (file.record.is_of(file.document) or not file.document):
        return file
    rules: tuple[Callable[[FileRecord], bool], ...] = (
        (lambda kept: bool(file.item) and kept.is_of(file.item)),
        (lambda kept: not file.item and kept.sha256 == file.sha256),
        (lambda kept: not file.item and bool(kept.uid) and kept.uid == file.uid),
    )
    taken = {project_file.document for project_file in files if project_file.place != file.place}
    for fits in rules:
        places = [place for place, kept in gone.items() if kept.document not in taken and fits(kept)]
        if len(places) == 1:
            before = gone[places[0]]
            return replace(file, document=before.document, record=before, moved_from=places[0])
    return file


def stand(
    tops: Sequence[str], project: Project, client: SiloClient | None, store: Store
) -> tuple[Belonging, list[FileStanding]]:
    """Find what belongs to files or folders, and how each file stands. Changes nothing."""
    belonging = name_documents(read_project(tops, project), client, new=False)
    return belonging, compare(belonging, client, store)


def name_documents(belonging: Belonging, client: SiloClient | None, *, new: bool = True) -> Belonging:
    """Give each file without an item a UUID, and write the UUIDs down before the first request that has one.

    new
        False: name only files that Silo has, and write nothing.

    If the folder remembers nothing (a copy of the files alone), the links of files in Silo show which
    document each file is.
    """
    numbers = _linked_documents(belonging, client) if client is not None else {}
    files = [
        file
        if file.document
        else replace(file, document=numbers.get(file.place) or (str(uuid4()) if new else ""))
        for file in belonging.files
    ]
    documents = [file.record for file in files if not file.item and file.record is not None]
    now = documents_now(documents, client) if client is not None else {}
    files = [
        replace(file, document=now[file.document], former=file.document)
        if not file.item and file.document in now
        else file
        for file in files
    ]
    named = {
        new.place: FileRecord(
            new.document, uid=new.uid, former=old.record.document if old.record is not None else ""
        )
        for old, new in zip(belonging.files, files, strict=True)
        if not old.document
    }
    if new:
        belonging.project.note(
            named
        )  # also without any: the file marks the root, from which places are counted
    return replace(belonging, files=tuple(files))


def _linked_documents(belonging: Belonging, client: SiloClient) -> dict[str, str]:
    """Return place → document, as the newest revisions of registered files record their links."""
    nameless = {file.place for file in belonging.files if not file.document}
    documents: dict[str, str] = {}
    users = [file for file in belonging.files if file.item] if nameless else []
    for file in users:
        try:
            links = client.get_document(file.item).links
        except RouteMissingError:
            return {}
        except NotFoundError:
            continue
        folder = os.path.dirname(file.place)
        for link in links:
            place = os.path.normpath(os.path.join(folder, link.path)).replace(os.sep, "/")
            if link.document and place in nameless:
                documents.setdefault(place, link.document)
    return documents


def compare(belonging: Belonging, client: SiloClient | None, store: Store) -> list[FileStanding]:
    """Compare each file with the server, in the same order. One request, if the server knows documents.

    client
        None: the server cannot be asked now, and what the project remembers counts.
    """
    newest = newest_files(belonging.files, client) if client is not None else {}
    strange = [
        project_file.item
        for project_file in belonging.files
        if project_file.item and project_file.document.lower() not in newest
    ]
    here = set(client.get_items_by_uuid(strange) if client is not None else strange)
    queued = {
        (entry.identity.lower(), entry.sha256): entry.state for entry in store.entries() if entry.file_left
    }
    held = {one.identity.lower(): one.why for one in store.held_boms(client.base_url if client else "")}
    standings = []
    for file in belonging.files:
        revision = newest.get(file.document.lower())
        state = _state(file, revision, client, store)
        if revision is None and file.item and file.item not in here and state is not FileState.SET_BACK:
            state = FileState.UNKNOWN
        waits = queued.get((file.document.lower(), file.sha256))
        if waits is not None and state is not FileState.SAME:
            state = FileState.HELD if waits is State.HELD else FileState.WAITING
        standings.append(FileStanding(file, state, revision, held.get(file.item.lower(), "")))
    return standings


def newest_files(files: Iterable[ProjectFile], client: SiloClient) -> dict[str, Revision]:
    """Get the newest revision of each file in Silo, by its UUID in lower case.

    For a Silo without documents, the main item of each file is asked for. It knows nothing of a file without
    an item, so what was sent from here counts.
    """
    several = [file for file in files if file.document]
    try:
        return dict(client.get_documents(file.document for file in several))
    except RouteMissingError:
        pass
    main = {file.document.lower(): file.held[0][0] for file in several if file.held}
    items = client.get_items_by_uuid(main.values())
    revisions: dict[str, Revision] = {
        file.document.lower(): Revision(revision_number=0, file_checksum=record.sha256)
        for file in several
        if not file.held and (record := file.own_record) is not None and record.sha256
    }
    for document, uuid in main.items():
        item = items.get(uuid)
        if item is not None and (by_name := file_revisions(client.revisions(item.part_number))):
            revisions[document] = by_name[0]
    return revisions


def _state(file: ProjectFile, newest: Revision | None, client: SiloClient | None, store: Store) -> FileState:
    record = file.own_record
    if client is None:
        return remembered_state(file.sha256, record)
    server = client

    def revisions() -> Sequence[Revision]:
        return server.revisions(address_of(file, server))

    def number(content: str) -> int | None:
        return store.known_revision(server.base_url, content, file.document)

    origins: Sequence[str] = ()
    if newest is not None and checksum_of(newest) != file.sha256:
        origins = store.origins(file.sha256, file.path, file.document, record=file.record)
    return file_state(file.sha256, origins, record, newest, canonical(server.base_url), revisions, number)


def address_of(file: ProjectFile, client: SiloClient) -> str:
    """Return the address of the file's revisions on the server: a part number, or the document itself."""
    item = client.get_item_by_uuid(file.item) if file.item else None
    return item.part_number if item is not None else DocumentId(file.document)


def commits(
    belonging: Belonging,
    standings: Sequence[FileStanding],
    *,
    comment: str = "",
    allow_missing: bool = False,
    over_newer: Container[str] = (),
    boms: Container[str] | None = None,
    hold: bool = False,
) -> Iterator[tuple[ProjectFile, Commit]]:
    """Make the commits of files that differ from Silo, and of the BOMs of the assemblies.

    over_newer
        files that are sent on top of newer revisions in Silo, which a user saw.
    boms
        the places of the files in Silo whose BOMs go as well; None: all of them.
    hold
        also files that are newer in Silo and edited here: the queue holds them for a choice.
    """
    users = _users(belonging)
    for standing in standings:
        file = standing.file
        is_over = standing.state in ON_TOP and file.path in over_newer
        is_held = hold and standing.state in ON_TOP
        wanted = standing.state in (FileState.NEW, FileState.EDITED) or is_over or is_held
        is_open = standing.state is FileState.SAME and (boms is None or file.place in boms)
        bom = file.bom if file.item and (wanted or is_open) else None
        if not wanted and bom is None:
            continue
        if file.former and standing.state in ON_TOP:  # without the part number that a colleague gave it
            continue
        commit = Commit(
            path=file.path,
            label=file.place,
            identity=file.document,
            taken_at=time.time(),
            key=new_key(),
            comment=comment,
            file=Path(file.path) if wanted else None,
            sha256="" if wanted else file.sha256,
            extraction=bom,
            allow_missing=allow_missing,
            remark=file.problem,
            origin=UNKNOWN if wanted else file.sha256,
            document=InFile(file.held, not file.item, users.get(file.place, "")).to_json(),
            renamed=SAME_PART if file.moved_from else "",
        )
        if is_over and standing.newest is not None:
            newer = standing.newest.model_dump(mode="json", exclude={"properties", "links"})
            newer["set_back"] = standing.state is FileState.SET_BACK
            commit = replace(commit, **on_top(comment, newer))
        yield file, commit


def left_in_queue(belonging: Belonging, store: Store, mine: Container[str] = ()) -> list[Entry]:
    """Return the commits of these files that are not in Silo yet, also those of an earlier run.

    mine
        keys of commits that count whatever they are of.
    """
    documents = {file.document.lower() for file in belonging.files if file.document}
    paths = {file.path for file in belonging.files}
    return [
        entry
        for entry in store.entries()
        if entry.key in mine or entry.identity.lower() in documents or entry.path in paths
    ]


def retry_held(belonging: Belonging, store: Store, over: Container[str]) -> int:
    """Let held commits of these files go on top of the newer revisions that held them, as the user wants;
    return how many.
    """
    count = 0
    documents = {file.document.lower(): file.path for file in belonging.files if file.document}
    for entry in store.entries():
        path = documents.get(entry.identity.lower(), "")
        if entry.state is State.HELD and entry.newer and not entry.superseded and path in over:
            store.retry(entry.id)
            count += 1
    return count


def _users(belonging: Belonging) -> dict[str, str]:
    """Return place → an item whose file links to it, for a Silo that keeps other files as attachments."""
    users: dict[str, str] = {}
    registered = [file for file in belonging.files if file.item]
    for file in registered:
        folder = os.path.dirname(file.path)
        locator = Locator(belonging.project.root)
        for recorded in recorded_paths(file.path):
            target = locator.find(recorded, (folder,))
            if isinstance(target, FoundFile) and (place := belonging.project.place(target.real)):
                users.setdefault(place, file.item)
    top = registered[-1].item if registered else ""
    return {file.place: users.get(file.place, top) for file in belonging.files}


def keep(project: Project, store: Store, file: ProjectFile, commit: Commit, server: str) -> None:
    """Put a commit into the queue. A file that has moved takes its record along."""
    if file.moved_from and file.record is not None:
        project.note({file.moved_from: None, file.place: file.record})
    store.add(commit, server)


@dataclass(frozen=True)
class SentAlong:
    """What became of the files below a committed one.

    standings
        of all of them, before anything was sent.
    queued
        the places of those whose file is in the queue now, also of those that a newer revision will hold.
    more
        how many BOMs and commits that were held can go now.
    """

    standings: tuple[FileStanding, ...] = ()
    queued: frozenset[str] = frozenset()
    more: int = 0

    @property
    def left_out(self) -> tuple[FileStanding, ...]:
        """Return the files that Silo has otherwise, and that nothing sends."""
        fine = (FileState.SAME, FileState.WAITING)
        return tuple(
            one for one in self.standings if one.state not in fine and one.file.place not in self.queued
        )


def send_along(
    path: str, client: SiloClient | None, store: Store, server: str, skip: Container[str] = (), **how: Any
) -> SentAlong:
    """Put into the queue the files to which a committed file links and that are not in Silo, and the BOMs of
    the others that were held back and can go now.

    A file that was edited and is newer in Silo is queued too: it is held there for a choice.

    skip
        files about which the user has decided.
    how
        as for :func:`commits`.
    """
    belonging = read_project([path], find_project([path]))
    if all(file.item and file.path in skip for file in belonging.files):
        return SentAlong()
    belonging = name_documents(belonging, client)
    retried = retry_held(belonging, store, how.get("over_newer", ()))
    standings = compare(belonging, client, store)
    remember(belonging.project, standings, client)
    asked = [standing for standing in standings if standing.file.path not in skip]
    boms = _open_boms(asked, client, store, allow_missing=bool(how.get("allow_missing")))
    freed = 0
    if client is not None:
        freed = free_held(client, store, {standing.file.path for standing in standings})
    queued = set()
    for file, commit in commits(belonging, standings, boms=boms, hold=True, **how):
        if file.path not in skip:
            keep(belonging.project, store, file, commit, server)
            queued.add(file.place)
    return SentAlong(tuple(asked), frozenset(queued), len(boms) + retried + freed)


def free_held(client: SiloClient, store: Store, skip: Container[str] = ()) -> int:
    """Put the BOMs into the queue that were held and can go now; return how many.

    skip
        the files whose BOMs the caller sends.
    """
    count = 0
    for held in store.held_boms(client.base_url):
        if held.path in skip or not os.path.isfile(held.path):
            continue
        with suppress(InputError, NotFoundError):  # it stays held
            count += _free(held, client, store)
    return count


def _free(held: HeldHere, client: SiloClient, store: Store) -> int:
    whole = read_project([held.path], find_project([held.path]))
    files = [one for one in whole.files if one.path == one_path(held.path) and one.item]
    belonging = replace(whole, files=tuple(one for one in files if one.item.lower() == held.identity.lower()))
    standings = compare(belonging, client, store)
    boms = _open_boms(standings, client, store)
    made = list(commits(belonging, standings, boms=boms)) if boms else []
    for file, commit in made:
        if commit.file is None:  # an edited file goes with a commit of the user
            keep(belonging.project, store, file, commit, client.base_url)
    return len(boms)


def _open_boms(
    standings: Iterable[FileStanding],
    client: SiloClient | None,
    store: Store,
    *,
    allow_missing: bool = False,
) -> frozenset[str]:
    """Return the places of the files in Silo whose BOM is not there as it is here, and can go.

    A BOM that was held, and that Silo has by now, is held no more.
    """
    places = set()
    for standing in standings if client is not None else ():
        bom = standing.file.bom
        if client is None or bom is None or not standing.file.item or standing.state is not FileState.SAME:
            continue
        with suppress(NotFoundError):
            resolved = resolve(bom, client)
            lines = server_lines(resolved, client)
            decided = decide(resolved, lines, allow_missing=allow_missing, server=server_of(client))
            if decided.status is Status.MERGED:
                places.add(standing.file.place)
            elif decided.status is Status.UNCHANGED:
                store.free_bom(client.base_url, standing.file.item)
    return frozenset(places)


def remember(project: Project, standings: Iterable[FileStanding], client: SiloClient | None) -> None:
    """Write the records of files that are in Silo as they are here, where they say something else."""
    if client is None:
        return
    server = canonical(client.base_url)
    noted: dict[str, FileRecord | None] = {}
    for standing in standings:
        file, newest = standing.file, standing.newest
        if standing.state is not FileState.SAME or newest is None or not newest.revision_number:
            continue
        record = arrived(file.document, file.sha256, newest, server, file.uid, item=bool(file.item))
        before = file.record
        if before is not None and replace(before, since=record.since) == record and not file.moved_from:
            continue
        if file.moved_from:
            noted[file.moved_from] = None
        noted[file.place] = record
    if noted:
        project.note(noted)
