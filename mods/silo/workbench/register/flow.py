# SPDX-License-Identifier: LGPL-2.1-or-later
"""From the command to the Register Parts dialog, and from its buttons to documents and server. GUI thread.

::

    start ── a worker looks ──▶ the dialog is filled ──▶ a user orders ──▶ a worker registers, one by one
                                       ▲                                          │ identities: GUI thread
                                       ╰─────────────── next numbers ◀── commits ◀┘

FreeCAD and Qt come in through the :class:`~silo.workbench.register.desk.RegisterDesk` only.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any, Protocol

from silo.bom.entry import BomEntry, Extraction, walk_entries
from silo.bom.errors import SiloError
from silo.registering.candidate import Candidate
from silo.registering.carry_out import carry_out, take_back
from silo.registering.items import Registration
from silo.registering.journal import Journal
from silo.registering.offer import Offer, next_number, offer
from silo.registering.request import RegistrationRequest
from silo.registering.saved_file import picture_in
from silo.workbench.commit.flow import CommitFlow
from silo.workbench.documents.snapshot import Snapshot
from silo.workbench.register.desk import RegisterDesk
from silo.workbench.register.rows import EditedRow
from silo.workbench.session.session import Session
from silo.workbench.settings.preferences import Preferences
from silo.workbench.words import translate


class RegisterWindow(Protocol):
    """An open dialog; :mod:`silo.workbench.register.dialog` is the real one."""

    def fill(self, offer: Offer, /) -> None: ...

    def fail(self, error: SiloError, /) -> None: ...

    def set_number(self, category: str, number: str, /) -> None: ...

    def registered(self, request: RegistrationRequest, result: Registration, /) -> None: ...

    def undeclared(self, row: EditedRow, /, *, no_part: bool) -> None: ...

    def taken_back(self, request: RegistrationRequest, error: SiloError | None, /) -> None: ...

    def show_pictures(self, pictures: Mapping[str, bytes], /) -> None: ...

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
        desk: RegisterDesk,
        *,
        journal: Journal | None = None,
    ) -> None:
        self._session, self._preferences, self._commits = session, preferences, commits
        self._desk = desk
        self._journal = journal or Journal()
        self._open: dict[str, RegisterWindow] = {}
        # Path → what the last press of Register did there.
        self._last: dict[str, list[tuple[RegistrationRequest, Registration]]] = {}

    def start(self, doc: Any) -> None:
        """Open a dialog with the components of a document that have no number."""
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
            done=lambda new_offer: self._show_offer(taken.path, new_offer),
            failed=lambda error: self._with_dialog(taken.path, lambda dialog: dialog.fail(error)),
        )

    def _show_offer(self, path: str, new_offer: Offer) -> None:
        self._with_dialog(path, lambda dialog: dialog.fill(new_offer))
        files = {candidate.entry.doc_path for candidate in new_offer.candidates if candidate.entry.doc_path}

        def show(pictures: Mapping[str, bytes]) -> None:
            self._with_dialog(path, lambda dialog: dialog.show_pictures(pictures))

        self._session.aside(
            translate("Silo", "Reading pictures"),
            lambda _control: {file: picture for file in files if (picture := picture_in(file))},
            done=show,
            failed=lambda _error: None,  # the rows are shown without them
        )

    def _dialog(self, taken: Snapshot) -> None:
        if taken.path in self._open:
            self._open[taken.path].raise_()
            return
        asks = self._preferences.flag("AskRegister")
        self._open[taken.path] = self._desk.register_window(taken.label, taken.path, self, asks=asks)

    def closed(self, path: str) -> None:
        """Forget the closed dialog of this document."""
        self._open.pop(path, None)
        self._last.pop(path, None)

    def ask_again(self, on: bool) -> None:
        """Set if a user wants to be asked after each commit."""
        self._preferences.set("AskRegister", on)

    def _with_dialog(self, path: str, call: Callable[[RegisterWindow], None]) -> None:
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

    def undeclare(self, path: str, row: EditedRow, *, no_part: bool = False) -> None:
        """Undo decisions about what is modelled in the assembly's file; an item stays.

        no_part
            a user says that it is no part, and the file records that.
        """
        clean = self._desk.unedited()
        try:
            self._desk.remove_identity(row.candidate, no_part=no_part)
        except SiloError as error:
            message = str(error)
            self._with_dialog(path, lambda dialog: dialog.tell(message))
            return
        self._with_dialog(path, lambda dialog: dialog.undeclared(row, no_part=no_part))
        self._save_parents(clean, lambda: self._send(path, [row.candidate]))

    def same(self, rows: Sequence[EditedRow]) -> None:
        """Accept that these files are one part on purpose."""
        files: dict[str, list[str]] = {}
        for row in rows:
            if identity := row.candidate.entry.silo_uuid:
                files.setdefault(identity, []).append(row.candidate.entry.doc_path)
        for identity, paths in files.items():
            if len(set(paths)) > 1:
                self._commits.accept(identity, paths)

    # -- registering ------------------------------------------------------------------------------------

    def register(self, path: str, requests: Sequence[RegistrationRequest]) -> None:
        """Give these components their numbers, one after another."""
        schema = self._preferences.text("Schema")
        registered: list[Candidate] = []
        last = self._last[path] = []
        clean = self._desk.unedited()

        def run(client: Any, control: Any) -> None:
            def tell(request: RegistrationRequest, result: Registration) -> None:
                if result.error is None:
                    registered.append(request.candidate)
                    last.append((request, result))
                self._session.in_gui(lambda: self._show_registered(path, request, result), control)

            carry_out(
                requests,
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
            # The numbers that were shown before are used now.
            for category in sorted({request.category for request in requests}):
                self.number(path, category)
            self._save_parents(clean if registered else [], lambda: self._send(path, registered))

        def failed(error: SiloError) -> None:
            if error.code != "cancelled":
                self._with_dialog(path, lambda dialog: dialog.tell(str(error)))
            finished()

        self._session.ask(translate("Silo", "Registering"), run, done=finished, failed=failed)

    def can_take_back(self, path: str) -> bool:
        """Return True if the last press of Register did something that can be undone."""
        return any(not request.candidate.entry.is_standard for request, _ in self._last.get(path, ()))

    def take_back(self, path: str) -> None:
        """Undo the last press of Register: new items are archived, and the files forget them."""
        done = self._last.pop(path, [])
        ids = {result.item_id for _, result in done}
        clean = self._desk.unedited()
        for entry in self._session.shown.waiting:  # not sent yet, and of an item that goes
            if entry.identity in ids:
                self._session.discard(entry.id)

        def run(client: Any, control: Any) -> None:
            def back(request: RegistrationRequest, error: SiloError | None) -> None:
                def tell() -> None:
                    self._with_dialog(path, lambda dialog: dialog.taken_back(request, error))

                self._session.in_gui(tell, control)

            take_back(
                done,
                client,
                self._journal,
                lambda candidate: self._session.in_gui(
                    lambda: self._desk.restore_identity(candidate), control
                ),
                control=control,
                back=back,
            )

        def finished(_result: Any = None) -> None:
            self._with_dialog(path, lambda dialog: dialog.stopped())
            top = self._desk.find(path)
            self._save_parents(clean, lambda: self._commits.sync_only(top) if top is not None else None)

        def failed(error: SiloError) -> None:
            self._with_dialog(path, lambda dialog: dialog.tell(str(error)))
            finished()

        self._session.ask(translate("Silo", "Undoing"), run, done=finished, failed=failed)

    def _save_parents(self, clean: list[Any], then: Callable[[], None]) -> None:
        """Save, one in a turn, the documents that FreeCAD marked because their parts were saved."""
        if not clean:
            then()
            return
        with suppress(ReferenceError):  # closed meanwhile
            self._desk.save_marked(clean[0])
        self._desk.later(lambda: self._save_parents(clean[1:], then))

    def _show_registered(self, path: str, request: RegistrationRequest, result: Registration) -> None:
        self._with_dialog(path, lambda dialog: dialog.registered(request, result))

    def _send(self, path: str, registered: Sequence[Candidate]) -> None:
        """Upload the files that have an item now, and sync the assembly's BOM with the new lines."""
        if not registered:
            return
        # A copy that became a separate part needs no decision any more.
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
    """Return the extraction of a snapshot; for a part, an extraction of the part alone."""
    if taken.extraction is not None:
        return taken.extraction
    label = taken.label or os.path.basename(taken.path)
    return Extraction(
        BomEntry(taken.path, silo_uuid=taken.identity, label=label, document_label=label, level=0)
    )
