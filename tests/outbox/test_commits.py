# SPDX-License-Identifier: LGPL-2.1-or-later
"""Commits from the outbox to the server: what arrives, what is held, and in which words."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING, Any

import pytest

from silo.bom.errors import (
    ConflictError,
    RejectedError,
    SiloError,
    UnreachableError,
)
from silo.bom_sync.steps import Status
from silo.outbox.entry import ASKED, Commit, State

if TYPE_CHECKING:
    from vault import Vault


def on(silo: Any, name: str, error: SiloError, *, after: bool = False) -> None:
    """Have the server fail at this call, before or after it acted."""

    def hook(called: str) -> None:
        if called == name:
            raise error

    setattr(silo, "after" if after else "before", hook)


def well(silo: Any) -> None:
    """The server is well again."""
    silo.before = silo.after = lambda _name: None


DOWN = UnreachableError("no answer")


def test_a_commit_brings_file_and_bom(vault: Vault) -> None:
    """One box with both, and nothing waits any more."""
    vault.commit(vault.snapshot(vault.part("Bolt", 12)), comment="first")
    report = vault.send()
    assert vault.lines() == {"F01-0001": 12}
    assert vault.files() == [b"top file"]
    (sent,) = vault.told
    assert (sent.status, sent.part_number) == (Status.MERGED, vault.number)
    assert (sent.revision, sent.entry.comment) == (1, "first")
    assert sent.result is not None
    assert [line.part_number for line in sent.result.diff.added] == ["F01-0001"]
    assert (vault.waiting(), report.stopped_by) == ((), None)


def test_a_second_commit_brings_what_has_changed(vault: Vault) -> None:
    """An equal BOM is left alone, and the server's newest file is not uploaded again."""
    for content in (b"one", b"one", b"two"):
        vault.commit(vault.snapshot(vault.part("Bolt", 4)), content=content)
        vault.send()
    assert [(sent.status, sent.revision) for sent in vault.told] == [
        (Status.MERGED, 1),
        (Status.UNCHANGED, None),
        (Status.UNCHANGED, 2),
    ]
    assert vault.files() == [b"one", b"two"]
    assert [event.type for event in vault.silo.log].count("bom_merge") == 1


@pytest.mark.parametrize(
    ("how", "lines", "files"),
    [({"sync_bom": False}, {}, [b"top file"]), ({"content": None}, {"F01-0001": 4}, [])],
    ids=["the sync is switched off", "somebody else committed the file"],
)
def test_one_half_may_go_alone(vault: Vault, how: Any, lines: Any, files: list[bytes]) -> None:
    """The file of an assembly, or its BOM."""
    vault.commit(vault.snapshot(vault.part("Bolt", 4)), **how)
    vault.send()
    assert (vault.lines(), vault.files()) == (lines, files)
    assert vault.told[0].status is (Status.MERGED if lines else None)


@pytest.mark.parametrize("consent", [False, True])
def test_a_broken_link_holds_the_bom_back_unless_a_person_consents(vault: Vault, consent: bool) -> None:
    """A missing file must never read as "removed"; with consent, what it stood for is unreferenced."""
    vault.commit(vault.snapshot(vault.part("Bolt", 4), vault.part("Plate")))
    vault.send()
    vault.commit(vault.snapshot(vault.part("Bolt", 4), broken=True), content=b"two", allow_missing=consent)
    vault.send()
    assert vault.told[1].status is (Status.MERGED if consent else Status.BLOCKED)
    assert vault.files() == [b"top file", b"two"]
    flagged = {ln.child_part_number: bool(ln.unreferenced_since) for ln in vault.silo.get_bom(vault.number)}
    assert flagged == {"F01-0001": False, "M01-0001": consent}


def held(vault: Vault) -> Any:
    """What the server knows of a held BOM."""
    return vault.silo.get_item(vault.number).last_sync.held


def test_a_held_bom_is_known_here_and_there_until_it_goes_out(vault: Vault) -> None:
    """Silo learns who holds it and why; when the file is back, the next commit of the BOM ends both."""
    vault.commit(vault.snapshot(vault.part("Bolt", 4), broken=True))
    vault.send()
    (mine,) = vault.outbox.held_boms(vault.silo.base_url)
    assert (mine.part_number, mine.why) == (vault.number, "1 open question")
    assert mine.sentence == f"The BOM of {vault.number} is held here: 1 open question"
    report = held(vault)
    assert (report.user, [part.reason for part in report.left_out]) == (vault.silo.user, ["broken"])
    vault.commit(vault.snapshot(vault.part("Bolt", 4)), content=None)
    vault.send()
    assert (held(vault), vault.outbox.held_boms()) == (None, ())
    assert vault.lines() == {"F01-0001": 4}


def test_the_reason_of_a_held_bom_is_the_newest_and_its_time_the_first(vault: Vault) -> None:
    """Two commits without the file are one BOM that is held, since the first."""
    for content in (b"one", b"two"):
        vault.commit(vault.snapshot(vault.part("Bolt", 4), broken=True), content=content)
        vault.send()
    assert len(vault.outbox.held_boms()) == 1
    assert [sent.status for sent in vault.told] == [Status.BLOCKED] * 2


def test_a_held_bom_waits_until_the_server_has_heard_of_it(vault: Vault) -> None:
    """The file has arrived; the report goes with the next run, or the server would show an old BOM as new."""
    on(vault.silo, "hold_bom", DOWN)
    vault.commit(vault.snapshot(vault.part("Bolt", 4), broken=True))
    vault.send()
    assert held(vault) is None
    assert [entry.bom_left for entry in vault.waiting()] == [True]
    well(vault.silo)
    vault.send(force=True)
    assert held(vault) is not None
    assert (vault.waiting(), vault.files()) == ((), [b"top file"])


def test_a_server_that_takes_no_report_leaves_it_here(vault: Vault) -> None:
    """It refuses the report alone: the commit is done, and this computer remembers."""
    on(vault.silo, "hold_bom", RejectedError("unknown"))
    vault.commit(vault.snapshot(vault.part("Bolt", 4), broken=True))
    vault.send()
    assert vault.waiting() == ()
    assert [each.why for each in vault.outbox.held_boms()] == ["1 open question"]


def test_components_without_a_number_are_left_out_and_reported(vault: Vault) -> None:
    """The rest is synced."""
    stranger = vault.part("Stranger", identity="7f9fd73b-50c9-41d8-b7b2-575a030c1eeb")
    vault.commit(vault.snapshot(vault.part("Bolt", 4), stranger))
    vault.send()
    assert vault.lines() == {"F01-0001": 4}
    assert vault.told[0].resolved is not None
    assert [entry.label for entry in vault.told[0].resolved.unresolved] == ["Stranger"]


# --- offline ---------------------------------------------------------------------------------------------


def test_a_look_up_without_an_answer_keeps_the_commit(vault: Vault) -> None:
    """Nothing of it is sent before the server says which items it has."""
    look_up = vault.silo.get_items_by_uuid

    def fail(*_arguments: Any, **_more: Any) -> Any:
        raise DOWN

    vault.silo.get_items_by_uuid = fail  # type: ignore[method-assign]
    vault.commit(vault.snapshot(vault.part("Bolt", 12)))
    vault.send()
    vault.silo.get_items_by_uuid = look_up  # type: ignore[method-assign]
    assert (vault.lines(), vault.files()) == ({}, [])
    vault.again()
    vault.send(force=True)
    assert (vault.lines(), vault.files(), vault.waiting()) == ({"F01-0001": 12}, [b"top file"], ())


def test_an_item_that_this_server_does_not_know(vault: Vault) -> None:
    """Kept with its reason, in nobody's way, tried again when asked, and discarded when told."""
    unknown = "7f9fd73b-50c9-41d8-b7b2-575a030c1eeb"
    vault.commit(vault.snapshot(identity=unknown))
    vault.commit(vault.snapshot(vault.part("Bolt", 1)))
    vault.send()
    (waiting,) = vault.waiting()
    assert waiting.state is State.WAITING  # the server may be another one for a while
    assert waiting.reason.startswith("Silo does not know Top; register it")
    assert vault.lines() == {"F01-0001": 1}
    vault.outbox.retry(waiting.id)
    assert vault.waiting()[0].reason == ""
    vault.outbox.discard(waiting.id)
    assert vault.waiting() == ()
    assert vault.top.exists()


def renamed(vault: Vault, content: bytes) -> None:
    """Commit the assembly from a file of another name, as after FreeCAD's Save As."""
    path = vault.folder / "TopLong.FCStd"
    path.write_bytes(content)
    vault.clock += 1
    vault.outbox.add(Commit(str(path), vault.clock, "TopLong", vault.ids["Top"], file=path))


def test_retry_says_that_it_is_the_same_part(vault: Vault) -> None:
    """Then it is sent, and the new name is the item's from now on."""
    vault.commit(vault.snapshot())
    vault.send()
    renamed(vault, b"a longer one")
    vault.send()
    vault.outbox.retry(vault.waiting()[0].id)
    vault.send()
    renamed(vault, b"longer still")
    vault.send()
    assert vault.files() == [b"top file", b"a longer one", b"longer still"]
    assert vault.waiting() == ()


def test_a_renamed_file_without_a_change_is_no_question(vault: Vault) -> None:
    """The server has this very content."""
    vault.commit(vault.snapshot())
    vault.send()
    renamed(vault, b"top file")
    vault.send()
    assert vault.files() == [b"top file"]
    assert vault.waiting() == ()


def test_a_retry_for_another_reason_answers_no_question(vault: Vault) -> None:
    """Only who was asked whether it is the same part has said so."""
    vault.commit(vault.snapshot())
    vault.send()
    renamed(vault, b"a longer one")
    entry = vault.waiting()[0]
    vault.outbox.update(entry.id, state=State.HELD, reason="refused for something else")
    vault.outbox.retry(entry.id)
    vault.send()
    assert vault.files() == [b"top file"]
    assert vault.waiting()[0].renamed == ASKED


def test_a_part_that_is_registered_after_the_refusal_is_in_the_bom_of_the_retry(vault: Vault) -> None:
    """What was refused is resolved again, not sent again as it was."""
    stranger = "7f9fd73b-50c9-41d8-b7b2-575a030c1eeb"
    vault.commit(vault.snapshot(vault.part("Bolt", 1), vault.part("New", identity=stranger)))
    on(vault.silo, "merge_bom", RejectedError("not now"))
    vault.send()
    well(vault.silo)
    vault.silo.create_item("kindred-rd", "F01", "New", idempotency_key=stranger)
    vault.outbox.retry(vault.waiting()[0].id)
    vault.send()
    assert vault.lines() == {"F01-0001": 1, "F01-0002": 1}


def test_what_is_sent_again_is_what_was_sent(vault: Vault) -> None:
    """The server knows a merge by its sync_id and content: a part registered meanwhile must not change it."""
    stranger = "7f9fd73b-50c9-41d8-b7b2-575a030c1eeb"
    vault.commit(vault.snapshot(vault.part("Bolt", 1), vault.part("New", identity=stranger)))
    on(vault.silo, "merge_bom", DOWN, after=True)
    vault.send()
    well(vault.silo)
    vault.silo.create_item("kindred-rd", "F01", "New", idempotency_key=stranger)
    vault.again()
    vault.send(force=True)
    assert (vault.lines(), vault.waiting()) == ({"F01-0001": 1}, ())
    assert len([event for event in vault.silo.log if event.type == "bom_merge"]) == 1


def held_bom(vault: Vault) -> None:
    """A BOM that was refused, while the file of its commit arrived."""
    on(vault.silo, "merge_bom", RejectedError("not now"))
    vault.commit(vault.snapshot(vault.part("Bolt", 1)))
    vault.send()
    well(vault.silo)


def test_a_newer_commit_whose_bom_was_not_sent_makes_no_older_one_out_of_date(vault: Vault) -> None:
    """Its broken link held it back: the older BOM undoes nothing."""
    held_bom(vault)
    made_from = hashlib.sha256(b"top file").hexdigest()
    vault.commit(vault.snapshot(vault.part("Bolt", 2), broken=True), content=b"two", origin=made_from)
    vault.send()
    (waiting,) = vault.waiting()
    assert not waiting.superseded
    vault.outbox.retry(waiting.id)
    vault.send()
    assert vault.lines() == {"F01-0001": 1}


def test_what_was_held_without_a_number_is_out_of_date_by_its_identity(vault: Vault) -> None:
    """The item was not known yet; registered later, its newer commit arrived first."""
    identity = "7f9fd73b-50c9-41d8-b7b2-575a030c1eeb"
    vault.commit(vault.snapshot(identity=identity))
    vault.send()
    vault.outbox.update(vault.waiting()[0].id, state=State.HELD)
    vault.silo.create_item("kindred-rd", "A01", "Late", item_type="assembly", idempotency_key=identity)
    vault.commit(vault.snapshot(identity=identity), content=b"newer")
    vault.send(force=True)
    (waiting,) = vault.waiting()
    assert (waiting.part_number, waiting.superseded) == ("", True)
    with pytest.raises(ConflictError, match="a newer commit was sent; this one would overwrite it"):
        vault.outbox.retry(waiting.id)


def test_numbers_are_the_same_in_any_spelling(vault: Vault) -> None:
    """A commit by number, typed in small letters, is of the same item."""
    held_bom(vault)
    request = vault.outbox.bom(vault.waiting()[0].id)[1]
    older = vault.outbox.add(Commit("", 1.0, part_number=vault.number.lower(), request=request))
    vault.outbox.update(older.id, state=State.HELD, server=vault.waiting()[0].server)
    vault.commit(vault.snapshot(vault.part("Bolt", 3)), content=b"three")
    vault.send()
    assert [waiting.superseded for waiting in vault.waiting()] == [True, True]


def test_a_commit_by_number_waits_for_an_older_one_by_identity(vault: Vault) -> None:
    """They are one item, and go in order."""
    on(vault.silo, "upload_file", UnreachableError("this one only"))
    vault.commit(vault.snapshot())
    request = '{"entries": [{"child_part_number": "F01-0001", "quantity": 9}]}'
    vault.outbox.add(Commit("", 9.0, part_number=vault.number, request=request))
    vault.send()
    assert vault.lines() == {}
    well(vault.silo)
    vault.send(force=True)
    assert (vault.lines(), vault.waiting()) == ({"F01-0001": 9}, ())


def test_a_commit_by_identity_waits_for_an_older_one_by_number(vault: Vault) -> None:
    """That they are one item is known only once the identity was looked up."""
    request = '{"entries": [{"child_part_number": "F01-0001", "quantity": 9}]}'
    vault.outbox.add(Commit("", 1.0, part_number=vault.number, request=request))
    on(vault.silo, "merge_bom", UnreachableError("this one only"))
    vault.commit(vault.snapshot())
    vault.send()
    assert vault.files() == []
    well(vault.silo)
    vault.send(force=True)
    assert (vault.lines(), vault.files(), vault.waiting()) == ({"F01-0001": 9}, [b"top file"], ())
