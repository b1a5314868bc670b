# SPDX-License-Identifier: LGPL-2.1-or-later
"""The example assembly and a designer who works on it: register, upload, sync, edit, sync again.

For the browser tests and for ``scripts/screenshots_web.py``. Everything goes through our own client to a real
server; the files are a copy.
"""

from __future__ import annotations

import shutil
import uuid
from pathlib import Path

from silo.api.client import SiloClient
from silo.batch import source_document
from silo.bom.entry import walk_entries
from silo.bom_sync.resolved import Resolved, resolve
from silo.bom_sync.steps import Outcome, sync_tree
from silo.cli.reading import read_assembly
from silo.cli.setup.demo_edits import remove_from_assembly, set_element_count
from silo.registering.closed_files import proposals_for, register_all

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "gearbox"

# What a person would have filled in; one part is left without, to show that it is named.
PROPERTIES = {
    "Housing": {"material": "AlSi10Mg", "mass_kg": 1.84, "standard_cost": 96.5},
    "Shaft": {"material": "42CrMo4", "mass_kg": 0.62, "standard_cost": 38.0},
    "Gear": {"material": "16MnCr5", "mass_kg": 0.31, "standard_cost": 41.2},
    "BasePlate": {"material": "S235JR", "mass_kg": 6.4, "standard_cost": 54.0},
    "Cover": {"material": "AlMg3", "mass_kg": 0.45},
    "M8x20Bolt": {"material": "8.8 zinc plated", "mass_kg": 0.013, "standard_cost": 0.18},
}


class GearboxStory:
    """The example assembly in ``folder``, and the server it is synced with."""

    def __init__(self, folder: Path, client: SiloClient) -> None:
        self.client = client
        self.top = folder / "gearbox" / "TopAssembly.FCStd"
        shutil.copytree(
            EXAMPLE, self.top.parent, ignore=shutil.ignore_patterns("*.py", "__pycache__", "*.md")
        )

    def register(self) -> None:
        """Give every component its part number."""
        extraction = read_assembly(str(self.top))
        proposals = proposals_for(extraction, self.client, "kindred-rd")
        for done in register_all(proposals, self.client, schema="kindred-rd"):
            if done.error is not None:
                raise done.error

    def upload(self) -> None:
        """Send every file once, with what is known of its part."""
        whole = self.resolved()
        sent: set[str] = set()
        for entry in walk_entries((whole.assembly, *whole.entries)):
            if entry.part_number and entry.part_number not in sent:
                sent.add(entry.part_number)
                path = Path(entry.doc_path)
                self.client.upload_file(
                    entry.part_number, path, comment="first issue", properties=PROPERTIES.get(path.stem)
                )

    def resolved(self) -> Resolved:
        """The assembly as it is in the files now, with the part numbers that the server knows."""
        return resolve(read_assembly(str(self.top)), self.client)

    def sync(self) -> list[Outcome]:
        """Sync the assembly with all its sub-assemblies."""
        outcomes = list(
            sync_tree(
                self.resolved(), self.client, sync_id=lambda: str(uuid.uuid4()), describe=source_document
            )
        )
        for outcome in outcomes:
            if outcome.error is not None:
                raise outcome.error
        return outcomes

    def number_of(self, file: str) -> str:
        """The part number of a file of the example, such as ``Cover``."""
        whole = self.resolved()
        for entry in walk_entries((whole.assembly, *whole.entries)):
            if Path(entry.doc_path).stem == file and entry.part_number:
                return entry.part_number
        raise AssertionError(f"{file} has no part number")

    def remove(self, label: str) -> None:
        """The designer deletes this link from the top assembly and saves."""
        remove_from_assembly(self.top, label)

    def more_bolts(self, added: int) -> None:
        """The designer makes the array of cover bolts longer and saves."""
        set_element_count(self.top, "CoverBolts", added=added)
