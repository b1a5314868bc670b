# SPDX-License-Identifier: LGPL-2.1-or-later
"""A commit does not undo a colleague's: what is held, what passes, and what a person's word does."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from silo.api.address import canonical
from silo.api.files import Origin
from silo.api.revisions import other_name
from silo.api.wire import Revision
from silo.bom.errors import RejectedError, RouteMissingError, UnreachableError
from silo.file_state import FileState, file_state
from silo.outbox.entry import UNKNOWN, Commit, Entry, State
from silo.project_folder import record_of, write_record
from silo.testing import FakeSilo
from silo.workbench.colleagues.look import FileToCheck, look
from silo.workbench.documents.opened import DocumentOrigin

if TYPE_CHECKING:
    from vault import Vault


def sha(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def mine(
    vault: Vault,
    content: bytes,
    made_from: bytes | None = None,
    comment: str = "",
    *,
    bom: bool = True,
    path: Path | None = None,
) -> Entry:
    """A commit of Top with a file and, unless it is a file only, as many bolts as its content is long."""
    vault.clock += 1
    path = path or vault.top
    path.write_bytes(content)
    extraction = vault.snapshot(vault.part("Bolt", len(content))).extraction
    return vault.outbox.add(
        Commit(
            path=str(path),
            taken_at=vault.clock,
            label="Top",
            identity=vault.ids["Top"],
            file=path,
            extraction=extraction if bom else None,
            origin=UNKNOWN if made_from is None else sha(made_from),
            comment=comment,
        )
    )


def sent(vault: Vault, *contents: bytes, made_from: bytes | None = None, bom: bool = False) -> None:
    """Commits that are in Silo, each made from the one before."""
    for content in contents:
        mine(vault, content, made_from, bom=bom)
        made_from = content
    vault.send()


def once(vault: Vault, called: str, deed: Callable[[], object], *, after: bool = False) -> None:
    """Do this the next time that the server is called so, before it acts or after."""

    def hook(name: str) -> None:
        if name == called:
            setattr(vault.silo, place, lambda _name: None)
            deed()

    place = "after" if after else "before"
    setattr(vault.silo, place, hook)


def lose() -> None:
    raise UnreachableError("no answer")


def refused(vault: Vault, content: bytes, made_from: bytes | None = None) -> Entry:
    """A commit whose file arrives, and whose BOM waits for a person."""

    def refuse() -> None:
        raise RejectedError("Bolt is archived")

    entry = mine(vault, content, made_from)
    once(vault, "merge_bom", refuse)
    vault.send()
    return entry


def held(vault: Vault) -> Entry:
    """The one entry that waits, for a person."""
    (entry,) = vault.waiting()
    assert entry.state is State.HELD
    return entry


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


def test_a_commit_that_would_undo_a_colleagues_is_held_with_file_and_bom(vault: Vault) -> None:
    """The reason says who, which and what; nothing of it is in Silo."""
    sent(vault, b"one", bom=True)
    before = vault.lines()
    theirs(vault, b"one less", 1)
    mine(vault, b"one other", b"one")
    report = vault.send()
    entry = held(vault)
    assert (entry.newer["revision_number"], entry.newer["created_by"]) == (2, "alice")
    for told in ("alice committed revision 2", "(less)", "made from revision 1"):
        assert told in entry.reason
    assert (entry.file_left, entry.bom_left, report.sent) == (True, True, [])
    assert (vault.files(), vault.lines()) == ([b"one", b"one less"], before)


def test_on_top_of_it_at_a_persons_word_and_the_comment_says_so(vault: Vault) -> None:
    """Retry takes the revision that the person saw; a still newer one is asked about again."""
    sent(vault, b"one", bom=True)
    theirs(vault, b"one less", 1)
    entry = mine(vault, b"one other", b"one", "longer")
    vault.send()
    vault.outbox.retry(entry.id)
    theirs(vault, b"one less and less", 2)
    vault.send()
    assert held(vault).newer["revision_number"] == 3
    vault.outbox.retry(entry.id)
    vault.send()
    assert vault.waiting() == ()
    newest = vault.silo.revisions(vault.number)[0]
    assert (newest.revision_number, newest.base_revision) == (4, 3)
    assert "longer (on top of revision 2 by alice, which is not in it)" in newest.comment
    assert "revision 3" in newest.comment


def test_a_race_between_the_look_and_the_upload_is_caught_by_the_server(vault: Vault) -> None:
    """The colleague commits after we looked: the 409 holds the entry as our own look does."""
    sent(vault, b"one", bom=True)
    mine(vault, b"one other", b"one")

    once(vault, "upload_file", lambda: theirs(vault, b"one less", 1))
    vault.send()
    assert held(vault).newer["revision_number"] == 2
    assert vault.files() == [b"one", b"one less"]


def test_what_follows_a_held_one_is_held_too_and_goes_after_it(vault: Vault) -> None:
    """It has the first one's changes; sent alone it would undo the colleague's as well."""
    sent(vault, b"one", bom=True)
    theirs(vault, b"one less", 1)
    first = mine(vault, b"two", b"one")
    second = mine(vault, b"three", b"two")
    vault.send()
    assert [entry.state for entry in vault.waiting()] == [State.HELD, State.HELD]
    vault.outbox.retry(first.id)
    vault.send()
    vault.outbox.retry(second.id)
    vault.send()
    assert (vault.waiting(), vault.files()) == ((), [b"one", b"one less", b"two", b"three"])


def test_a_file_of_unknown_origin_is_asked_about(vault: Vault) -> None:
    """Such as a copied file that was saved without the add-on, and has no record."""
    sent(vault, b"one", bom=True)
    write_record(str(vault.top), None)
    mine(vault, b"from somewhere")
    vault.send()
    assert "made from a file that is no revision in Silo" in held(vault).reason


def test_what_another_program_saved_is_made_from_what_was_there(vault: Vault) -> None:
    """Its record says which revision the file was; so a colleague's newer one is found all the same."""
    sent(vault, b"one", bom=True)
    mine(vault, b"by another program")
    vault.send()
    assert (vault.waiting(), vault.files()) == ((), [b"one", b"by another program"])
    theirs(vault, b"theirs", 2)
    mine(vault, b"and again")
    vault.send()
    assert held(vault).newer["created_by"] == "alice"


def test_the_bom_of_a_file_that_a_colleague_went_on_from_is_not_sent(vault: Vault) -> None:
    """Their BOM has these changes; ours, coming late, would undo theirs."""
    sent(vault, b"one", bom=True)
    mine(vault, b"longer", b"one")

    once(vault, "merge_bom", lambda: theirs(vault, b"went further", 2))
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
    sent(vault, b"one", bom=True)
    mine(vault, b"two", b"one")
    vault.send()
    theirs(vault, b"theirs", 2)
    mine(vault, b"three", b"two")
    vault.send()
    assert vault.files() == [b"one", b"two", b"theirs"]
    assert [entry.newer["revision_number"] for entry in vault.waiting()] == [3]


@pytest.mark.parametrize("there_before", [False, True])
def test_a_bom_that_was_held_does_not_undo_a_colleagues(vault: Vault, there_before: bool) -> None:
    """Retry says "the part is there now", not "send it over what a colleague committed meanwhile".

    So also if the file was in Silo already, and the BOM is that of its revision.
    """
    if there_before:
        sent(vault, b"one")
    entry = refused(vault, b"one", b"one" if there_before else None)
    assert [one.file_left for one in vault.waiting()] == [False]
    theirs(vault, b"one less", 1)
    vault.outbox.retry(entry.id)
    vault.send()
    assert (vault.waiting(), vault.lines()) == ((), {})
    assert "alice has committed revision 2 since" in vault.told[-1].entry.remark


def test_a_held_bom_may_go_after_files_that_come_from_here(vault: Vault) -> None:
    """Own files that were made from its file are no colleague's; with one between them they are."""
    entry = refused(vault, b"one")
    sent(vault, b"two", b"three", made_from=b"one")
    vault.outbox.retry(entry.id)
    vault.send()
    assert (vault.waiting(), vault.lines()) == ((), {"F01-0001": 3})


def test_the_bom_of_a_file_that_is_there_already_does_not_undo_a_colleagues(vault: Vault) -> None:
    """The same file committed again makes no revision; its BOM is still that of the revision there is."""
    sent(vault, b"one")
    mine(vault, b"one", b"one")

    once(vault, "merge_bom", lambda: theirs(vault, b"one less", 1))
    vault.send()
    assert (vault.waiting(), vault.lines()) == ((), {})
    assert "alice has committed revision 2 since" in vault.told[-1].entry.remark


def restored(vault: Vault, revision: int) -> None:
    """The server is back at an older state: what came after this revision is gone."""
    stored = next(s for s in vault.silo.items.values() if s.item.part_number == vault.number)
    stored.revisions[:] = [one for one in stored.revisions if one.revision_number <= revision]
    stored.files = {number: file for number, file in stored.files.items() if number <= revision}
    vault.silo.answers.clear()


def test_a_restored_server_gives_our_number_to_a_colleagues_file(vault: Vault) -> None:
    """Revision 2 was ours once. The one that is there now is not, and sending would undo it."""
    sent(vault, b"one", b"two")
    restored(vault, 1)
    theirs(vault, b"one less", 1)
    mine(vault, b"three", b"two", bom=False)
    vault.send()
    assert held(vault).newer["revision_number"] == 2
    assert vault.files() == [b"one", b"one less"]


def test_a_server_that_was_set_back_gets_all_that_is_newer_by_one_press(vault: Vault) -> None:
    """No colleague has committed anything: the newest revision there is an older one of ours."""
    sent(vault, b"one", b"two", b"three")
    restored(vault, 1)
    mine(vault, b"four", b"three", bom=False)
    mine(vault, b"five", b"four", bom=False)
    vault.send()
    assert [entry.state for entry in vault.waiting()] == [State.HELD] * 2
    assert all(entry.reason.startswith("The server was restored from a backup") for entry in vault.waiting())
    vault.send()
    assert len(vault.waiting()) == 2  # a person decides
    vault.send(force=True)
    assert (vault.waiting(), vault.files()) == ((), [b"one", b"four", b"five"])
    assert not any("on top of" in r.comment for r in vault.silo.revisions(vault.number))


def test_what_a_person_sent_past_a_set_back_keeps_nothing_back(vault: Vault) -> None:
    """The older one is out of date then, and a press for all sends the rest."""
    sent(vault, b"one", b"two", b"three")
    restored(vault, 1)
    mine(vault, b"four", b"three", bom=False)
    newest = mine(vault, b"five", b"four", bom=False)
    vault.send()
    vault.outbox.retry(newest.id)
    vault.send()
    mine(vault, b"six", b"five", bom=False)
    vault.send(force=True)
    assert vault.files() == [b"one", b"five", b"six"]
    assert held(vault).superseded


def test_a_commit_that_is_discarded_while_its_file_goes_sends_no_bom(vault: Vault) -> None:
    """And the others go as before."""
    entry = mine(vault, b"one")
    once(vault, "upload_file", lambda: vault.outbox.discard(entry.id))
    vault.send()
    assert (vault.waiting(), vault.files(), vault.lines()) == ((), [b"one"], {})
    assert list(vault.outbox.copies.iterdir()) == []


def test_after_a_set_back_a_colleagues_commit_is_a_question_all_the_same(vault: Vault) -> None:
    """Retry all does not send over it."""
    sent(vault, b"one", b"two")
    restored(vault, 1)
    mine(vault, b"three", b"two", bom=False)
    vault.send()
    theirs(vault, b"one less", 1)
    vault.send(force=True)
    vault.send(force=True)
    assert held(vault).newer["created_by"] == "alice"
    assert vault.files() == [b"one", b"one less"]


def test_a_bom_whose_revision_number_came_meanwhile_has_another_name(vault: Vault) -> None:
    """A server answers 409 to a name that it knows with another content."""
    merges: list[Any] = []
    merge, answers = vault.silo.merge_bom, iter((UnreachableError("the answer was lost"), None))

    def merge_bom(number: str, request: Any, **more: Any) -> Any:
        merges.append(request)
        answer = merge(number, request, **more)
        if error := next(answers, None):
            raise error
        return answer

    vault.silo.merge_bom = merge_bom  # type: ignore[method-assign]
    vault.commit(vault.snapshot(vault.part("Bolt", 1)))
    vault.send()
    (waiting,) = vault.waiting()
    vault.outbox.update(waiting.id, revision=7)  # as after a restore, when its file was sent once more
    stored = next(s for s in vault.silo.items.values() if s.item.part_number == vault.number)
    stored.revisions[-1] = stored.revisions[-1].model_copy(update={"revision_number": 7})
    vault.send(force=True)
    assert [one.document.revision for one in merges] == [1, 7]
    assert merges[0].sync_id == waiting.key != merges[1].sync_id


def test_our_own_upload_to_a_restored_server_is_no_colleagues(vault: Vault) -> None:
    """Its answer was lost, and its number is below what the server had before it was restored."""
    sent(vault, b"one", b"two")
    mine(vault, b"three", b"two", bom=False)

    once(vault, "upload_file", lose)
    vault.send()
    restored(vault, 0)
    once(vault, "upload_file", lose, after=True)
    vault.send(force=True)
    vault.send(force=True)
    assert (vault.waiting(), vault.files()) == ((), [b"three"])


def test_another_server_knows_nothing_of_the_old_ones_revisions(vault: Vault) -> None:
    """Neither what was seen there, nor a comment on it, goes along."""
    sent(vault, b"one")
    theirs(vault, b"one less", 1)
    entry = mine(vault, b"one other", b"one", bom=False)
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
    sent(vault, b"one", bom=True)
    mine(vault, b"variant", b"one", path=vault.folder / "Variant.FCStd")
    mine(vault, b"the original continues", b"one", bom=False)
    vault.send(force=True)
    assert (vault.files(), vault.lines()) == ([b"one", b"the original continues"], {"F01-0001": 3})
    assert (held(vault).file_left, held(vault).bom_left) == (True, True)
    for word in ("Variant.FCStd", vault.number, "whose file in Silo is Top.FCStd", "Same part", "Discard"):
        assert word in held(vault).reason


def test_on_top_of_what_a_person_saw_and_of_nothing_else(vault: Vault) -> None:
    """The server is restored between the person's word and the sending."""
    sent(vault, b"one")
    theirs(vault, b"one less", 1)
    entry = mine(vault, b"one other", b"one", bom=False)
    vault.send()
    vault.outbox.retry(entry.id)
    restored(vault, 1)
    theirs(vault, b"another one", 1)
    vault.send()
    assert held(vault).newer["file_checksum"] == sha(b"another one")
    assert vault.files() == [b"one", b"another one"]


def test_a_revision_without_a_file_is_no_colleagues_work(vault: Vault) -> None:
    """Somebody typed a mass on the web page: the file is still the one that this was made from."""
    sent(vault, b"one")
    vault.silo.update_item(vault.number, properties={"mass_kg": 2})
    mine(vault, b"two", b"one", bom=False)
    vault.send()
    assert (vault.waiting(), vault.files()) == ((), [b"one", b"two"])


@pytest.mark.parametrize(
    ("stored", "path", "other"),
    [
        ("Top.FCStd", "/elsewhere/TOP.fcstd", ""),  # Windows and macOS show one file by both
        ("Top.FCStd", "/elsewhere/Top 2.FCStd", "Top.FCStd"),
        ("_Aux.FCStd", "/v/Aux.FCStd", ""),  # a server gives a device of Windows this name
        ("aux.FCStd", "/v/Aux.FCStd", ""),
        ("aux.FCStd", "/v/Part.FCStd", "aux.FCStd"),
    ],
)
def test_a_name_that_is_spelt_otherwise_is_no_other_name(stored: str, path: str, other: str) -> None:
    """Else each commit of such a file would be asked about."""
    assert other_name(path, [Revision(revision_number=1, file_name=stored)]) == other


def test_a_bom_that_was_not_sent_makes_none_out_of_date(vault: Vault) -> None:
    """What the pane says of an older held one stays true: no newer commit of it has arrived."""
    refused(vault, b"one")
    mine(vault, b"longer", b"one")

    once(vault, "merge_bom", lambda: theirs(vault, b"went further", 2))
    vault.send()
    assert (held(vault).bom_left, held(vault).superseded) == (True, False)


def test_a_held_bom_does_not_go_after_a_file_with_a_colleagues_between(vault: Vault) -> None:
    """Sent on top of theirs at a person's word: the older BOM knows neither."""
    entry = refused(vault, b"one")
    theirs(vault, b"one less", 1)
    on_top = mine(vault, b"mine", b"one", bom=False)
    vault.send()
    vault.outbox.retry(on_top.id)
    vault.send()
    assert vault.files()[-1] == b"mine"
    vault.outbox.retry(entry.id)
    vault.send()
    assert (vault.waiting(), vault.lines()) == ((), {})


def test_a_lost_answer_is_found_behind_a_colleagues_commit(vault: Vault) -> None:
    """Ours arrived, theirs was made from it: ours is not held, and not sent again."""
    sent(vault, b"one")
    mine(vault, b"two", b"one", bom=False)

    once(vault, "upload_file", lose, after=True)
    vault.send()
    theirs(vault, b"three", 2)
    vault.send(force=True)
    assert (vault.waiting(), vault.files()) == ((), [b"one", b"two", b"three"])
    assert vault.told[-1].revision == 2


@pytest.mark.parametrize("since", ["nothing", "a change of properties", "a colleague's file"])
def test_a_bom_does_not_go_without_its_file(vault: Vault, since: str) -> None:
    """The server was restored between the two. Its number may be free, or another revision's by now."""
    sent(vault, b"one")
    entry = refused(vault, b"longer", b"one")
    restored(vault, 1)
    if since == "a change of properties":
        vault.silo.update_item(vault.number, properties={"mass_kg": 2})
    elif since == "a colleague's file":
        theirs(vault, b"less", 1)
    vault.outbox.retry(entry.id)
    vault.send()
    if since == "a colleague's file":
        entry = held(vault)
        assert (entry.file_left, entry.bom_left, entry.newer["revision_number"]) == (True, True, 2)
        assert (vault.files(), vault.lines()) == ([b"one", b"less"], {})
    else:
        assert (vault.waiting(), vault.files()) == ((), [b"one", b"longer"])
        assert vault.lines() == {"F01-0001": 6}


def test_a_restore_between_the_look_and_the_merge_is_caught_by_the_server(vault: Vault) -> None:
    """The file goes once more with the next run, then its BOM."""
    mine(vault, b"one")

    once(vault, "merge_bom", lambda: restored(vault, 0))
    assert "is not on this server" in vault.send().failed[0].reason
    assert (vault.files(), vault.lines()) == ([], {})
    vault.send(force=True)
    assert (vault.waiting(), vault.files(), vault.lines()) == ((), [b"one"], {"F01-0001": 3})


@pytest.mark.parametrize("cut", [False, True], ids=["at once", "cut off before the upload"])
def test_a_file_that_went_once_more_is_found_below_a_colleagues(vault: Vault, cut: bool) -> None:
    """The server was restored to before all of its files, the answer to our upload lost, and somebody went on
    from it: the numbers of before say nothing."""
    sent(vault, b"one")
    entry = refused(vault, b"two", b"one")
    restored(vault, 0)
    vault.outbox.retry(entry.id)
    if cut:
        once(vault, "revisions", lambda: once(vault, "revisions", lose))
        vault.send()
        assert vault.files() == []
    once(vault, "upload_file", lose, after=True)
    vault.send(force=cut)
    theirs(vault, b"three", 1)
    vault.send(force=True)
    assert (vault.waiting(), vault.files(), vault.lines()) == ((), [b"two", b"three"], {})


def test_a_server_without_revisions_gets_the_file_once(vault: Vault) -> None:
    """It cannot say whether the file is still there; its BOM is sent anyway."""

    class Bare(FakeSilo):
        def revisions(self, *_arguments: object, **_more: object) -> list[Revision]:
            raise RouteMissingError("no such route")

    silo, known = vault.silo, vault.silo.revisions
    silo.__class__ = Bare
    entry = refused(vault, b"one")
    silo.answers.clear()  # nor does it know a repeat
    vault.outbox.retry(entry.id)
    vault.send()
    silo.__class__ = FakeSilo
    assert (vault.waiting(), len(known(vault.number)), vault.lines()) == ((), 1, {"F01-0001": 3})


def test_a_bom_alone_whose_file_is_gone_is_a_persons_question(vault: Vault) -> None:
    """There is no copy of the file to send once more."""
    sent(vault, b"one")
    vault.commit(vault.snapshot(vault.part("Bolt", 4)), content=None, origin=sha(b"one"))
    once(vault, "merge_bom", lambda: restored(vault, 0))
    vault.send()
    assert "is not on this server" in held(vault).reason
    assert (held(vault).file_left, vault.lines()) == (False, {})


def test_a_request_that_is_sent_again_names_the_file_as_it_is_numbered_now(vault: Vault) -> None:
    """It was written down with the number of before the restore, which is a colleague's by now."""
    sent(vault, b"one")
    mine(vault, b"two", b"one")
    once(vault, "merge_bom", lose)
    vault.send()
    restored(vault, 0)
    once(vault, "merge_bom", lambda: theirs(vault, b"three", 1))
    vault.send(force=True)
    assert (vault.waiting(), vault.files(), vault.lines()) == ((), [b"two", b"three"], {})


def test_a_commit_made_from_an_older_revision_of_ours_is_no_set_back(vault: Vault) -> None:
    """The newest revision is known here and is older than nothing: a press for all must not undo it."""
    sent(vault, b"one", b"two")
    mine(vault, b"three", b"one", bom=False)
    vault.send()
    assert "restored from a backup" not in held(vault).reason
    vault.send(force=True)
    assert vault.files() == [b"one", b"two"]


class Unchecked(FakeSilo):
    """A Silo without a base check: it takes any file, and keeps no base."""

    def upload_file(self, *arguments: Any, **more: Any) -> Revision:
        origin = more.pop("origin", None)
        bare = None if origin is None else Origin(file_path=origin.file_path, links=origin.links)
        return super().upload_file(*arguments, origin=bare, **more)


def test_a_colleagues_revision_between_look_and_upload_is_a_conflict_afterwards(vault: Vault) -> None:
    """A server without a base check has undone it: the commit says whose it was, and is no success."""
    sent(vault, b"one", bom=True)
    vault.silo.__class__ = Unchecked
    mine(vault, b"two", b"one")
    once(vault, "upload_file", lambda: theirs(vault, b"theirs", 1))
    vault.send()
    assert vault.files() == [b"one", b"theirs", b"two"]
    (told,) = [one for one in vault.told if one.undone]
    assert [one.revision_number for one in told.undone] == [2]
    assert "alice committed revision 2 while this was sent as revision 3" in told.conflict


def priced(vault: Vault) -> None:
    """Another user changes the item alone."""
    vault.silo.update_item(vault.number, properties={"standard_cost": 1}, comment="a price")


def test_a_change_of_properties_between_look_and_upload_is_no_conflict(vault: Vault) -> None:
    """A revision without a file undoes no file."""
    sent(vault, b"one", bom=True)
    vault.silo.__class__ = Unchecked
    mine(vault, b"two", b"one")
    once(vault, "upload_file", lambda: priced(vault))
    vault.send()
    assert vault.files() == [b"one", b"two"]
    assert not any(told.undone for told in vault.told)


def test_a_server_that_checks_the_base_tells_of_no_conflict_afterwards(vault: Vault) -> None:
    """It refuses the upload, and the commit is held as before."""
    sent(vault, b"one", bom=True)
    mine(vault, b"two", b"one")
    once(vault, "upload_file", lambda: theirs(vault, b"theirs", 1))
    vault.send()
    assert vault.files() == [b"one", b"theirs"]
    assert not any(told.undone for told in vault.told)


def test_in_a_shared_folder_a_record_of_theirs_does_not_hide_what_they_committed(vault: Vault) -> None:
    """The colleague commits from the same folder: its record is of theirs, the open document is of ours."""
    sent(vault, b"one")
    opened = DocumentOrigin(str(vault.top), None, sha(b"one"))
    newest = theirs(vault, b"theirs", 1)
    before = record_of(str(vault.top))
    assert before is not None
    vault.top.write_bytes(b"theirs")
    record = replace(before, sha256=sha(b"theirs"), revision=newest.revision_number)
    write_record(str(vault.top), record)
    identity = vault.ids["Top"]
    asked = [FileToCheck(str(vault.top), identity, opened)]
    (found,) = look(vault.silo, vault.outbox, asked, lambda _path: None).values()
    assert (found.revision, found.base) == (newest.revision_number, 1)
    revisions = vault.silo.revisions(vault.number)
    origins = (sha(b"one"), sha(b"theirs"))
    state = file_state(sha(b"mine"), origins, record, newest, record.server, lambda: revisions)
    assert state is FileState.BOTH
