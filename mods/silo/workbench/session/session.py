# SPDX-License-Identifier: LGPL-2.1-or-later
"""What happens between FreeCAD and the server while FreeCAD runs: workers, connection, and what is shown.

Methods are called in the GUI thread and return at once. Work is done by workers, so that a commit is on
disk at once even while copies take long or the network hangs: for rows, for copies, for the server. Results
come back through ``deliver``. No widgets here, and no FreeCAD, so that all of it runs in any test.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from silo.bom.errors import ConfigError, PackageError, SiloError
from silo.bom.message import message
from silo.outbox.entry import Commit, State
from silo.outbox.entry import Entry as Waiting
from silo.outbox.store import OutboxError, Store
from silo.workbench.activity.box import Action, PaneEntry
from silo.workbench.colleagues.announced import Colleagues, Newer
from silo.workbench.session.state import Listener, PaneState
from silo.workbench.session.worker import Busy, Control, Deliver, Job, Worker, in_gui
from silo.workbench.settings.server import ServerChoice, ServerPreferences, TokenStore
from silo.workbench.words import spoken, translate

if TYPE_CHECKING:
    from silo.api.client import SiloClient
    from silo.api.pause import Pause
    from silo.outbox.held_here import HeldHere
    from silo.outbox.report import Sent
    from silo.workbench.colleagues.theirs import Theirs
    from silo.workbench.documents.opened import DocumentOrigin
    from silo.workbench.session.online import Online

    _Looked = tuple[tuple[Waiting, ...], Pause | None, tuple[HeldHere, ...]]
    """The outbox entries, the server's pause, and the BOMs that are held; read by a worker."""


class Session:
    """One per FreeCAD.

    known
        the server settings of the preferences; replaced by :meth:`settings_changed`.
    store
        the keyring; asked in a worker only.
    folder
        where the outbox is; the user's data folder unless given.
    make_client
        makes the client of a server; for tests.
    drawing
        gives the command that draws models of files, as :func:`silo.drawing.models.send_models` takes it.
    """

    def __init__(
        self,
        deliver: Deliver,
        known: ServerPreferences,
        store: TokenStore,
        *,
        listener: Listener | None = None,
        folder: Path | None = None,
        make_client: Callable[[ServerChoice], Any] | None = None,
        drawing: Callable[[], Sequence[str]] | None = None,
    ) -> None:
        self._make_client, self._drawing = make_client, drawing
        self._deliver, self._listener, self._folder = deliver, listener or Listener(), folder
        self._known, self._store = known, store
        self.shown = PaneState()
        self.outbox = Store(folder / "outbox.sqlite3" if folder is not None else None)
        bug = self._listener.bug
        self._rows = Worker("silo-rows", deliver, on_bug=bug)
        self._disk = Worker("silo-disk", deliver, on_bug=bug)
        self._net = Worker("silo-network", deliver, on_busy=self._busy, on_bug=bug)
        # What a user waits for on the preference page must not queue behind a long upload.
        self._aside = Worker("silo-aside", deliver, on_bug=bug)
        self._looks = Worker("silo-looks", deliver, on_bug=bug)
        self._models = Worker("silo-models", deliver, on_bug=bug)
        self._undrawn: dict[Path, str] = {}
        # Path → when its file last became a revision, in seconds of time.monotonic.
        self._sent_at: dict[str, float] = {}
        self._online: Online | None = None
        self._live = False
        self._colleagues = Colleagues()
        self._comparing = False
        # The outbox could not be used, as on a full disk: something may wait that is not shown.
        self._outbox_failed = False

    # -- the server -------------------------------------------------------------------------------------

    def begin(self, *, live: bool) -> None:
        """Connect, if a server is configured; send what an earlier FreeCAD left."""
        self._live = live
        self._net.submit(
            Job(translate("Silo", "Connecting"), self._connect, done=self._connected, failed=self.problem)
        )

    def settings_changed(self, preferences: ServerPreferences, *, live: bool) -> None:
        """Take over new settings."""
        self._known = preferences
        self.begin(live=live)

    def _connect(self, _control: Control) -> tuple[ServerChoice, _Looked]:
        server = self._need_online().connect(self._known, self._store, live=self._live)
        return server, self._look()

    def _look(self) -> _Looked:
        online = self._online
        held = self.outbox.held_boms(online.address) if online is not None and online.address else ()
        return self.outbox.entries(), online.pause() if online is not None else None, held

    def _need_online(self) -> Online:
        """Make it when a worker first needs it, because its import would delay FreeCAD's start."""
        if self._online is None:
            from silo.workbench.session.online import Online

            self._online = Online(
                self.outbox,
                entry=lambda entry: self._deliver(lambda: self.add(entry)),
                sent=lambda sent: self._deliver(lambda: self._arrived(sent)),
                newer=lambda identity, newer: self._deliver(lambda: self._heard(identity, newer)),
                state=lambda kind, reason: self._deliver(lambda: self._connection(kind, reason)),
                make_client=self._make_client,
            )
        return self._online

    def _connected(self, result: tuple[ServerChoice, _Looked]) -> None:
        server, looked = result
        for entry in looked[0]:
            self._colleagues.sending(entry.identity)
        self._show(server=server, theirs={})
        self._waits(looked)
        if looked[0] and server.configured:
            self.send(force=False)
        if looked[2]:
            self.free_held()

    def _connection(self, kind: str, reason: str) -> None:
        before = self.shown.connection
        self._show(connection=kind, reason=reason)
        if kind == "online" and before != "online" and self.shown.waiting:
            self.send(force=False)

    # -- commits ----------------------------------------------------------------------------------------

    def keep(
        self, commit: Commit, failed: Callable[[SiloError], None], base: DocumentOrigin | None = None
    ) -> None:
        """Put a commit on disk, then send it. ``failed`` is called if the disk cannot be written.

        ``base``: the base of the document; from now on, this commit is its base.

        Its row does not wait for the copies of other commits: as soon as the row is on disk, the commit
        cannot be lost.
        """
        title = translate("Silo", "Keeping the commit")
        self._colleagues.sending(commit.identity)

        def finish(_control: Control) -> None:
            made_from, content = base.content if base is not None and commit.origin else "", ""
            try:
                content = self.outbox.finish(commit.key, commit.file, made_from)
            except (OutboxError, OSError) as error:
                text = translate("Silo", "The commit is kept. It is sent as soon as its file can be copied.")
                outbox_error = OutboxError(
                    f"{commit.label or commit.path}: {text} {error}"
                )  # its row is on disk
                self._deliver(lambda: self.problem(outbox_error))
            if base is not None:
                base.committed(content)

        def stage(_control: Control) -> None:
            self.outbox.stage(commit, self._online.address if self._online is not None else "")
            self._disk.submit(Job(title, finish, done=lambda _kept: self.send(force=False), failed=failed))

        self._rows.submit(Job(title, stage, failed=failed))

    def after_keeping(self, then: Callable[[], None]) -> None:
        """Call something in the GUI thread after all earlier commits are on disk with their copies."""
        title = translate("Silo", "Keeping the commit")

        def behind(_control: Control) -> None:
            self._disk.submit(Job(title, lambda _control: None, done=lambda _none: then()))

        self._rows.submit(Job(title, behind))

    def send(self, *, force: bool) -> None:
        """Send what waits, but nothing in a pause; ``force`` first ends all pauses of the server."""

        def run(control: Control) -> Any:
            online = self._need_online()
            try:
                online.need_client(self._known, self._store)
                report = online.send(control, force=force)
            except ConfigError:
                # Without a server all that waits is kept; the pane says what to do.
                report = None
            looked = self._look()
            if looked[1] is None:
                online.wake()
            return report, looked

        self._net.submit(
            Job(
                translate("Silo", "Sending to Silo"),
                run,
                done=self._sent_all,
                failed=self.problem,
                same_as=f"send {force}",
            )
        )

    def _sent_all(self, result: Any) -> None:
        report, looked = result
        self._colleagues.sent(entry.identity for entry in looked[0] if entry.state is not State.HELD)
        self._waits(looked, newer=self._colleagues.newer)
        self._draw()
        stopped = report.stopped_by if report is not None else None
        if stopped is not None and stopped.code != "cancelled":
            self._show(reason=str(stopped), connection=self._connection_after(stopped))

    def _connection_after(self, error: SiloError) -> str:
        # The live connection knows best; without one, this is all that is known.
        if self.shown.connection in ("stopped", "unsupported"):
            return {"unauthorized": "refused", "read_only": "read-only"}.get(error.code, "offline")
        return self.shown.connection

    def _heard(self, identity: str, newer: Newer | None) -> None:
        if newer is None:
            self._colleagues.forget_own()
            self._look_again()
            return
        self._colleagues.heard(identity, newer)
        self._show(newer=self._colleagues.newer)

    def _look_again(self) -> None:
        """Look after a restore of the server if an announced commit of a colleague is gone."""
        if seen := self.shown.newer:
            from silo.workbench.colleagues.look import gone

            title = translate("Silo", "Looking for colleagues' commits")
            self.ask(
                title,
                lambda client, control: gone(client, seen, control.cancelled),
                done=partial(self.no_news, seen),
                failed=lambda _error: None,  # the notices stay
            )

    def no_news(self, seen: Mapping[str, Newer], identities: Iterable[str]) -> None:
        """Note that the server has nothing newer of these items; ``seen``: what was shown when it was
        asked.
        """
        self._colleagues.gone(seen, identities)
        self._show(newer=self._colleagues.newer)

    def _arrived(self, sent: Sent) -> None:
        if sent.revision is not None:
            self._colleagues.arrived(sent.entry.identity, sent.revision)
            if sent.entry.has_file:
                self._sent_at[sent.entry.path] = time.monotonic()
            self._show(newer=self._colleagues.newer)
        if sent.uploaded is not None and sent.entry.path:
            self._undrawn[Path(sent.entry.path)] = sent.entry.sha256
        self._listener.sent(sent)

    def has_sent(self, path: str, since: float) -> bool:
        """Return True if a file became a revision in Silo, from here, since a moment of
        :func:`time.monotonic`; not if Silo had it already.
        """
        return self._sent_at.get(path, -1.0) >= since

    def _draw(self) -> None:
        """Draw the files that have arrived, so that Silo shows them in 3D; their commits are finished
        already.
        """
        files, self._undrawn = self._undrawn, {}
        if not files or self._drawing is None:
            return
        try:
            command = self._drawing()
        except ConfigError:
            return

        def run(control: Control) -> tuple[int, list[str]]:
            from silo.drawing.models import send_models

            with self._need_online().another() as client:
                return send_models(client, files.items(), command=command, cancelled=control.cancelled)

        def done(outcome: tuple[int, list[str]]) -> None:
            for problem in outcome[1]:
                self._listener.console(message("[Silo] {problem}", problem=spoken(problem)))

        title = translate("Silo", "Drawing models")
        self._models.submit(Job(title, run, done=done))

    def tick(self) -> None:
        """Send what waits again when its time has come; a timer calls this."""
        # A log-in by the command line ends the pause of a wrong token.
        is_refused = self.shown.connection == "refused"
        if (self.shown.waiting or self._outbox_failed or is_refused) and self._net.idle:
            self.send(force=False)

    def retry(self, entry_id: int) -> None:
        """Send again an entry that waited for a decision."""
        self._change(lambda: self.outbox.retry(entry_id), send=True)

    def send_here(self, entry_ids: Iterable[int]) -> None:
        """Send entries that are meant for another address to the server in use."""
        ids = tuple(entry_ids)

        def move() -> None:
            here = self._need_online().address
            for entry_id in ids:
                self.outbox.retry(entry_id, server=here)

        self._change(move, send=True)

    def retry_all(self) -> None:
        """End the pauses of the server: connect, and send everything that waits, now."""
        self.send(force=True)

    def discard(self, entry_id: int, *, keep: bool = False) -> None:
        """Forget an entry that waits; the document is not touched. ``keep``: a copy of its file stays."""
        self._change(lambda: self.outbox.discard(entry_id, keep=keep))

    def save_copy(self, entry_id: int, target: Path) -> None:
        """Write the file of an entry that waits to another place."""
        self._change(lambda: self.outbox.save_copy(entry_id, target))

    def _change(self, change: Callable[[], None], *, send: bool = False) -> None:
        def run(_control: Control) -> _Looked:
            change()
            return self._look()

        def done(looked: _Looked) -> None:
            self._waits(looked)
            if send:
                self.send(force=True)

        self._disk.submit(Job(translate("Silo", "Outbox"), run, done=done, failed=self.problem))

    def _waits(self, looked: _Looked, **more: Any) -> None:
        """Show what waits. A worker finds out what colleagues changed, if commits are held because of it."""
        waiting, pause, held = looked
        asked = {entry.id: entry for entry in waiting if entry.newer and entry.path}
        their_versions = {
            number: their_version for number, their_version in self.shown.theirs.items() if number in asked
        }
        self._outbox_failed = False
        self._show(waiting=waiting, pause=pause, held=held, theirs=their_versions, **more)
        left = [entry for number, entry in asked.items() if number not in their_versions]
        if not left or self._comparing:
            return

        def compare(client: SiloClient, control: Control) -> dict[int, Theirs | None]:
            from silo.workbench.colleagues.look import look_held

            return {entry.id: look_held(client, self.outbox, entry, control.cancelled) for entry in left}

        def done(theirs: dict[int, Theirs | None]) -> None:
            self._comparing = False
            # Decided meanwhile, and perhaps held again because of a third revision.
            new = {entry.id: theirs[entry.id] for entry in left if entry in self.shown.waiting}
            self._show(theirs={**self.shown.theirs, **new})

        def failed(_error: SiloError) -> None:
            self._comparing = False  # the question stands without its details; asked again with the next look

        self._comparing = True
        self.ask(translate("Silo", "Comparing with Silo"), compare, done, failed)

    def free_held(self) -> None:
        """Send the BOMs that were held and can go now."""

        def look(client: SiloClient, _control: Control) -> int:
            from silo.vault.project import free_held  # late: FreeCAD's start waits for this module

            return free_held(client, self.outbox)

        def done(count: int) -> None:
            if count:
                self.send(force=False)

        self.ask(translate("Silo", "Looking at held BOMs"), look, done, failed=lambda _error: None)

    # -- anything else that asks the server -------------------------------------------------------------

    def ask(
        self,
        title: str,
        question: Callable[[SiloClient, Control], Any],
        done: Callable[[Any], None],
        failed: Callable[[SiloError], None],
    ) -> None:
        """Ask the server something; the answer, or the error, comes back in the GUI thread."""

        def run(control: Control) -> Any:
            online = self._need_online()
            online.need_client(self._known, self._store)
            return question(online.client, control)

        self._net.submit(Job(title, run, done=done, failed=failed))

    def aside(
        self,
        title: str,
        work: Callable[[Control], Any],
        done: Callable[[Any], None],
        failed: Callable[[SiloError], None],
    ) -> None:
        """Do work that needs no server of the session (settings, keyring) in a worker."""
        self._aside.submit(Job(title, work, done=done, failed=failed))

    def look(self, work: Callable[[], object]) -> None:
        """Read files in a worker; the result is not waited for."""
        self._looks.submit(Job(message("Reading files"), lambda _control: work()))

    def newer_than(self, identity: str, since: float) -> Newer | None:
        """Return a colleague's commit of an item after ``since`` (:func:`time.monotonic`), if the server
        announced one.
        """
        newer = self.shown.newer.get(identity.lower())
        return newer if newer is not None and newer.at > since else None

    def in_gui(self, call: Callable[[], Any], control: Control) -> Any:
        """Run ``call`` in the GUI thread for a job; wait, and return or raise what it returns or raises."""
        return in_gui(self._deliver, call, control)

    def cancel(self) -> None:
        """Stop what the network worker is doing."""
        self._net.cancel()

    def close(self, wait: Callable[[Callable[[float], int]], object] = lambda left: left(60.0)) -> None:
        """Close when FreeCAD ends: wait for the disk, never for the network. What is not sent waits for the
        next start.

        wait
            gets a function that waits for so many seconds and returns how many files are still to be written;
            ``wait`` ends when there are none, or when a user does not want to wait any longer.
        """
        self._net.cancel()
        if self._unfinished(0.0):
            wait(self._unfinished)
        for worker in (self._aside, self._looks, self._models, self._rows, self._disk, self._net):
            worker.close(0.5)
        if self._online is not None:
            self._online.close()

    def _unfinished(self, seconds: float) -> int:
        # A row is followed by its copy, so the rows are asked first.
        return self._rows.left(seconds) + self._disk.left(seconds)

    @property
    def idle(self) -> bool:
        """Return True if no worker has work that a user waits for."""
        return self._rows.idle and self._disk.idle and self._net.idle and self._aside.idle

    # -- what is shown ----------------------------------------------------------------------------------

    def add(self, entry: PaneEntry) -> None:
        """Show one more box."""
        self._show(activity=self.shown.activity.add(entry))

    def answered(self, is_answered: Callable[[Action], bool]) -> None:
        """Note that questions in the boxes are answered (:meth:`Entry.without_questions`)."""
        self._show(activity=self.shown.activity.answered(is_answered))

    def _busy(self, busy: Busy | None) -> None:
        self._show(busy=busy)

    def problem(self, error: SiloError) -> None:
        """Show a problem that belongs to nothing else that is shown."""
        self._outbox_failed |= isinstance(error, OutboxError)
        if isinstance(error, PackageError):
            self._show(connection="packages", reason=str(error))
            return
        if error.code != "cancelled":
            self._show(reason=str(error))
            if error.code != "bad_config":
                self._listener.console(message("[Silo] {error}", error=spoken(error)))

    def _show(self, **changes: Any) -> None:
        shown = replace(self.shown, **changes)
        if shown != self.shown:
            self.shown = shown
            self._listener.shown(shown)
