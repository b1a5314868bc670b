# SPDX-License-Identifier: LGPL-2.1-or-later
"""A commit of files from the command line: queue what differs from Silo, send it, and look again.

What Silo has after the sending proves the commit: :attr:`CommittedFiles.done` is true if a pull would bring
each file as it is here, each BOM is that of its file, and nothing of these files is left in the queue.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from silo.bom.errors import SiloError
from silo.bom_sync.steps import Status
from silo.file_state import FileState
from silo.outbox.entry import Entry
from silo.outbox.report import Report, Sent
from silo.outbox.send import send_all
from silo.outbox.store import Store
from silo.vault.project import (
    Belonging,
    FileStanding,
    commits,
    compare,
    free_held,
    keep,
    left_in_queue,
    name_documents,
    remember,
    retry_held,
)

if TYPE_CHECKING:
    from silo.api.client import SiloClient


@dataclass(frozen=True)
class CommittedFiles:
    """What became of a commit.

    before, after
        how the files stood, and how they stand now.
    mine
        the keys of the commits that it made.
    left
        the commits of these files that are not in Silo yet, also those of an earlier run.
    """

    belonging: Belonging
    before: Sequence[FileStanding]
    after: Sequence[FileStanding]
    report: Report
    mine: frozenset[str]
    left: Sequence[Entry]

    @property
    def sent(self) -> list[Sent]:
        """Return what arrived of it."""
        return [one for one in self.report.sent if one.entry.key in self.mine]

    @property
    def behind(self) -> list[FileStanding]:
        """Return the files that Silo has otherwise, though nothing of them waits."""
        waits = (FileState.SAME, FileState.WAITING, FileState.HELD)
        return [one for one in self.after if one.state not in waits]

    @property
    def done(self) -> bool:
        """Return True if Silo has all of it now."""
        held = any(one.held for one in self.after)
        undone = any(one.undone or one.status is Status.BLOCKED for one in self.sent)
        unsound = self.belonging.outside or self.belonging.unreadable
        stopped = self.report.stopped_by or self.report.busy
        return not (self.left or self.behind or held or undone or unsound or stopped)


def commit_files(
    belonging: Belonging,
    client: SiloClient | None,
    store: Store,
    *,
    comment: str = "",
    allow_missing: bool = False,
    on_top: bool = False,
    away: SiloError | None = None,
    seen: Callable[[Belonging, Sequence[FileStanding]], object] = lambda _belonging, _standings: None,
    on_progress: Callable[[Entry, int, int], object] | None = None,
) -> CommittedFiles:
    """Commit what belongs to a commit of files or folders.

    client
        None: the server cannot be asked now (``away`` says why), and the queue keeps everything.
    on_top
        also files that are newer in Silo, on top of what is there.
    seen
        called with how the files stand before anything is sent.
    """
    belonging = name_documents(belonging, client)
    over = {file.path for file in belonging.files} if on_top else set()
    retry_held(belonging, store, over)
    before = compare(belonging, client, store)
    seen(belonging, before)
    remember(belonging.project, before, client)
    if client is not None:
        free_held(client, store, {file.path for file in belonging.files})
    mine = set()
    for file, commit in commits(
        belonging, before, comment=comment, allow_missing=allow_missing, over_newer=over
    ):
        keep(belonging.project, store, file, commit, client.base_url if client is not None else "")
        mine.add(commit.key)
    report = Report(stopped_by=away)
    if client is not None:
        report = send_all(store, client, force=True, on_progress=on_progress)
    after = compare(belonging, None if report.stopped_by else client, store)
    left = left_in_queue(belonging, store, mine)
    return CommittedFiles(belonging, before, after, report, frozenset(mine), left)
