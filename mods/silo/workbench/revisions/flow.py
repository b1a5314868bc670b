# SPDX-License-Identifier: LGPL-2.1-or-later
"""Getting files from Silo into FreeCAD: take a colleague's, open it beside one's own, open an item, history.

Nothing of the user's is replaced without their word, and a copy of what is replaced is kept. Downloads and
reading are a worker's; opening and closing documents is done in the GUI thread.
"""

from __future__ import annotations

import os
import re
import shutil
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from silo.bom.errors import DocumentError, SiloError
from silo.bom.message import message
from silo.bom.system_refusals import why_refused
from silo.outbox.store import KEPT_ASIDE_DAYS
from silo.platform.part_file_name import part_file_stem
from silo.platform.user_folders import cache_folder
from silo.workbench.activity.box import own_box
from silo.workbench.colleagues.theirs import Choice, Theirs
from silo.workbench.documents.opened import DocumentOrigin
from silo.workbench.ghost import Ghost
from silo.workbench.revisions.desk import RevisionDesk
from silo.workbench.revisions.ghosts import difference_text, ghosts
from silo.workbench.session.session import Session
from silo.workbench.tone import Tone
from silo.workbench.words import filled, plain, translate

if TYPE_CHECKING:
    from silo.api.client import SiloClient
    from silo.api.wire import Item, Revision
    from silo.vault.pull import Pulled
    from silo.workbench.session.worker import Control

MOST_FOUND = 60


@dataclass(frozen=True)
class ItemHistory:
    """An item with its revisions that have a file, newest first, and its picture (PNG).

    base
        the revision that the document was made from; None: unknown, or no document was asked about.
    """

    item: Item
    revisions: tuple[Revision, ...]
    picture: bytes = b""
    base: int | None = None


class RevisionFlow:
    """One per FreeCAD."""

    def __init__(self, session: Session, desk: RevisionDesk) -> None:
        self._session, self._desk = session, desk
        # Of which server, and what it showed without any words.
        self._recent: tuple[str, list[Item]] = ("", [])

    # -- a colleague's file -----------------------------------------------------------------------------

    def choose(
        self, path: str, theirs: Theirs, choice: Choice, *, taken: Callable[[], object] = lambda: None
    ) -> None:
        """Carry out what a user chose in the commit dialog or in the pane.

        taken
            called when their file is in the place of mine.
        """
        if choice is Choice.TAKE:
            self._take(path, theirs, taken)
        elif choice is Choice.OPEN:
            self._open_beside(path, theirs)

    def _open_beside(self, path: str, theirs: Theirs) -> None:
        if not theirs.revision:
            stem = part_file_stem(theirs.part_number)
            target = _aside(f"{stem}-r{theirs.revision}", os.path.basename(path))
            self._fetch(path, theirs, target, lambda: self._desk.open(str(target)))
            return
        folder = _aside(f"{_word(theirs.part_number)}-r{theirs.revision}")
        self.pull(
            theirs.part_number,
            theirs.revision,
            folder,
            overwrite=True,
            done=lambda pulled: self._guarded(path, lambda: self._desk.open(str(pulled.top))),
            failed=lambda error: self._box_error(path, error),
        )

    def compare(
        self,
        path: str,
        part_number: str,
        revision: int,
        report: Callable[[str], object],
        failed: Callable[[SiloError], None],
    ) -> None:
        """Show another revision as a ghost beside the open document, and say what differs; or remove it."""

        def done(theirs: list[Ghost]) -> None:
            if not theirs:
                report(translate("Silo", "Silo has no model of revision {n} yet.", n=revision))
                return
            try:
                report(difference_text(self._desk.compare(path, revision, theirs), revision))
            except SiloError as error:
                failed(error)

        title = translate("Silo", "Fetching from Silo")
        self._session.ask(
            title,
            lambda client, control: ghosts(client, part_number, revision, control),
            done=done,
            failed=failed,
        )

    def _open_copy(self, path: str, target: Path) -> None:
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(path, target)
        self._desk.open(str(target))

    def _take(self, path: str, theirs: Theirs, taken: Callable[[], object]) -> None:
        def put(content: Path | None) -> None:
            self._replace(path, content, theirs)
            taken()

        if not theirs.revision:
            self._guarded(path, lambda: put(None))
            return
        content = self._session.outbox.path.parent / "fetched" / f"{time.monotonic_ns()}.FCStd"
        self._fetch(path, theirs, content, lambda: put(content))

    def _fetch(self, path: str, theirs: Theirs, content: Path, then: Callable[[], object]) -> None:
        """Fetch their file alone."""

        def fetch(client: SiloClient, control: Control) -> None:
            content.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            from silo.api.files import download_revision

            checksum = str((theirs.newer or {}).get("file_checksum") or "")
            number = theirs.part_number
            download_revision(client, number, content, theirs.revision, checksum, cancelled=control.cancelled)

        self._session.ask(
            translate("Silo", "Fetching from Silo"),
            fetch,
            done=lambda _none: self._guarded(path, then),
            failed=lambda error: self._box_error(path, error),
        )

    def _replace(self, path: str, content: Path | None, theirs: Theirs) -> None:
        """Put their file in the place of mine, and keep a copy of mine. ``content`` None: theirs is there
        already.
        """
        from silo.checksums import content_hash
        from silo.platform.whole_files import remove_patiently, replacing

        doc, outbox, kept = self._desk.find(path), self._session.outbox, list[str]()
        # The file on disk is mine, or it is a third person's.
        is_mine = doc is not None and not self._desk.documents.base(doc).replaced
        is_theirs = content is None or (os.path.exists(path) and content_hash(path) == content_hash(content))
        if not is_mine and not is_theirs:
            kept += filter(None, [str(outbox.keep_aside(path) or "")])
        if doc is not None:
            mine = outbox.aside(path)
            self._desk.save_copy(doc, mine)
            kept.append(str(mine))
        if content is not None:
            try:
                with content.open("rb") as read, replacing(path, mode=0o644) as write:
                    shutil.copyfileobj(read, write)
            except OSError as error:
                raise DocumentError(
                    path, message("cannot be written ({error})", error=why_refused(error))
                ) from error
            remove_patiently(content)
        if doc is not None:
            self._desk.close(doc)
        self._desk.open(path)
        text = ""
        if kept:
            text = translate(
                "Silo", "Yours is kept for {n} days at {path}", n=KEPT_ASIDE_DAYS, path=", ".join(kept)
            )
        if lost := _not_here(path):
            sentence = translate(
                "Silo",
                "It links to {names}, not in this folder: Open from Silo… fetches them.",
                names=plain(", ".join(lost), 200),
            )
            text = " ".join(filter(None, (sentence, text)))
        title = translate("Silo", "Took {who}'s revision {n}: {name}") if theirs.revision else ""
        title = title or translate("Silo", "Took the file on disk: {name}")
        self._box(path, filled(title, who=theirs.who, n=theirs.revision, name=_name(path)), text)

    def _guarded(self, path: str, call: Callable[[], object]) -> None:
        try:
            call()
        except SiloError as error:
            self._box_error(path, error)
        except OSError as error:
            self._box_error(path, DocumentError(path, why_refused(error)))

    def _box_error(self, path: str, error: SiloError) -> None:
        self._box(
            path,
            translate("Silo", "Not fetched: {name}", name=_name(path)),
            str(error),
            Tone.ERROR,
        )

    def _box(self, path: str, title: str, text: str, tone: Tone = Tone.PLAIN) -> None:
        key, lines = f"fetched:{path}:{time.time()}", filter(None, [text])
        self._session.add(own_box(key, title, *lines, tone=tone, icon="silo-open"))

    # -- items ------------------------------------------------------------------------------------------

    def search(
        self, words: str, done: Callable[[list[Item]], None], failed: Callable[[SiloError], None]
    ) -> None:
        """Search items whose number, name or description have all these words."""
        url = self._session.shown.server.url

        def told(items: list[Item]) -> None:
            if not words:
                self._recent = url, items
            done(items)

        self._session.ask(
            translate("Silo", "Searching"),
            lambda client, _control: client.search_items(words, limit=MOST_FOUND),
            told,
            failed,
        )

    @property
    def recent(self) -> list[Item]:
        """Return the items that the server in use showed last for a search without words."""
        url, items = self._recent
        return items if url == self._session.shown.server.url else []

    def details(
        self, part_number: str, done: Callable[[ItemHistory], None], failed: Callable[[SiloError], None]
    ) -> None:
        """Fetch an item's revisions and picture."""
        self._session.ask(
            translate("Silo", "Asking Silo"),
            lambda client, _control: _history_of(client, part_number),
            done,
            failed,
        )

    def pull(
        self,
        part_number: str,
        revision: int | None,
        folder: Path,
        *,
        overwrite: bool = False,
        done: Callable[[Pulled], None],
        failed: Callable[[SiloError], None],
    ) -> None:
        """Fetch a file with all linked files. Files that FreeCAD has open, or that have edits that are not in
        Silo, are left alone; ``overwrite`` replaces the latter and keeps copies.
        """
        from silo.platform.spelling import Spelling

        real = Spelling().real  # a link may have opened the file under another spelling of its name
        mine = {real(path) for path in self._desk.open_paths()}
        outbox = self._session.outbox

        def run(client: SiloClient, control: Control) -> Pulled:
            from silo.vault.pull import place, rules_of
            from silo.vault.tree import fetched

            def progress(name: str, count: int) -> None:
                control.progress(f"{count + 1}: {plain(name, 60)}", None)

            rules = rules_of(
                outbox,
                client,
                overwrite=overwrite,
                is_open=lambda path: real(path) in mine or self._desk.is_open_elsewhere(path),
            )
            with fetched(
                client, part_number, revision, cancelled=control.cancelled, progress=progress
            ) as tree:
                folder.mkdir(parents=True, exist_ok=True)
                return place(tree, folder, rules)

        self._session.ask(translate("Silo", "Fetching from Silo"), run, done, failed)

    def open(self, path: str) -> None:
        """Open a fetched file in FreeCAD; a problem becomes a box of the pane."""
        self._guarded(path, lambda: self._desk.open(path))

    # -- the history of a document ----------------------------------------------------------------------

    def history(
        self,
        identity: str,
        base: DocumentOrigin,
        done: Callable[[ItemHistory], None],
        failed: Callable[[SiloError], None],
    ) -> None:
        """Fetch the revisions of a document's item.

        base
            the base from which the document was made.
        """
        outbox = self._session.outbox

        def run(client: SiloClient, _control: Control) -> ItemHistory:
            from silo.bom.errors import NotFoundError
            from silo.file_state import stands

            item = client.get_item_by_uuid(identity)
            if item is None:
                raise NotFoundError(translate("Silo", "This server does not know the item of this document."))
            item_history = _history_of(client, item.part_number)
            origins = outbox.document_origins(base.settle(), base.path, identity)

            def number(of: str) -> int | None:
                return outbox.known_revision(client.base_url, of, identity)

            made_from = stands("", origins, item_history.revisions, number).base
            return replace(item_history, base=made_from.revision_number if made_from is not None else None)

        self._session.ask(translate("Silo", "Asking Silo"), run, done, failed)

    def bom_change(
        self,
        part_number: str,
        path: str,
        older: int | None,
        newer: int,
        done: Callable[[list[str]], None],
        failed: Callable[[SiloError], None],
    ) -> None:
        """Compare a revision's BOM with the one before, line by line in words; both files are read."""

        def run(client: SiloClient, control: Control) -> list[str]:
            from silo.vault.revisions import RevisionBoms, line_texts

            with RevisionBoms(client, part_number, path, control.cancelled) as boms:
                return line_texts(boms.change(older, newer))

        self._session.ask(translate("Silo", "Comparing revisions"), run, done, failed)


def _history_of(client: SiloClient, part_number: str) -> ItemHistory:
    from silo.vault.revisions import file_revisions

    item = client.get_item(part_number)
    revisions = file_revisions(client.revisions(part_number))
    return ItemHistory(item, tuple(revisions), client.thumbnail(part_number) or b"")


def _not_here(path: str) -> list[str]:
    """Return the files to which a file links and that are missing."""
    from silo.fcstd.linked import recorded_paths
    from silo.locator import FoundFile, Locator

    locator, folder = Locator(), (os.path.dirname(path),)
    try:
        recorded = recorded_paths(path)
    except DocumentError:
        return []  # FreeCAD says what it cannot read
    return [
        os.path.basename(place)
        for place in recorded
        if not isinstance(locator.find(place, folder), FoundFile)
    ]


def _aside(*names: str) -> Path:
    return cache_folder().joinpath("revisions", *names)


def _word(text: str) -> str:
    return re.sub(r"[^\w.-]", "_", text) or "item"


def _name(path: str) -> str:
    return plain(os.path.basename(path), 80)
