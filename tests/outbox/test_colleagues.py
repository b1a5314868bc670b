# SPDX-License-Identifier: LGPL-2.1-or-later
"""A commit does not undo a colleague's: what is held, what passes, and what a person's word does."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING

import pytest

from silo.api.address import canonical
from silo.api.files import Origin
from silo.api.revisions import other_name
from silo.api.wire import Revision
from silo.bom.errors import RejectedError, UnreachableError
from silo.outbox.entry import UNKNOWN, Commit, Entry, State
from silo.testing import FakeSilo

if TYPE_CHECKING:
    from vault import Vault


def sha(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def mine(vault: Vault, content: bytes, origin: str, comment: str = "") -> Entry:
    """A commit of Top with a file and one bolt, made from ``origin``."""
    vault.clock += 1
    vault.top.write_bytes(content)
    taken = vault.snapshot(vault.part("Bolt", len(content)))
    return vault.outbox.add(
        Commit(
            path=str(vault.top),
            taken_at=vault.clock,
            label="Top",
            identity=vault.ids["Top"],
            file=vault.top,
            extraction=taken.extraction,
            origin=origin,
            comment=comment,
        )
    )


def theirs(vault: Vault, content: bytes, base: int) -> Revision:
    """A colleague's commit from another computer."""
    path = vault.folder / "elsewhere" / "Top.FCStd"
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(content)
    vault.silo.user, me = "alice", vault.silo.user
    try:
        return vault.silo.upload_file(vault.number, path, "less", origin=Origin(base_revision=base))
    finally:
        vault.silo.user = me


def contents(vault: Vault) -> list[bytes]:
    return vault.files()


def test_a_commit_that_would_undo_a_colleagues_is_held_with_file_and_bom(vault: Vault) -> None:
    """The reason says who, which and what; nothing of it is in Silo."""
    mine(vault, b"one", UNKNOWN)
    vault.send()
    before = vault.lines()
    theirs(vault, b"one less", 1)
    mine(vault, b"one other", sha(b"one"))
    report = vault.send()
    (held,) = vault.waiting()
    assert (held.state, held.newer["revision_number"], held.newer["created_by"]) == (State.HELD, 2, "alice")
    assert "alice committed revision 2" in held.reason
    assert "(less)" in held.reason
    assert "made from revision 1" in held.reason
    assert (held.file_left, held.bom_left, report.sent) == (True, True, [])
    assert (contents(vault), vault.lines()) == ([b"one", b"one less"], before)


def test_on_top_of_it_at_a_persons_word_and_the_comment_says_so(vault: Vault) -> None:
    """Retry takes the revision that the person saw; a still newer one is asked about again."""
    mine(vault, b"one", UNKNOWN)
    vault.send()
    theirs(vault, b"one less", 1)
    entry = mine(vault, b"one other", sha(b"one"), "longer")
    vault.send()
    vault.outbox.retry(entry.id)
    theirs(vault, b"one less and less", 2)
    vault.send()
    (held,) = vault.waiting()
    assert held.newer["revision_number"] == 3
    vault.outbox.retry(entry.id)
    vault.send()
    assert vault.waiting() == ()
    newest = vault.silo.revisions(vault.number)[0]
    assert (newest.revision_number, newest.base_revision) == (4, 3)
    assert "longer (on top of revision 2 by alice, which is not in it)" in newest.comment
    assert "revision 3" in newest.comment


def test_a_race_between_the_look_and_the_upload_is_caught_by_the_server(vault: Vault) -> None:
    """The colleague commits after we looked: the 409 holds the entry as our own look does."""
    mine(vault, b"one", UNKNOWN)
    vault.send()
    mine(vault, b"one other", sha(b"one"))

    def hook(called: str) -> None:
        if called == "upload_file":
            vault.silo.before = lambda _name: None
            theirs(vault, b"one less", 1)

    vault.silo.before = hook
    vault.send()
    (held,) = vault.waiting()
    assert (held.state, held.newer["revision_number"]) == (State.HELD, 2)
    assert contents(vault) == [b"one", b"one less"]


def test_own_commits_follow_each_other_offline(vault: Vault) -> None:
    """Each is made from the one before, which has no number yet."""
    mine(vault, b"one", UNKNOWN)
    mine(vault, b"two", sha(b"one"))
    mine(vault, b"three", sha(b"two"))
    vault.send()
    assert contents(vault) == [b"one", b"two", b"three"]
    assert [r.base_revision for r in reversed(vault.silo.revisions(vault.number))] == [0, 1, 2]


def test_what_follows_a_held_one_is_held_too_and_goes_after_it(vault: Vault) -> None:
    """It has the first one's changes; sent alone it would undo the colleague's as well."""
    mine(vault, b"one", UNKNOWN)
    vault.send()
    theirs(vault, b"one less", 1)
    first = mine(vault, b"two", sha(b"one"))
    second = mine(vault, b"three", sha(b"two"))
    vault.send()
    assert [entry.state for entry in vault.waiting()] == [State.HELD, State.HELD]
    vault.outbox.retry(first.id)
    vault.send()
    vault.outbox.retry(second.id)
    vault.send()
    assert (vault.waiting(), contents(vault)) == ((), [b"one", b"one less", b"two", b"three"])


def test_a_file_of_unknown_origin_is_asked_about(vault: Vault) -> None:
    """Such as a copied folder whose file was saved without the add-on."""
    mine(vault, b"one", UNKNOWN)
    vault.send()
    mine(vault, b"from somewhere", UNKNOWN)
    vault.send()
    (held,) = vault.waiting()
    assert "made from a file that is no revision in Silo" in held.reason


def test_a_lost_answer_is_no_colleague(vault: Vault) -> None:
    """Our own revision arrived; the run after it finds that."""
    mine(vault, b"one", UNKNOWN)
    vault.send()
    mine(vault, b"two", sha(b"one"))

    def hook(called: str) -> None:
        if called == "upload_file":
            vault.silo.after = lambda _name: None
            raise UnreachableError("no answer")

    vault.silo.after = hook
    vault.send()
    vault.send(force=True)
    assert (vault.waiting(), contents(vault)) == ((), [b"one", b"two"])


def test_the_bom_of_a_file_that_a_colleague_went_on_from_is_not_sent(vault: Vault) -> None:
    """Their BOM has these changes; ours, coming late, would undo theirs."""
    mine(vault, b"one", UNKNOWN)
    vault.send()
    mine(vault, b"longer", sha(b"one"))

    def hook(called: str) -> None:
        if called == "merge_bom":
            vault.silo.before = lambda _name: None
            theirs(vault, b"went further", 2)

    vault.silo.before = hook
    vault.send()
    assert vault.lines() == {"F01-0001": 3}
    assert vault.waiting() == ()
    assert "alice has committed revision 3 since" in vault.told[-1].entry.remark


def test_a_server_without_checksums_is_known_by_what_was_sent_to_it(vault: Vault) -> None:
    """The number of our own revision is remembered here; a colleague's is still found."""
    silo = vault.silo
    known = type(silo).revisions

    def bare(self: FakeSilo, *arguments: object, **more: object) -> list[Revision]:
        found = known(self, *arguments, **more)  # type: ignore[arg-type]
        return [r.model_copy(update={"file_checksum": None}) for r in found]

    class Bare(FakeSilo):
        revisions = bare  # type: ignore[assignment]

    silo.__class__ = Bare
    mine(vault, b"one", UNKNOWN)
    vault.send()
    mine(vault, b"two", sha(b"one"))
    vault.send()
    theirs(vault, b"theirs", 2)
    mine(vault, b"three", sha(b"two"))
    vault.send()
    assert contents(vault) == [b"one", b"two", b"theirs"]
    assert [entry.newer["revision_number"] for entry in vault.waiting()] == [3]


def test_saved_files_are_known_by_what_they_were_made_from(vault: Vault) -> None:
    """By content, so a copied folder knows it as well."""
    outbox = vault.outbox
    assert outbox.origin_of("aa") == "aa"
    outbox.derived("aa", "one")
    outbox.derived("bb", "one")
    outbox.derived("cc", "cc")
    assert [outbox.origin_of(x) for x in ("aa", "bb", "cc")] == ["one", "one", "cc"]


@pytest.mark.parametrize("origin", ["", UNKNOWN])
def test_the_first_file_of_an_item_passes(vault: Vault, origin: str) -> None:
    """There is nothing to undo."""
    mine(vault, b"one", origin)
    vault.send()
    assert (vault.waiting(), contents(vault)) == ((), [b"one"])


def refuse_next_merge(vault: Vault) -> None:
    def hook(called: str) -> None:
        if called == "merge_bom":
            vault.silo.before = lambda _name: None
            raise RejectedError("Bolt is archived")

    vault.silo.before = hook


def test_a_bom_that_was_held_does_not_undo_a_colleagues(vault: Vault) -> None:
    """Retry says "the part is there now", not "send it over what a colleague committed meanwhile"."""
    entry = mine(vault, b"one", UNKNOWN)
    refuse_next_merge(vault)
    vault.send()
    assert [one.file_left for one in vault.waiting()] == [False]
    theirs(vault, b"one less", 1)
    vault.outbox.retry(entry.id)
    vault.send()
    assert (vault.waiting(), vault.lines()) == ((), {})
    assert "alice has committed revision 2 since" in vault.told[-1].entry.remark


def test_a_held_bom_may_go_after_files_that_come_from_here(vault: Vault) -> None:
    """Own files that were made from its file are no colleague's; with one between them they are."""
    entry = mine(vault, b"one", UNKNOWN)
    refuse_next_merge(vault)
    vault.send()
    for content, origin in ((b"two", b"one"), (b"three", b"two")):
        vault.top.write_bytes(content)
        vault.outbox.add(
            Commit(
                path=str(vault.top),
                taken_at=2.0,
                identity=vault.ids["Top"],
                file=vault.top,
                origin=sha(origin),
            )
        )
        vault.send()
    vault.outbox.retry(entry.id)
    vault.send()
    assert (vault.waiting(), vault.lines()) == ((), {"F01-0001": 3})


def file_only(vault: Vault, content: bytes, origin: str) -> Entry:
    vault.top.write_bytes(content)
    return vault.outbox.add(
        Commit(path=str(vault.top), taken_at=2.0, identity=vault.ids["Top"], file=vault.top, origin=origin)
    )


def test_the_bom_of_a_file_that_is_there_already_does_not_undo_a_colleagues(vault: Vault) -> None:
    """The same file committed again makes no revision; its BOM is still that of the revision there is."""
    file_only(vault, b"one", UNKNOWN)
    vault.send()
    mine(vault, b"one", sha(b"one"))

    def hook(called: str) -> None:
        if called == "merge_bom":
            vault.silo.before = lambda _name: None
            theirs(vault, b"one less", 1)

    vault.silo.before = hook
    vault.send()
    assert (vault.waiting(), vault.lines()) == ((), {})
    assert "alice has committed revision 2 since" in vault.told[-1].entry.remark


def restored(vault: Vault, revision: int) -> None:
    """The server is back at an older state: what came after this revision is gone."""
    stored = next(s for s in vault.silo.items.values() if s.item.part_number == vault.number)
    stored.revisions[:] = [one for one in stored.revisions if one.revision_number <= revision]
    stored.files = {number: file for number, file in stored.files.items() if number <= revision}
    stored.uploads.clear()


def test_a_restored_server_gives_our_number_to_a_colleagues_file(vault: Vault) -> None:
    """Revision 2 was ours once. The one that is there now is not, and sending would undo it."""
    file_only(vault, b"one", UNKNOWN)
    file_only(vault, b"two", sha(b"one"))
    vault.send()
    restored(vault, 1)
    theirs(vault, b"one less", 1)
    file_only(vault, b"three", sha(b"two"))
    vault.send()
    (held,) = vault.waiting()
    assert (held.state, held.newer["revision_number"]) == (State.HELD, 2)
    assert contents(vault) == [b"one", b"one less"]


def test_our_own_upload_to_a_restored_server_is_no_colleagues(vault: Vault) -> None:
    """Its answer was lost, and its number is below what the server had before it was restored."""
    file_only(vault, b"one", UNKNOWN)
    file_only(vault, b"two", sha(b"one"))
    vault.send()
    file_only(vault, b"three", sha(b"two"))

    def lose(called: str) -> None:
        if called == "upload_file":
            raise UnreachableError("no answer")

    vault.silo.before = lose
    vault.send()
    restored(vault, 0)
    vault.silo.before, vault.silo.after = lambda _name: None, lose
    vault.send(force=True)
    vault.silo.after = lambda _name: None
    vault.send(force=True)
    assert (vault.waiting(), contents(vault)) == ((), [b"three"])


def test_another_server_knows_nothing_of_the_old_ones_revisions(vault: Vault) -> None:
    """Neither what was seen there, nor a comment on it, goes along."""
    file_only(vault, b"one", UNKNOWN)
    vault.send()
    theirs(vault, b"one less", 1)
    entry = file_only(vault, b"one other", sha(b"one"))
    vault.send()
    vault.outbox.retry(entry.id, "http://other.example")
    (moved,) = vault.waiting()
    assert (moved.server, moved.on_top_of, moved.base_revision, moved.comment) == (
        canonical("http://other.example"),
        "",
        None,
        "",
    )
    assert moved.newer == {}


def test_a_copy_under_another_name_sends_neither_file_nor_bom_unasked(vault: Vault) -> None:
    """ "Save As" copies the identity along: the copy's BOM is not that of the item."""
    mine(vault, b"one", UNKNOWN)
    vault.send()
    copy = vault.folder / "Variant.FCStd"
    copy.write_bytes(b"variant")
    taken = vault.snapshot(vault.part("Bolt", 9))
    vault.outbox.add(
        Commit(
            path=str(copy),
            taken_at=9.0,
            label="Top",
            identity=vault.ids["Top"],
            file=copy,
            extraction=taken.extraction,
            origin=sha(b"one"),
        )
    )
    vault.send()
    assert (contents(vault), vault.lines()) == ([b"one"], {"F01-0001": 3})
    (held,) = vault.waiting()
    assert (held.file_left, held.bom_left) == (True, True)


def test_on_top_of_what_a_person_saw_and_of_nothing_else(vault: Vault) -> None:
    """The server is restored between the person's word and the sending."""
    file_only(vault, b"one", UNKNOWN)
    vault.send()
    theirs(vault, b"one less", 1)
    entry = file_only(vault, b"one other", sha(b"one"))
    vault.send()
    vault.outbox.retry(entry.id)
    restored(vault, 1)
    theirs(vault, b"another one", 1)
    vault.send()
    (held,) = vault.waiting()
    assert (held.state, held.newer["file_checksum"]) == (State.HELD, sha(b"another one"))
    assert contents(vault) == [b"one", b"another one"]


def test_a_revision_without_a_file_is_no_colleagues_work(vault: Vault) -> None:
    """Somebody typed a mass on the web page: the file is still the one that this was made from."""
    file_only(vault, b"one", UNKNOWN)
    vault.send()
    vault.silo.update_item(vault.number, properties={"mass_kg": 2})
    file_only(vault, b"two", sha(b"one"))
    vault.send()
    assert (vault.waiting(), contents(vault)) == ((), [b"one", b"two"])


def test_a_name_in_another_case_is_no_other_name(vault: Vault) -> None:
    """Windows and macOS show one file by both."""
    file_only(vault, b"one", UNKNOWN)
    vault.send()
    known = vault.silo.revisions(vault.number)
    assert other_name("/elsewhere/TOP.fcstd", known) == ""
    assert other_name("/elsewhere/Top 2.FCStd", known) == "Top.FCStd"


def test_what_was_there_already_keeps_its_revision_over_a_hold(vault: Vault) -> None:
    """The BOM of a file that Silo had is refused; before its retry a colleague commits."""
    file_only(vault, b"one", UNKNOWN)
    vault.send()
    entry = mine(vault, b"one", sha(b"one"))
    refuse_next_merge(vault)
    vault.send()
    theirs(vault, b"one less", 1)
    vault.outbox.retry(entry.id)
    vault.send()
    assert (vault.waiting(), vault.lines()) == ((), {})
    assert "alice has committed revision 2 since" in vault.told[-1].entry.remark


def test_a_bom_that_was_not_sent_makes_none_out_of_date(vault: Vault) -> None:
    """What the pane says of an older held one stays true: no newer commit of it has arrived."""
    mine(vault, b"one", UNKNOWN)
    refuse_next_merge(vault)
    vault.send()
    mine(vault, b"longer", sha(b"one"))

    def hook(called: str) -> None:
        if called == "merge_bom":
            vault.silo.before = lambda _name: None
            theirs(vault, b"went further", 2)

    vault.silo.before = hook
    vault.send()
    (held,) = vault.waiting()
    assert (held.bom_left, held.superseded) == (True, False)


def test_a_held_bom_does_not_go_after_a_file_with_a_colleagues_between(vault: Vault) -> None:
    """Sent on top of theirs at a person's word: the older BOM knows neither."""
    entry = mine(vault, b"one", UNKNOWN)
    refuse_next_merge(vault)
    vault.send()
    theirs(vault, b"one less", 1)
    on_top = file_only(vault, b"mine", sha(b"one"))
    vault.send()
    vault.outbox.retry(on_top.id)
    vault.send()
    assert contents(vault)[-1] == b"mine"
    vault.outbox.retry(entry.id)
    vault.send()
    assert (vault.waiting(), vault.lines()) == ((), {})


def test_a_lost_answer_is_found_behind_a_colleagues_commit(vault: Vault) -> None:
    """Ours arrived, theirs was made from it: ours is not held, and not sent again."""
    file_only(vault, b"one", UNKNOWN)
    vault.send()
    file_only(vault, b"two", sha(b"one"))

    def lose(called: str) -> None:
        if called == "upload_file":
            vault.silo.after = lambda _name: None
            raise UnreachableError("no answer")

    vault.silo.after = lose
    vault.send()
    theirs(vault, b"three", 2)
    vault.send(force=True)
    assert (vault.waiting(), contents(vault)) == ((), [b"one", b"two", b"three"])
    assert vault.told[-1].revision == 2


@pytest.mark.parametrize("colleague", [False, True])
def test_a_bom_does_not_go_without_its_file(vault: Vault, *, colleague: bool) -> None:
    """The server was restored between the two. Its number may be free, or a colleague's by now."""
    file_only(vault, b"one", UNKNOWN)
    vault.send()
    entry = mine(vault, b"longer", sha(b"one"))
    refuse_next_merge(vault)
    vault.send()
    restored(vault, 1)
    if colleague:
        theirs(vault, b"less", 1)
    vault.outbox.retry(entry.id)
    vault.send()
    if colleague:
        (held,) = vault.waiting()
        assert (held.file_left, held.bom_left, held.newer["revision_number"]) == (True, True, 2)
        assert (contents(vault), vault.lines()) == ([b"one", b"less"], {})
    else:
        assert (vault.waiting(), contents(vault)) == ((), [b"one", b"longer"])
        assert vault.lines() == {"F01-0001": 6}


def test_a_restore_between_the_look_and_the_merge_is_caught_by_the_server(vault: Vault) -> None:
    """The file goes once more with the next run, then its BOM."""
    mine(vault, b"one", UNKNOWN)

    def hook(called: str) -> None:
        if called == "merge_bom":
            vault.silo.before = lambda _name: None
            restored(vault, 0)

    vault.silo.before = hook
    assert "is not on this server" in vault.send().failed[0].reason
    assert (contents(vault), vault.lines()) == ([], {})
    vault.send(force=True)
    assert (vault.waiting(), contents(vault), vault.lines()) == ((), [b"one"], {"F01-0001": 3})
