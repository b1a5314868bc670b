# SPDX-License-Identifier: LGPL-2.1-or-later
"""What became of the commits of a run."""

from __future__ import annotations

from dataclasses import dataclass, field

from silo.api.files import DocumentId
from silo.api.pause import Pause
from silo.api.wire import MergeResult, ProductSummary, Revision
from silo.bom.compare.merge import MergePlan
from silo.bom.errors import SiloError
from silo.bom.items.part_address import part_page
from silo.bom.message import message
from silo.bom_sync.resolved import Resolved
from silo.bom_sync.steps import Status
from silo.outbox.entry import Entry


@dataclass(frozen=True)
class Sent:
    """What became of one commit.

    status
        of the BOM; None where there was none to sync.
    plan
        what was compared; None where the request was made by an earlier run.
    revision
        the file's new revision; None where it had none, or the server had this very file already.
    sync_id
        names the BOM's merge; "" where there was none to sync.
    uploaded
        the revision that the file became, as the server answered.
    undone
        colleagues' revisions that came between the look and the upload, and that the file undoes: a server
        without a check of the base takes it anyway.
    summary
        what the server keeps of the product then; None where it does not say.
    """

    entry: Entry
    part_number: str
    status: Status | None = None
    resolved: Resolved | None = None
    plan: MergePlan | None = None
    result: MergeResult | None = None
    revision: int | None = None
    sync_id: str = ""
    uploaded: Revision | None = None
    undone: tuple[Revision, ...] = ()
    summary: ProductSummary | None = None

    @property
    def number(self) -> str:
        """Return the item's part number; "" for a document without one."""
        return "" if isinstance(self.part_number, DocumentId) else self.part_number

    @property
    def conflict(self) -> str:
        """Say whose revisions the file undoes, and what to do; "" if it undoes none."""
        if not self.undone:
            return ""
        newest = self.undone[-1]
        who = newest.created_by or "somebody"
        return message(
            "{who} committed revision {theirs} while this was sent as revision {mine}, which does not have "
            "it: this Silo does not check it. Look at revision {theirs}, and commit what both of you changed",
            who=who,
            theirs=newest.revision_number,
            mine=self.revision or 0,
        )

    @property
    def page(self) -> str:
        """Return the address of the page for it on the server."""
        return part_page(self.number, "bom") if self.number else f"/documents/{self.part_number}"


@dataclass
class Report:
    """What became of a run.

    sent, held, failed
        commits that arrived; entries that need the user's choice; entries that failed in passing.
    stopped_by
        why the run ended early: nothing answers, read-only, a wrong token, or the user's stop.
    pause
        why nothing is sent to this server now; None where all went well.
    busy
        another process or thread is sending.
    """

    sent: list[Sent] = field(default_factory=list)
    held: list[Entry] = field(default_factory=list)
    failed: list[Entry] = field(default_factory=list)
    stopped_by: SiloError | None = None
    pause: Pause | None = None
    busy: bool = False
