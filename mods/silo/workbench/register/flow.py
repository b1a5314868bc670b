# SPDX-License-Identifier: LGPL-2.1-or-later
"""From the command to the Register Parts dialog, and from its buttons to documents and server. GUI thread.

::

    start ── a worker looks ──▶ the dialog is filled ──▶ a person orders ──▶ a worker registers, one by one
                                       ▲                                          │ identities: GUI thread
                                       ╰─────────────── next numbers ◀── commits ◀┘

FreeCAD and Qt come in through the :class:`~silo.workbench.commit.desk.Desk` only.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any, Protocol

from silo.bom.errors import SiloError
from silo.bom.identity import walk_entries
from silo.bom.model import BomEntry, Extraction
from silo.registering.items import Registration
from silo.registering.journal import Journal
from silo.registering.offer import Candidate, Offer, next_number, offer
from silo.registering.orders import Order, carry_out
from silo.workbench.commit.desk import Desk
from silo.workbench.commit.flow import CommitFlow
from silo.workbench.commit.snapshot import Snapshot
from silo.workbench.register.rows import EditedRow
from silo.workbench.session.session import Session
from silo.workbench.settings.preferences import Preferences
from silo.workbench.words import translate


class Window(Protocol):
    """An open dialog; :mod:`silo.workbench.register.dialog` is the real one."""

    def fill(self, offer: Offer, /) -> None: ...

    def fail(self, error: SiloError, /) -> None: ...

    def set_number(self, category: str, number: str, /) -> None: ...

    def registered(self, order: Order, result: Registration, /) -> None: ...

    def undeclared(self, row: EditedRow, /) -> None: ...

    def stopped(self) -> None: ...

    def tell(self, text: str, /) -> None: ...

    def raise_(self) -> None: ...


class RegisterFlow:
    """Opens the dialog, one per document, and carries out what it asks for."""

    def __init__(
        self,
        session: Session,
        preferences: Preferences,
        commits: CommitFlow,
        desk: Desk,
        *,
        journal: Journal | None = None,
    ) -> None:
        self._session, self._preferences, self._commits = session, preferences, commits
        self._desk = desk
        self._journal = journal or Journal()
        self._open: dict[str, Window] = {}

    def start(self, doc: Any) -> None:
        """Show the components of a document that have no number."""
        try:
            taken = self._commits.snapshot(doc)
        except SiloError as error:
            self._desk.warn(translate("Silo", "Register Components"), str(error))
            return
        self._dialog(taken)
        extraction = whole(taken)
        seen = self._desk.look_at(
            entry.doc_path for entry in walk_entries((extraction.assembly, *extraction.entries))
        )
        schema = self._preferences.text("Schema")
        self._session.ask(
            translate("Silo", "Looking for components without a part number"),
            lambda client, control: offer(extraction, seen, client, schema, control, self._journal.pending()),
            done=lambda found: self._with_dialog(taken.path, lambda dialog: dialog.fill(found)),
            failed=lambda error: self._with_dialog(taken.path, lambda dialog: dialog.fail(error)),
        )

    def _dialog(self, taken: Snapshot) -> None:
        if taken.path in self._open:
            self._open[taken.path].raise_()
            return
        asks = self._preferences.flag("AskRegister")
        self._open[taken.path] = self._desk.register_window(taken.label, taken.path, self, asks=asks)

    def closed(self, path: str) -> None:
        """The dialog of this document is gone."""
        self._open.pop(path, None)

    def ask_again(self, on: bool) -> None:
        """Whether a person wants to be asked after each commit."""
        self._preferences.set("AskRegister", on)

    def _with_dialog(self, path: str, call: Callable[[Window], None]) -> None:
        if path in self._open:
            call(self._open[path])

    def number(self, path: str, category: str) -> None:
        """Ask for the next number of a category."""
        schema = self._preferences.text("Schema")
        self._session.ask(
            translate("Silo", "Asking for the next number"),
            lambda client, _control: next_number(client, schema, category),
            done=lambda number: self._with_dialog(path, lambda d: d.set_number(category, number)),
            failed=lambda _error: None,
        )

    def undeclare(self, path: str, row: EditedRow) -> None:
        """Take the identity back from what is modelled in the assembly's file; its item stays."""
        clean = self._desk.unedited()
        try:
            self._desk.remove_identity(row.candidate)
        except SiloError as error:
            message = str(error)
            self._with_dialog(path, lambda dialog: dialog.tell(message))
            return
        self._with_dialog(path, lambda dialog: dialog.undeclared(row))
        self._save_parents(clean, lambda: self._send(path, [row.candidate]))

    def same(self, rows: Sequence[EditedRow]) -> None:
        """The person leaves these as they are: files that are one part on purpose."""
        files: dict[str, list[str]] = {}
        for row in rows:
            if identity := row.candidate.entry.silo_uuid:
                files.setdefault(identity, []).append(row.candidate.entry.doc_path)
        for identity, paths in files.items():
            if len(set(paths)) > 1:
                self._commits.accept(identity, paths)

    # -- registering ------------------------------------------------------------------------------------

    def register(self, path: str, orders: Sequence[Order]) -> None:
        """Give these components their numbers, one after another."""
        schema = self._preferences.text("Schema")
        registered: list[Candidate] = []
        clean = self._desk.unedited()

        def run(client: Any, control: Any) -> None:
            def tell(order: Order, result: Registration) -> None:
                if result.error is None:
                    registered.append(order.candidate)
                self._session.in_gui(lambda: self._done(path, order, result), control)

            carry_out(
                orders,
                client,
                self._journal,
                lambda candidate, identity: self._session.in_gui(
                    lambda: self._desk.write_identity(candidate, identity), control
                ),
                schema=client.find_schema(schema),
                control=control,
                done=tell,
            )

        def finished(_result: Any = None) -> None:
            self._with_dialog(path, lambda dialog: dialog.stopped())
            # The numbers that were foretold are taken now.
            for category in sorted({order.category for order in orders}):
                self.number(path, category)
            self._save_parents(clean if registered else [], lambda: self._send(path, registered))

        def failed(error: SiloError) -> None:
            if error.code != "cancelled":
                self._with_dialog(path, lambda dialog: dialog.tell(str(error)))
            finished()

        self._session.ask(translate("Silo", "Registering"), run, done=finished, failed=failed)

    def _save_parents(self, clean: list[Any], then: Callable[[], None]) -> None:
        """Save the documents that FreeCAD marked because their parts were saved, one in a turn."""
        if not clean:
            then()
            return
        with suppress(ReferenceError):  # closed meanwhile
            self._desk.save_marked(clean[0])
        self._desk.later(lambda: self._save_parents(clean[1:], then))

    def _done(self, path: str, order: Order, result: Registration) -> None:
        self._with_dialog(path, lambda dialog: dialog.registered(order, result))

    def _send(self, path: str, registered: Sequence[Candidate]) -> None:
        """Upload the files that have an item now, and sync the assembly's BOM with the new lines."""
        if not registered:
            return
        # A copy that became a part of its own is no question any more.
        own = {candidate.entry.doc_path for candidate in registered}
        self._session.answered(lambda asked: not own.isdisjoint(asked.objects))
        registered_now = translate("Silo", "Registered")

        def comment(file: str) -> str:
            return self._commits.comment_of(file) or registered_now

        # A file that gives several parts is no single item's.
        for part in dict.fromkeys(c.entry.doc_path for c in registered if not c.shares_file):
            doc = self._desk.find(part)
            if doc is not None and part != path:
                self._commits.send(doc, comment(part))
        top = self._desk.find(path)
        if top is None:
            return
        if any(candidate.entry.doc_path == path for candidate in registered):
            self._commits.send(top, comment(path))
        else:
            self._commits.sync_only(top)


def whole(taken: Snapshot) -> Extraction:
    """The extraction of a snapshot; for a part, one that holds nothing but the part."""
    if taken.extraction is not None:
        return taken.extraction
    label = taken.label or os.path.basename(taken.path)
    return Extraction(
        BomEntry(taken.path, silo_uuid=taken.identity, label=label, document_label=label, level=0)
    )
