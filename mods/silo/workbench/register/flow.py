# SPDX-License-Identifier: LGPL-2.1-or-later
"""From the command to the Register Components dialog, and from its buttons to documents and server."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from silo.bom.errors import DocumentError, SiloError
from silo.bom.identity import walk_entries
from silo.bom.model import BomEntry, Extraction
from silo.registration import Journal, Registration
from silo.workbench.commit.flow import CommitFlow
from silo.workbench.commit.snapshot import Snapshot
from silo.workbench.freecad import host, live, saving
from silo.workbench.freecad.open_in_others import OpenInOthers
from silo.workbench.gui import widgets
from silo.workbench.register.registering import Candidate, Order, Seen, State, carry_out, next_number, offer
from silo.workbench.session.session import Session
from silo.workbench.settings.preferences import Preferences
from silo.workbench.words import translate

if TYPE_CHECKING:
    from silo.workbench.register.dialog import RegisterDialog
    from silo.workbench.register.rows import EditedRow


class RegisterFlow:
    """Opens the dialog, one per document, and carries out what it asks for.

    changed
        told of the path of a document whose BOM looks different now.
    """

    def __init__(
        self,
        session: Session,
        preferences: Preferences,
        commits: CommitFlow,
        *,
        changed: Callable[[str], None] = lambda _path: None,
    ) -> None:
        self._session, self._preferences, self._commits = session, preferences, commits
        self._changed = changed
        self._journal = Journal()
        self._open: dict[str, RegisterDialog] = {}

    def start(self, doc: Any) -> None:
        """Show the components of a document that have no number."""
        try:
            taken = self._commits.snapshot(doc)
        except SiloError as error:
            widgets.warn(host.main_window(), translate("Silo", "Register Components"), str(error))
            return
        self._dialog(taken)
        extraction = whole(taken)
        seen = look_at(entry.doc_path for entry in walk_entries((extraction.assembly, *extraction.entries)))
        schema = self._preferences.text("Schema")
        self._session.ask(
            translate("Silo", "Looking for components without a part number"),
            lambda client, control: offer(extraction, seen, client, schema, control, self._journal.pending()),
            done=lambda found: self._with_dialog(taken.path, lambda dialog: dialog.fill(found)),
            failed=lambda error: self._with_dialog(taken.path, lambda dialog: dialog.fail(error)),
        )

    def _dialog(self, taken: Snapshot) -> None:
        from silo.workbench.register.dialog import RegisterDialog, Wishes

        if taken.path in self._open:
            self._open[taken.path].raise_()
            return
        wishes = Wishes(
            register=lambda orders: self._register(taken.path, orders),
            same=self._same,
            number=lambda category: self._number(taken.path, category),
            ask_again=lambda on: self._preferences.set("AskRegister", on),
        )
        dialog = RegisterDialog(
            taken.label, wishes, host.main_window(), asks=self._preferences.flag("AskRegister")
        )
        self._open[taken.path] = dialog
        dialog.finished.connect(lambda _result: self._open.pop(taken.path, None))
        dialog.show()

    def _with_dialog(self, path: str, call: Callable[[RegisterDialog], None]) -> None:
        if path in self._open:
            call(self._open[path])

    def _number(self, path: str, category: str) -> None:
        schema = self._preferences.text("Schema")
        self._session.ask(
            translate("Silo", "Asking for the next number"),
            lambda client, _control: next_number(client, schema, category),
            done=lambda number: self._with_dialog(path, lambda d: d.set_number(category, number)),
            failed=lambda _error: None,
        )

    def _same(self, rows: Sequence[EditedRow]) -> None:
        """The person leaves these as they are: files that are one part on purpose."""
        files: dict[str, list[str]] = {}
        for row in rows:
            if identity := row.candidate.entry.silo_uuid:
                files.setdefault(identity, []).append(row.candidate.entry.doc_path)
        for identity, paths in files.items():
            if len(set(paths)) > 1:
                self._commits.decisions.accept(identity, paths)

    # -- registering ------------------------------------------------------------------------------------

    def _register(self, path: str, orders: Sequence[Order]) -> None:
        schema = self._preferences.text("Schema")
        registered: list[Candidate] = []

        def run(client: Any, control: Any) -> None:
            def tell(order: Order, result: Registration) -> None:
                if result.error is None:
                    registered.append(order.candidate)
                self._session.in_gui(lambda: self._done(path, order, result), control)

            carry_out(
                orders,
                client,
                self._journal,
                lambda candidate, identity: self._session.in_gui(lambda: write(candidate, identity), control),
                schema=client.find_schema(schema),
                control=control,
                done=tell,
            )

        def finished(_result: Any = None) -> None:
            self._with_dialog(path, lambda dialog: dialog.stopped())
            # The numbers that were foretold are taken now.
            for category in sorted({order.category for order in orders}):
                self._number(path, category)
            self._send(path, registered)

        def failed(error: SiloError) -> None:
            if error.code != "cancelled":
                self._with_dialog(path, lambda dialog: dialog.tell(str(error)))
            finished()

        self._session.ask(translate("Silo", "Registering"), run, done=finished, failed=failed)

    def _done(self, path: str, order: Order, result: Registration) -> None:
        self._with_dialog(path, lambda dialog: dialog.registered(order, result))

    def _send(self, path: str, registered: Sequence[Candidate]) -> None:
        """Upload the files that have an item now, and sync the assembly's BOM with the new lines."""
        if not registered:
            return
        comment = translate("Silo", "Registered")
        # A file that gives several parts is no single item's.
        for part in dict.fromkeys(c.entry.doc_path for c in registered if not c.shares_file):
            doc = host.find_document(part)
            if doc is not None and part != path:
                self._commits.send(doc, comment)
        top = host.find_document(path)
        if top is None:
            return
        if any(candidate.entry.doc_path == path for candidate in registered):
            self._commits.send(top, comment)
        else:
            self._commits.sync_only(top)
        self._changed(path)


def whole(taken: Snapshot) -> Extraction:
    """The extraction of a snapshot; for a part, one that holds nothing but the part."""
    if taken.extraction is not None:
        return taken.extraction
    label = taken.label or os.path.basename(taken.path)
    return Extraction(
        BomEntry(taken.path, silo_uuid=taken.identity, label=label, document_label=label, level=0)
    )


def look_at(paths: Iterable[str]) -> dict[str, Seen]:
    """How the files of components stand. GUI thread; what needs the disk's content is left to the worker."""
    known = host.documents_by_path()
    own = next((str(doc.TransientDir) for doc in known.values()), "")
    elsewhere = OpenInOthers(own)
    seen = {}
    for path in dict.fromkeys(paths):
        seen[path] = _look_at(path, known)
        spelt = known[path].FileName if path in known else ""
        if seen[path].state.usable and elsewhere.has(path, spelt):
            seen[path] = replace(seen[path], state=State.ELSEWHERE)
    return seen


def _look_at(path: str, known: Mapping[str, Any]) -> Seen:
    if not path:
        return Seen(State.UNNAMED)
    if not os.path.isfile(path):
        return Seen(State.MISSING)
    if not saving.is_writable(path):
        return Seen(State.READ_ONLY)
    doc = known.get(path)
    if doc is None:
        return Seen(State.READY)
    if live.lost_assemblies(doc):
        return Seen(State.LOST)
    saved_at = str(getattr(doc, "LastModifiedDate", "") or "")
    if not saving.is_modified(doc):
        return Seen(State.READY, saved_at)
    return Seen(State.PARTIAL if host.is_partial(doc) else State.EDITED, saved_at)


def write(candidate: Candidate, identity: str) -> None:
    """Write an identity into a component's document and save it. GUI thread."""
    entry = candidate.entry
    doc = saving.open_fully(entry.doc_path)
    if live.lost_assemblies(doc):
        raise DocumentError(entry.doc_path, "made by a newer FreeCAD; saving it here would destroy it")
    saving.write_identity(doc, entry.object_name, identity, whole_document=not candidate.shares_file)
    saving.save(doc)
