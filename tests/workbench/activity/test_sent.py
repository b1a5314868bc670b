# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the pane shows of a commit (spec bom-sync §6)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest
from activities import entry_text

from silo.api.merging import NOT_ATOMIC
from silo.api.wire import CostTotal, Draft, MergeDiff, MergeWarning, MissingValues, ProductSummary, Revision
from silo.bom.errors import english
from silo.bom.findings import Finding, FindingCode, Place, Severity
from silo.bom_sync.activity_text import counts_text
from silo.workbench import words
from silo.workbench.activity.badges import badges
from silo.workbench.activity.box import Do, PaneEntry
from silo.workbench.activity.sent import of_sent

if TYPE_CHECKING:
    from vault import Vault


def page(path: str) -> str:
    return f"https://silo.example.com{path}"


def send(vault: Vault, snapshot: Any, **more: Any) -> None:
    """Commit this, and send it."""
    vault.commit(snapshot, **more)
    vault.send()


def box(vault: Vault) -> PaneEntry:
    return of_sent(vault.told[-1], page, now=0.0)


def test_a_merge_is_the_box_of_the_spec(vault: Vault) -> None:
    """Counts, the link to the server's page, and what has no number."""
    send(vault, vault.snapshot(vault.part("Bolt", 12), vault.part("Cover", identity="no-item")))
    assert entry_text(box(vault)).splitlines() == [
        f"BOM Updated: {vault.number} Top",
        "+1 added",
        "Revision 1 uploaded",
        "1 component has no Silo part number [Register Parts…]",
        "Cover",
        "[View in Silo →]",
    ]
    (view,) = box(vault).actions
    assert view.target == page(f"/items/{vault.number}/bom")
    # Older boxes of this assembly ask no more.
    assert box(vault).document.endswith("Top.FCStd")


def test_a_commit_of_a_released_product_says_which_draft_it_is_part_of(vault: Vault) -> None:
    """The released revision stays as it is; before the first release nothing is said."""
    send(vault, vault.snapshot(vault.part("Bolt", 12)))
    sent = vault.told[-1]
    assert sent.result is not None
    assert "draft" not in entry_text(of_sent(sent, page, now=0.0))
    of_released = sent.result.model_copy(update={"draft": Draft(label="C", released="B")})
    shown = entry_text(of_sent(replace(sent, result=of_released), page, now=0.0))
    assert "This is part of draft C. Revision B stays released as it is." in shown.splitlines()
    # A file without a BOM says so as well.
    uploaded = Revision(revision_number=2, draft=of_released.draft)
    shown = entry_text(of_sent(replace(sent, result=None, uploaded=uploaded), page, now=0.0))
    assert "This is part of draft C. Revision B stays released as it is." in shown.splitlines()


def test_a_commit_says_what_is_open_in_its_product(vault: Vault) -> None:
    """In the sub-assemblies, as the server keeps it; what is open in its own BOM is said already."""
    send(vault, vault.snapshot(vault.part("Bolt", 12)))
    assert "Open in" not in entry_text(box(vault)), "this Silo keeps no summaries"
    kept = ProductSummary(
        part_number=vault.number,
        open={vault.number: "1 conflict", **{f"A01-9{n}": "2 conflicts" for n in range(9)}},
        incomplete={"A01-9": "incomplete: no file"},
        parts=28,
        total_mass_kg=12.4,
        totals=[CostTotal(currency="EUR", total_cost=8)],
        mass_missing=MissingValues(count=2, first=["P"]),
    )
    shown = entry_text(of_sent(replace(vault.told[-1], summary=kept), page, now=0.0)).splitlines()
    opened = [line for line in shown if line.startswith("Open in")]
    assert opened == [f"Open in A01-9{n}: 2 conflicts" for n in range(3)]
    assert shown[shown.index(opened[-1]) + 1].startswith("… and 7 more lines")
    assert "12.4 kg for 26 of 28 parts · 8.00 EUR" in shown
    few = kept.model_copy(update={"open": {}})
    assert "Open in A01-9: incomplete: no file" in entry_text(
        of_sent(replace(vault.told[-1], summary=few), page, now=0.0)
    )


LINE = {"part_number": "P", "quantity": 1}
CHANGE = {"part_number": "P", "old_quantity": 1, "new_quantity": 2}
LISTS = (
    {},
    {"added": [LINE] * 12},
    {"added": [LINE], "quantity_changed": [CHANGE] * 2, "removed": [LINE] * 3},
)


@pytest.mark.parametrize("lists", LISTS)
def test_pane_and_command_line_count_in_the_same_words(lists: dict[str, Any]) -> None:
    """A conflict too; the pane has them in the user's language."""
    diff = MergeDiff.model_validate(lists)
    for warnings in ((), (MergeWarning(type="conflict", part_number="P", message="CAD 4, Silo 6"),)):
        told = counts_text(diff, warnings)
        assert "  ".join(line.text for line in badges(diff, warnings)) == told
        words.use(lambda _context, text: text.swapcase().replace("{N}", "{n}"))
        try:
            assert "  ".join(line.text for line in badges(diff, warnings)) == told.swapcase()
        finally:
            words.use(english)


def test_a_missing_component_has_two_ways_out(vault: Vault) -> None:
    """On the first BOM too: mend the link, or sync without it. Where none is missing, neither is offered."""
    gone = replace(vault.part("Bolt", 2), missing=True)
    send(vault, vault.snapshot(gone, broken=True))
    (line,) = (line for line in box(vault).lines if "waits until" in line.text)
    assert [(action.do, action.text, action.document) for action in line.actions] == [
        (Do.MEND, "Relink…", str(vault.top)),
        (Do.SYNC_WITHOUT, "Sync without it", str(vault.top)),
    ]
    send(vault, vault.snapshot(broken=True), content=b"other")
    assert not [line.actions for line in box(vault).lines if "waits until" in line.text and line.actions]


def test_however_much_is_broken_registering_stays_within_reach(vault: Vault) -> None:
    """A thousand broken links must not push the button out of the box."""
    snapshot = vault.snapshot(vault.part("Cover", identity="no-item"), broken=True)
    assert snapshot.extraction is not None
    lost = tuple(
        Finding(
            FindingCode.MISSING_FILE, Severity.ERROR, f"Gone{n} is missing", (Place(str(vault.top), f"L{n}"),)
        )
        for n in range(1000)
    )
    send(vault, replace(snapshot, extraction=replace(snapshot.extraction, findings=lost)))
    made = box(vault)
    offered = [a.do for line in made.lines for a in line.actions if a.do is not Do.SHOW]
    assert offered == [Do.PREVIEW, Do.REGISTER]
    assert "… and 995 more lines; the preview shows all" in entry_text(made)


def test_a_broken_link_can_be_shown_in_the_model(vault: Vault) -> None:
    """By the objects that the finding names."""
    send(vault, vault.snapshot(vault.part("Bolt"), broken=True))
    (show,) = [a for line in box(vault).lines for a in line.actions]
    assert (show.do, show.document, show.objects) == (Do.SHOW, str(vault.top), ("Link",))


def test_a_merge_line_by_line_is_reported(vault: Vault) -> None:
    """A server without the merge route took single calls: not one step, and people know it."""
    send(vault, vault.snapshot(vault.part("Bolt", 4)))
    (sent,) = vault.told
    assert sent.result is not None
    warning = MergeWarning(type=NOT_ATOMIC, part_number=vault.number, message="written one by one")
    told = replace(sent, result=sent.result.model_copy(update={"warnings": [warning]}))
    assert "written one by one" in [line.text for line in of_sent(told, page).lines]
    assert "written one by one" not in [line.text for line in of_sent(sent, page).lines]
