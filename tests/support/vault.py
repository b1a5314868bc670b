# SPDX-License-Identifier: LGPL-2.1-or-later
"""A vault of two files and a Silo in memory that knows them, for the tests of sending."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from silo.bom.entry import BomEntry, Extraction
from silo.bom.findings import Finding, FindingCode, Place, Severity
from silo.outbox.entry import Commit, Entry
from silo.outbox.report import Report, Sent
from silo.outbox.send import send_all
from silo.outbox.store import Store
from silo.testing import FakeSilo
from silo.workbench.documents.snapshot import Snapshot


@dataclass
class Vault:
    """Top.FCStd with bolts, and what is needed to send it.

    ids
        identity of each item by its name.
    """

    folder: Path
    silo: FakeSilo
    ids: dict[str, str] = field(default_factory=dict)
    told: list[Sent] = field(default_factory=list)
    clock: float = 1000.0

    def __post_init__(self) -> None:
        for name, category, kind in (
            ("Top", "A01", "assembly"),
            ("Bolt", "F01", "part"),
            ("Plate", "M01", "part"),
        ):
            self.ids[name] = self.silo.create_item("kindred-rd", category, name, item_type=kind).id
        self.top.write_bytes(b"top file")
        self.outbox = self.again()

    @property
    def top(self) -> Path:
        return self.folder / "Top.FCStd"

    @property
    def number(self) -> str:
        item = self.silo.get_item_by_uuid(self.ids["Top"])
        assert item is not None
        return item.part_number

    def again(self) -> Store:
        """As after a restart of FreeCAD: everything that was only in memory is gone."""
        self.outbox = Store(self.folder / "outbox.sqlite3")
        return self.outbox

    def send(self, *, force: bool = False, stop: threading.Event | None = None) -> Report:
        return send_all(self.outbox, self.silo, on_sent=self.told.append, force=force, cancelled=stop)

    def waiting(self) -> tuple[Entry, ...]:
        return self.outbox.entries()

    def part(self, name: str, quantity: int = 1, identity: str | None = None) -> BomEntry:
        return BomEntry(
            str(self.folder / f"{name}.FCStd"),
            silo_uuid=identity or self.ids.get(name),
            quantity=quantity,
            object_name="Body",
            label=name,
            document_label=name,
            instances=tuple(f"{name}{i}" for i in range(quantity)),
        )

    def snapshot(self, *entries: BomEntry, broken: bool = False, identity: str | None = None) -> Snapshot:
        head = BomEntry(
            str(self.top),
            silo_uuid=identity or self.ids["Top"],
            object_name="Assembly",
            label="Assembly",
            document_label="Top",
            is_assembly=True,
        )
        place = Place(str(self.top), "Link")
        lost = Finding(FindingCode.MISSING_FILE, Severity.ERROR, "Gone.FCStd is missing", (place,))
        extraction = Extraction(head, entries, (lost,) if broken else ())
        return Snapshot(str(self.top), "Top", head.silo_uuid, extraction)

    def commit(
        self,
        snapshot: Snapshot,
        *,
        content: bytes | None = b"top file",
        comment: str = "",
        sync_bom: bool = True,
        allow_missing: bool = False,
        origin: str = "",
    ) -> Entry:
        """Put a commit into the outbox; ``content`` None sends no file."""
        self.clock += 1
        if content is not None:
            self.top.write_bytes(content)
        commit = Commit(
            path=snapshot.path,
            taken_at=self.clock,
            label=snapshot.label,
            identity=snapshot.identity or "",
            comment=comment,
            file=Path(snapshot.path) if content is not None else None,
            extraction=snapshot.extraction if sync_bom else None,
            allow_missing=allow_missing,
            origin=origin,
        )
        return self.outbox.add(commit)

    def lines(self) -> dict[str, float | None]:
        return {line.child_part_number: line.quantity for line in self.silo.get_bom(self.number)}

    def files(self) -> list[bytes]:
        """Contents of the item's revisions that have a file, oldest first."""
        found = sorted(self.silo.revisions(self.number), key=lambda r: r.revision_number)
        return [self.silo_file(r.revision_number) for r in found if r.file_name]

    def silo_file(self, revision: int) -> bytes:
        target = self.folder / "downloaded"
        self.silo.download_file(self.number, target, revision)
        return target.read_bytes()


@pytest.fixture
def vault(tmp_path: Path) -> Vault:
    return Vault(tmp_path, FakeSilo())


def died(store: Store) -> None:
    """Do what the system does where a process ends: give its locks up."""
    for key in [*store._coming]:
        if lock := store._coming.pop(key):
            lock.close()
