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
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from silo.bom.errors import DocumentError, SiloError
from silo.outbox.store import KEPT_ASIDE_DAYS
from silo.platform import cache_folder
from silo.workbench.commit.flow import Choice, Desk, Theirs
from silo.workbench.commit.opened import Base
from silo.workbench.pane.activity import Entry, Line, Tone
from silo.workbench.session.session import Session
from silo.workbench.words import plain, translate

if TYPE_CHECKING:
    from silo.api.client import SiloClient
    from silo.api.wire import Item, Revision
    from silo.vault.pull import Pulled
    from silo.workbench.session.jobs import Control

MOST_FOUND = 60


@dataclass(frozen=True)
class Known:
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

    def __init__(self, session: Session, desk: Desk) -> None:
        self._session, self._desk = session, desk
        # Of which server, and what it showed without any words.
        self._recent: tuple[str, list[Item]] = ("", [])

    # -- a colleague's file -----------------------------------------------------------------------------

    def choose(
        self, path: str, theirs: Theirs, choice: Choice, *, taken: Callable[[], object] = lambda: None
    ) -> None:
        """Carry out what a person chose in the commit dialog or in the pane.

        taken
            called when theirs is in the place of mine.
        """
        if choice is Choice.TAKE:
            self._take(path, theirs, taken)
        elif choice is Choice.OPEN:
            self._open_beside(path, theirs)

    def _open_beside(self, path: str, theirs: Theirs) -> None:
        if not theirs.revision:
            target = _aside("on-disk", os.path.basename(path))
            self._guarded(path, lambda: self._open_copy(path, target))
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

        def fetch(client: SiloClient, control: Control) -> None:
            content.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            from silo.api.files import download_revision

            checksum = str((theirs.newer or {}).get("file_checksum") or "")
            number = theirs.part_number
            download_revision(client, number, content, theirs.revision, checksum, cancelled=control.cancelled)

        self._session.ask(
            translate("Silo", "Fetching from Silo"),
            fetch,
            done=lambda _none: self._guarded(path, lambda: put(content)),
            failed=lambda error: self._box_error(path, error),
        )

    def _replace(self, path: str, content: Path | None, theirs: Theirs) -> None:
        """Theirs in the place of mine, of which a copy is kept. ``content`` None: theirs is there already."""
        from silo.files import content_hash
        from silo.platform import remove_patiently, replacing

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
                raise DocumentError(path, f"cannot be written ({error.strerror or error})") from error
            remove_patiently(content)
        if doc is not None:
            self._desk.close(doc)
        self._desk.open(path)
        told = translate("Silo", "Yours is kept for {n} days at {path}")
        text = told.replace("{n}", str(KEPT_ASIDE_DAYS)).replace("{path}", ", ".join(kept)) if kept else ""
        if lost := _not_here(path):
            told = translate("Silo", "It links to {names}, not in this folder: Open from Silo… fetches them.")
            text = " ".join(filter(None, (told.replace("{names}", plain(", ".join(lost), 200)), text)))
        title = translate("Silo", "Took {who}'s revision {n}: {name}") if theirs.revision else ""
        title = title or translate("Silo", "Took the file on disk: {name}")
        for key, value in (("{who}", theirs.who), ("{n}", str(theirs.revision)), ("{name}", _name(path))):
            title = title.replace(key, value)
        self._box(path, title, text)

    def _guarded(self, path: str, call: Callable[[], object]) -> None:
        try:
            call()
        except SiloError as error:
            self._box_error(path, error)
        except OSError as error:
            self._box_error(path, DocumentError(path, error.strerror or str(error)))

    def _box_error(self, path: str, error: SiloError) -> None:
        self._box(
            path,
            translate("Silo", "Not fetched: {name}").replace("{name}", _name(path)),
            str(error),
            Tone.ERROR,
        )

    def _box(self, path: str, title: str, text: str, tone: Tone = Tone.PLAIN) -> None:
        entry = Entry(
            key=f"fetched:{path}:{time.time()}",
            title=title,
            when=time.time(),
            tone=tone,
            lines=(Line(text, tone),) if text else (),
            rank=1,
            icon="silo-open",
        )
        self._session.add(entry)

    # -- items ------------------------------------------------------------------------------------------

    def search(
        self, words: str, done: Callable[[list[Item]], None], failed: Callable[[SiloError], None]
    ) -> None:
        """Items whose number, name or description have all these words."""
        url = self._session.shown.server.url

        def told(found: list[Item]) -> None:
            if not words:
                self._recent = url, found
            done(found)

        self._session.ask(
            translate("Silo", "Searching"),
            lambda client, _control: client.search_items(words, limit=MOST_FOUND),
            told,
            failed,
        )

    @property
    def recent(self) -> list[Item]:
        """What the server in use showed last without any words."""
        url, found = self._recent
        return found if url == self._session.shown.server.url else []

    def details(
        self, part_number: str, done: Callable[[Known], None], failed: Callable[[SiloError], None]
    ) -> None:
        """An item's revisions and picture."""
        self._session.ask(
            translate("Silo", "Asking Silo"),
            lambda client, _control: _known(client, part_number),
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
        """Fetch a file with all that it links to. What FreeCAD has open, and what has edits that are not in
        Silo, is left alone; ``overwrite`` replaces the latter and keeps copies."""
        from silo.platform import Spelling  # late: FreeCAD's start waits for this module

        real = Spelling().real  # a link may have opened the file under another spelling of its name
        mine = {real(path) for path in self._desk.open_paths()}
        outbox = self._session.outbox

        def run(client: SiloClient, control: Control) -> Pulled:
            from silo.vault.pull import Rules, fetched, place

            def progress(name: str, count: int) -> None:
                control.progress(f"{count + 1}: {plain(name, 60)}", None)

            rules = Rules(
                overwrite=overwrite,
                keep=outbox.keep_aside,
                is_open=lambda path: real(path) in mine or self._desk.is_open_elsewhere(path),
                learn=lambda sha256, item, number: outbox.learn(client.base_url, sha256, item, number),
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
        self, identity: str, base: Base, done: Callable[[Known], None], failed: Callable[[SiloError], None]
    ) -> None:
        """The revisions of a document's item.

        base
            what the document was made from.
        """
        outbox = self._session.outbox

        def run(client: SiloClient, _control: Control) -> Known:
            from silo.api.files import standing
            from silo.bom.errors import NotFoundError

            item = client.get_item_by_uuid(identity)
            if item is None:
                raise NotFoundError(translate("Silo", "This server does not know the item of this document."))
            known = _known(client, item.part_number)
            origin = base.settle(outbox)
            number = outbox.known_revision(client.base_url, origin, identity)
            made_from = standing(known.revisions, origin, number).base
            return replace(known, base=made_from.revision_number if made_from is not None else None)

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
        """What a revision changed in the BOM, line by line in words; read from both files."""

        def run(client: SiloClient, control: Control) -> list[str]:
            from silo.vault.pull import RevisionBoms, line_texts

            with RevisionBoms(client, part_number, path, control.cancelled) as boms:
                return line_texts(boms.change(older, newer))

        self._session.ask(translate("Silo", "Comparing revisions"), run, done, failed)


def _known(client: SiloClient, part_number: str) -> Known:
    from silo.vault.pull import file_revisions

    item = client.get_item(part_number)
    found = file_revisions(client.revisions(part_number))
    return Known(item, tuple(found), client.thumbnail(part_number) or b"")


def left_alone(pulled: Pulled) -> Sequence[str]:
    """What a pull did not do, in sentences."""
    from silo.vault.pull import State

    texts = {
        State.EDITED: translate("Silo", "{name} has edits that are not in Silo; it was left alone."),
        State.OPEN: translate("Silo", "{name} is open in FreeCAD; it was left alone."),
    }
    told = [texts[one.state].replace("{name}", one.path.name) for one in pulled.files if one.state in texts]
    lost = translate("Silo", "{path}, which {name} links to, was not fetched: {reason}")
    for one in pulled.lost:
        text = lost.replace("{path}", one.path or "?").replace("{name}", one.position)
        told.append(plain(text.replace("{reason}", one.reason), 300))
    return told


def _not_here(path: str) -> list[str]:
    """The files that a file links to and that are not there."""
    from silo.fcstd.linked import recorded_paths
    from silo.fcstd.locate import Found, Locator

    locator, folder = Locator(), (os.path.dirname(path),)
    try:
        recorded = recorded_paths(path)
    except DocumentError:
        return []  # FreeCAD says what it cannot read
    return [os.path.basename(one) for one in recorded if not isinstance(locator.find(one, folder), Found)]


def _aside(*names: str) -> Path:
    return cache_folder().joinpath("revisions", *names)


def _word(text: str) -> str:
    return re.sub(r"[^\w.-]", "_", text) or "item"


def _name(path: str) -> str:
    return plain(os.path.basename(path), 80)
