# SPDX-License-Identifier: LGPL-2.1-or-later
"""The look at Silo for what colleagues did to files since they were opened here.

The look belongs in a worker; what it finds are values.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

from silo.bom.compare.states import ComparedAssembly
from silo.bom.compare.three_states import ThreeLines
from silo.bom.errors import NotFoundError, RouteMissingError, SiloError
from silo.workbench.colleagues.theirs import Theirs
from silo.workbench.documents.opened import DocumentOrigin

if TYPE_CHECKING:
    from silo.api.client import SiloClient
    from silo.api.revisions import Standing
    from silo.api.transport import Cancel
    from silo.outbox.entry import Entry as QueueEntry
    from silo.outbox.store import Store
    from silo.workbench.colleagues.announced import Newer


@dataclass(frozen=True)
class FileToCheck:
    """A file to look at: its path, the identity of its item, and what the document was made from."""

    path: str
    identity: str
    base: DocumentOrigin


def look(
    client: SiloClient,
    outbox: Store,
    asked: Iterable[FileToCheck],
    mine: Callable[[str], ComparedAssembly | None],
    cancelled: Cancel | None = None,
) -> dict[str, Theirs]:
    """Find the files that a colleague has committed since: path → what they committed. For a worker.

    mine
        returns the present BOM of the document of a path.
    """
    files = [check for check in asked if check.identity]
    items = client.get_items_by_uuid([check.identity for check in files], cancelled=cancelled)
    theirs: dict[str, Theirs] = {}
    for check in files:
        if (item := items.get(check.identity)) is None:
            continue
        origins = outbox.document_origins(check.base.settle(), check.path, check.identity)
        file = _CommitFile(check.path, item.part_number, check.identity, origins)
        if (stands := file.standing(client, outbox)) is not None:
            lines: tuple[ThreeLines, ...] = ()
            with suppress(SiloError):  # the question stands without its details
                lines = file.lines(client, stands, mine(check.path), cancelled)
            theirs[check.path] = file.theirs(stands, lines)
    return theirs


def gone(client: SiloClient, announced: Mapping[str, Newer], cancelled: Cancel | None = None) -> list[str]:
    """Find the items of which the server no longer has the announced commit. For a worker: one request for
    each.
    """
    from silo.api.revisions import newest_number
    from silo.api.transport import stop_if

    identities = []
    for identity, newer in announced.items():
        stop_if(cancelled)
        try:
            revisions = client.revisions(newer.part_number, newest=1)
        except RouteMissingError:
            continue
        except NotFoundError:
            revisions = []
        if newest_number(revisions) < newer.revision:
            identities.append(identity)
    return identities


def look_held(
    client: SiloClient, outbox: Store, entry: QueueEntry, cancelled: Cancel | None = None
) -> Theirs | None:
    """Find the newest revision that a held commit would undo, with the BOM base → theirs → mine. None for a
    part, for a commit to another server, and if nothing would be undone any more. For a worker.

    Raises SiloError if the server does not answer, or a file cannot be read.
    """
    from silo.api.address import canonical
    from silo.bom.snapshot import from_plain
    from silo.vault.revisions import top_of

    extraction = outbox.bom(entry.id)[0]
    if not extraction or entry.server != canonical(client.base_url):
        return None
    try:
        mine = top_of(from_plain(json.loads(extraction)))
    except ValueError:
        return None  # sending it says so
    origins = tuple(entry.origin.split())
    file = _CommitFile(entry.path, entry.part_number, entry.identity, origins)
    stands = file.standing(client, outbox)
    return None if stands is None else file.theirs(stands, file.lines(client, stands, mine, cancelled))


@dataclass(frozen=True)
class _CommitFile:
    path: str
    part_number: str
    identity: str
    origins: tuple[str, ...]

    def standing(self, client: SiloClient, outbox: Store) -> Standing | None:
        """Compare the file with the item's revisions; None if committing it would undo nothing."""
        from silo.file_state import stands, stands_on_newest

        def number(content: str) -> int | None:
            return outbox.known_revision(client.base_url, content, self.identity)

        # The newest one decides it nearly always; an item may have hundreds.
        if stands_on_newest(self.origins, client.revisions(self.part_number, newest=1), number):
            return None
        found = stands("", self.origins, client.revisions(self.part_number), number)
        return None if found.newer is None else found

    def lines(
        self, client: SiloClient, stands: Standing, mine: ComparedAssembly | None, cancelled: Cancel | None
    ) -> tuple[ThreeLines, ...]:
        from silo.vault.revisions import RevisionBoms

        if mine is None:
            return ()
        with RevisionBoms(client, self.part_number, self.path, cancelled) as boms:
            return boms.three(stands, mine)

    def theirs(self, stands: Standing, lines: tuple[ThreeLines, ...]) -> Theirs:
        newest = stands.newest
        assert newest is not None  # something is newer
        return Theirs(
            self.path,
            self.part_number,
            newest.revision_number,
            newest.created_by or "",
            newest.created_at.timestamp() if newest.created_at else None,
            newest.comment,
            stands.base.revision_number if stands.base is not None else None,
            lines,
            newest.model_dump(mode="json", exclude={"properties", "links"}),
        )
