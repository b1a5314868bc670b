# SPDX-License-Identifier: LGPL-2.1-or-later
"""What became of commits that were sent."""

from __future__ import annotations

from dataclasses import dataclass, field

from silo.api.wire import MergeResult
from silo.bom.errors import SiloError
from silo.bom.merge import MergePlan
from silo.bom_sync import Resolved, Status
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
    """

    entry: Entry
    part_number: str
    status: Status | None = None
    resolved: Resolved | None = None
    plan: MergePlan | None = None
    result: MergeResult | None = None
    revision: int | None = None
    sync_id: str = ""


@dataclass
class Report:
    """What became of a run.

    sent, held, failed
        commits that arrived; entries that a person must look at; entries that failed in passing.
    stopped_by
        why the run ended early: nothing answers, read-only, a wrong token, or a person's stop.
    busy
        another process or thread is sending.
    """

    sent: list[Sent] = field(default_factory=list)
    held: list[Entry] = field(default_factory=list)
    failed: list[Entry] = field(default_factory=list)
    stopped_by: SiloError | None = None
    busy: bool = False


def went_alone(entry: Entry) -> list[str]:
    """Says which half of a commit with file and BOM the server has, where the other one was refused."""
    if not entry.has_file or entry.file_left == entry.bom_left:
        return []
    there, left = ("BOM", "file") if entry.file_left else ("file", "BOM")
    return [f"Its {there} is in Silo; only the {left} is not"]
