# SPDX-License-Identifier: LGPL-2.1-or-later
"""From the command to the preview window, and from its buttons to the workers. GUI thread."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Protocol

from silo.bom.entry import BomEntry
from silo.bom.errors import SiloError
from silo.outbox.entry import new_key
from silo.workbench.commit.flow import CommitFlow, commit_of
from silo.workbench.documents.snapshot import Snapshot
from silo.workbench.preview.comparison import Preview, ask, to_sync
from silo.workbench.preview.desk import PreviewDesk
from silo.workbench.preview.rows import MOST_CELL
from silo.workbench.session.session import Session
from silo.workbench.words import plain, translate

if TYPE_CHECKING:
    from silo.bom.key import Key


# Of many sub-assemblies that differ, the first ones.
_MOST_ACCOUNTS = 4
# Of many ways to a part, the first ones; `silo-mod bom --why` prints all.
_MOST_WAYS = 12


class PreviewWindow(Protocol):
    """An open preview; :mod:`silo.workbench.preview.dialog` is the real one."""

    def busy(self) -> None: ...

    def fill(self, preview: Preview, /) -> None: ...

    def fail(self, error: SiloError, /) -> None: ...

    def tell_view(self, text: str, /, *, agrees: bool | None) -> None: ...

    def raise_(self) -> None: ...


class PreviewFlow:
    """Opens previews, one per document, and does what their buttons ask for.

    register, show, view
        what the add-on does for the window: register what a preview lists, select objects, open a page.
    """

    def __init__(
        self,
        session: Session,
        commits: CommitFlow,
        desk: PreviewDesk,
        *,
        register: Callable[[str], None],
        show: Callable[[str, tuple[str, ...]], None],
        view: Callable[[str], None],
        known: Callable[[str, Iterable[BomEntry]], None] = lambda _path, _entries: None,
    ) -> None:
        self._session, self._commits, self._desk = session, commits, desk
        self.register, self.show, self.view, self._known = register, show, view, known
        self._open: dict[str, PreviewWindow] = {}
        self._to_mend: set[str] = set()

    def start(self, doc: Any, *, mend: bool = False) -> None:
        """Compare a document's assembly with the server; ``mend``: first repair its broken links, if a file
        fits.
        """
        taken = self._take(doc)
        if taken is None:
            return
        if not taken.is_assembly:
            text = taken.problem or translate("Silo", "{name} holds no assembly, so it has no BOM.")
            self._desk.warn(translate("Silo", "BOM in Silo"), text.replace("{name}", taken.label))
            return
        self._dialog(taken, doc.Name)
        if mend:
            self._to_mend.add(taken.path)
        self._ask(taken)

    def again(self, path: str) -> None:
        """Compare again in an open window, since what it shows has changed."""
        if path in self._open and (taken := self._taken_again(path)) is not None:
            self._ask(taken)

    def _taken_again(self, path: str) -> Snapshot | None:
        """Take a new snapshot of the document of an open window; if the document is closed, the window says
        so.
        """
        doc = self._opened(path, path)
        return None if doc is None else self._take(doc)

    def _opened(self, path: str, window: str) -> Any:
        doc = self._desk.find(path)
        if doc is None:
            error = SiloError(
                translate(
                    "Silo",
                    "{name} is not open any more. Open it, then compare again.",
                    name=plain(os.path.basename(path), 80),
                )
            )
            self._with_dialog(window, lambda dialog: dialog.fail(error))
        return doc

    def _take(self, doc: Any) -> Snapshot | None:
        try:
            return self._commits.snapshot(doc)
        except SiloError as error:
            self._desk.warn(translate("Silo", "BOM in Silo"), str(error))
            return None

    def _dialog(self, taken: Snapshot, name: str) -> None:
        if taken.path in self._open:
            self._open[taken.path].raise_()
            return
        self._open[taken.path] = self._desk.preview_window(taken.label or name, taken.path, self)

    def closed(self, path: str) -> None:
        """Forget the closed window of this document."""
        self._open.pop(path, None)
        self._to_mend.discard(path)

    def _ask(self, taken: Snapshot, note: str = "") -> None:
        self._with_dialog(taken.path, lambda dialog: dialog.busy())

        self._session.ask(
            translate("Silo", "Comparing with Silo"),
            lambda client, control: replace(ask(taken, client, control), note=note),
            done=self._answered,
            failed=lambda error: self._with_dialog(taken.path, lambda dialog: dialog.fail(error)),
        )

    def _answered(self, preview: Preview) -> None:
        path = preview.snapshot.path
        self._known(path, preview.top.resolved.entries)
        self._with_dialog(path, lambda dialog: dialog.fill(preview))
        if path in self._to_mend:
            self._to_mend.discard(path)
            self.relink(preview)

    def _with_dialog(self, path: str, call: Callable[[PreviewWindow], None]) -> None:
        # The window may have been closed while the server was thinking.
        if path in self._open:
            call(self._open[path])

    def verify(self, preview: Preview) -> None:
        """Compare what FreeCAD shows with the present BOM, and select what no line explains."""
        path = preview.snapshot.path
        taken = self._taken_again(path)
        if taken is None or taken.extraction is None:
            return
        try:
            accounts = self._desk.accounts(taken.extraction)
        except SiloError as error:
            self._desk.warn(translate("Silo", "BOM in Silo"), str(error))
            return
        differing = [account for account in accounts if not account.agrees]
        lines = [account.sentence() for account in (differing or accounts[:1])[:_MOST_ACCOUNTS]]
        text = "\n".join(lines)
        self._with_dialog(path, lambda dialog: dialog.tell_view(text, agrees=not differing))
        unexplained = next((account for account in differing if account.unexplained), None)
        if unexplained is not None:
            self.show(unexplained.doc_path, unexplained.unexplained)

    def why(self, window: str, document: str, assembly: str, parts: Collection[Key]) -> None:
        """Show in a window each chain from an assembly to a part of it."""
        if (doc := self._opened(document, window)) is None:
            return
        try:
            lines = self._desk.why(doc, assembly, parts)
        except SiloError as error:
            lines = [str(error)]
        if (more := len(lines) - _MOST_WAYS) > 0:
            lines[_MOST_WAYS:] = [translate("Silo", "… and {n} more", n=more)]
        text = "\n".join(plain(line, MOST_CELL) for line in lines)
        self._with_dialog(window, lambda dialog: dialog.tell_view(text, agrees=None))

    def decide(self, window: str, document: str, names: tuple[str, ...], *, counts: bool) -> None:
        """Keep in a document which hidden objects count, or are references; then compare again."""
        if (doc := self._opened(document, window)) is None:
            return
        try:
            labels = self._desk.write_answer(doc, names, counts=counts)
        except SiloError as error:
            self._desk.warn(translate("Silo", "BOM in Silo"), str(error))
            return
        text = (
            translate("Silo", "Counted from now on: {names}. Save the file to keep that.")
            if counts
            else translate(
                "Silo", "References from now on, not counted: {names}. Save the file to keep that."
            )
        )
        told = text.replace("{names}", plain(", ".join(labels), MOST_CELL))
        self._with_dialog(window, lambda dialog: dialog.tell_view(told, agrees=None))
        self.again(window)

    def relink(self, preview: Preview) -> None:
        """Lead broken links to the files that were meant, if exactly one fits; then compare again."""
        try:
            mended = [label for finding in preview.movable for label in self._desk.relink(finding)]
        except SiloError as error:
            self._desk.warn(translate("Silo", "BOM in Silo"), str(error))
            mended = []
        if mended:
            self.again(preview.snapshot.path)

    def sync(self, preview: Preview, below: bool, allow_missing: bool) -> None:
        """Sync what is shown; ``below``: its sub-assemblies first; ``allow_missing``: with broken links.

        If the document was edited since, it is compared again instead, because its BOM and its file must be
        of the same state.
        """
        path = preview.snapshot.path
        now = self._taken_again(path)
        if now is None:
            return
        if not now.is_as(preview.snapshot):
            self._ask(
                now,
                translate(
                    "Silo",
                    "Nothing was synced: {name} was edited since the comparison. Here it is now.",
                    name=plain(now.label, 80),
                ),
            )
            return

        def failed(error: SiloError) -> None:
            self._with_dialog(path, lambda dialog: dialog.fail(error))

        for taken in to_sync(preview, below=below):
            commit = commit_of(taken, key=new_key(), allow_missing=allow_missing)
            if commit is None:
                continue
            try:
                commit = self._commits.made_from(commit, self._desk.find(taken.path))
            except SiloError as error:
                failed(error)
            else:
                self._session.keep(commit, failed=failed)
