# SPDX-License-Identifier: LGPL-2.1-or-later
"""One contract for all that answers like a Silo: the fake in memory, and the embedded server over HTTP."""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from uuid import uuid4

import pytest
from model_file import model_file

from silo.api.client import SiloClient
from silo.api.files import DocumentId, Origin
from silo.api.wire import HeldItem, LinkedFile, MergeEntry, MergeRequest, MergeResult, SourceDocument
from silo.bom.compare.difference import diff_bom
from silo.bom.errors import (
    ConflictError,
    CycleError,
    InputError,
    MissingRevisionError,
    NewerRevisionError,
    NotFoundError,
    RejectedError,
    VersionConflictError,
)
from silo.testing import FakeSilo

Silo = SiloClient | FakeSilo


@contextmanager
def served(kind: str, folder: Path) -> Iterator[SiloClient]:
    run = pytest.importorskip("silo_server.run", reason="the embedded server needs the extra 'server'")
    from server_testing import Databases

    databases = Databases(folder)
    try:
        with (
            run.running_server(
                databases.new(kind), token="silo_contract", files_dir=folder / "files"
            ) as server,
            SiloClient(server.base_url, server.token) as client,
        ):
            yield client
    finally:
        databases.close()


@pytest.fixture(scope="module")
def server_client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SiloClient]:
    with served("sqlite", tmp_path_factory.mktemp("silo")) as client:
        yield client


@pytest.fixture(scope="module")
def postgres_client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SiloClient]:
    with served("postgres", tmp_path_factory.mktemp("silo")) as client:
        yield client


@pytest.fixture(params=["fake", "server", pytest.param("postgres", marks=pytest.mark.postgres)])
def silo(request: pytest.FixtureRequest) -> Silo:
    if request.param == "fake":
        return FakeSilo()
    client: SiloClient = request.getfixturevalue(f"{request.param}_client")
    return client


def make(silo: Silo, name: str, category: str = "M01") -> str:
    """A new item's part number."""
    kind = "assembly" if category.startswith("A") else "part"
    return silo.create_item("kindred-rd", category, name, item_type=kind).part_number


def merge(silo: Silo, parent: str, **quantities: float) -> MergeResult:
    return silo.merge_bom(parent, request(**quantities))


def request(sync_id: str | None = None, *, dry_run: bool = False, **quantities: float) -> MergeRequest:
    entries = [MergeEntry(child_part_number=pn.replace("_", "-"), quantity=q) for pn, q in quantities.items()]
    return MergeRequest(entries=entries, sync_id=sync_id, dry_run=dry_run)


def key(part_number: str) -> str:
    return part_number.replace("-", "_")


def lines(silo: Silo, parent: str) -> dict[str, tuple[float | None, str, bool]]:
    return {
        line.child_part_number: (line.quantity, line.source, line.unreferenced_since is not None)
        for line in silo.get_bom(parent)
    }


def test_the_fake_has_the_methods_of_the_client_with_the_same_arguments() -> None:
    """Whoever is written against one works with the other."""

    def methods(kind: type) -> dict[str, list[tuple[str, object, object]]]:
        return {
            name: [(one.name, one.kind, one.default) for one in inspect.signature(method).parameters.values()]
            for name, method in inspect.getmembers(kind, inspect.isfunction)
            if not name.startswith("_")
        }

    client, fake = methods(SiloClient), methods(FakeSilo)
    # The fake has no connection, no administrators, no pages, no orders, no pictures and no models, and
    # reads no tables.
    own = {
        "asked_again",
        "begin_login",
        "close",
        "events",
        "get_changes",
        "get_geometry",
        "get_order",
        "get_order_table",
        "get_scene",
        "import_bom",
        "import_categories",
        "import_parts",
        "import_prices",
        "modules",
        "system",
        "thumbnail",
        "undo_import",
    }
    assert set(client) - set(fake) == own
    assert set(fake) - set(client) == {"set_mode"}
    for name in set(client) & set(fake):
        assert client[name] == fake[name], name


def test_many_boms_are_those_that_are_asked_for_singly(silo: Silo) -> None:
    """By the number as it was asked for; what is not known is left out."""
    top, part = make(silo, "Top", "A01"), make(silo, "Part")
    merge(silo, top, **{key(part): 2})
    found = silo.get_boms([top, top.lower(), part, "no such item"])
    assert list(found) == [top, top.lower(), part]
    assert found[top] == found[top.lower()] == silo.get_bom(top)
    assert found[part] == []


def test_an_item_is_found_by_its_identity_and_reads_as_a_mapping(silo: Silo) -> None:
    """The contract of resolve_part_numbers: a mapping with part_number and name, or None."""
    made = silo.create_item("kindred-rd", "M01", "Base plate", properties={"mass_kg": 1.5})
    found = silo.get_item_by_uuid(made.id)
    assert found is not None
    assert found["part_number"] == made.part_number
    assert found["name"] == "Base plate"
    assert dict(found)["properties"] == {"mass_kg": 1.5}
    assert silo.get_item_by_uuid(str(uuid4())) is None


@pytest.mark.parametrize("odd", ["", "..", "not-a-uuid", "a/b", "ä"])
def test_what_is_no_identity_is_no_item(silo: Silo, odd: str) -> None:
    """Files hold garbage where an identity should be; that is an unregistered part, not a failure."""
    assert silo.get_item_by_uuid(odd) is None
    assert silo.get_items_by_uuid([odd]) == {}


def test_identities_are_found_in_any_spelling_under_the_spelling_given(silo: Silo) -> None:
    """Capitals, braces and missing dashes are one identity; unknown ones are left out."""
    made = silo.create_item("kindred-rd", "M01", "Cover")
    loud, bare = made.id.upper(), made.id.replace("-", "")
    found = silo.get_items_by_uuid([loud, str(uuid4()), bare, loud])
    assert {uuid: item.part_number for uuid, item in found.items()} == {
        loud: made.part_number,
        bare: made.part_number,
    }


def test_a_part_number_is_found_in_any_case_and_a_missing_one_is_reported(silo: Silo) -> None:
    """kindred-rd: numbers compare case-insensitively."""
    number = make(silo, "Shaft")
    assert silo.get_item(number.lower()).part_number == number
    with pytest.raises(NotFoundError, match="Z99-0001"):
        silo.get_item("Z99-0001")


def test_a_number_preview_reserves_nothing(silo: Silo) -> None:
    """The form asks for it again and again; the next item gets it."""
    preview = silo.generate_part_number("kindred-rd", "F01")
    assert silo.generate_part_number("kindred-rd", "F01") == preview
    assert make(silo, "Bolt", "F01") == preview
    with pytest.raises(RejectedError):
        silo.generate_part_number("kindred-rd", "no-such")


def test_creating_twice_with_one_key_makes_one_item(silo: Silo) -> None:
    """A crash between creation and stamping must not give a part two numbers."""
    wanted = str(uuid4())
    first = silo.create_item("kindred-rd", "M01", "Bracket", idempotency_key=wanted)
    again = silo.create_item("kindred-rd", "M01", "Bracket", idempotency_key=wanted)
    assert (again.id, again.part_number) == (wanted, first.part_number)


def test_the_search_looks_for_every_word_and_by_type(silo: Silo) -> None:
    """Words in any order; the type narrows."""
    word = uuid4().hex
    part, assembly = make(silo, f"Gear {word}"), make(silo, f"Gearbox {word}", "A01")
    assert {item.part_number for item in silo.search_items(f"{word} gear")} == {part, assembly}
    assert [item.part_number for item in silo.search_items(word, item_type="assembly")] == [assembly]
    assert silo.search_items("no such thing at all") == []
    assert len(silo.search_items(limit=1)) == 1


def test_an_item_keeps_its_identity_under_a_new_number(silo: Silo) -> None:
    """The number is a name, the UUID is the item; properties make a revision, a description does not."""
    made = silo.create_item("kindred-rd", "M01", "Old name")
    renamed = f"X-{uuid4().hex[:8]}"
    after = silo.update_item(made.part_number, part_number=renamed, description="New name")
    assert (after.id, after.part_number, after.description) == (made.id, renamed, "New name")
    assert after.current_revision == made.current_revision
    revised = silo.update_item(renamed, properties={"mass_kg": 2}, comment="weighed")
    assert revised.current_revision == made.current_revision + 1
    with pytest.raises(InputError, match="colour"):
        silo.update_item(renamed, colour="red")


def test_the_schema_names_its_categories(silo: Silo) -> None:
    """Code and text, whatever form the schema has; an unknown schema is reported."""
    assert silo.categories()["F01"] == "Screws and bolts"
    assert silo.get_schema("kindred-rd")["name"] == "kindred-rd"
    with pytest.raises(NotFoundError):
        silo.get_schema("no-such")


def test_a_merge_gives_the_diff_and_the_server_has_it(silo: Silo) -> None:
    """Spec §5: added, changed, removed (kept and flagged), unchanged; warnings; the page to look at."""
    top = make(silo, "Top", "A01")
    kept, changed, gone, new = (make(silo, name) for name in ("Kept", "Changed", "Gone", "New"))
    merge(silo, top, **{key(kept): 1, key(changed): 8, key(gone): 2})
    result = merge(silo, top, **{key(kept): 1, key(changed): 12, key(new): 1})
    assert result.status == "merged"
    assert [dict(q) for q in result.diff.added] == [{"part_number": new, "quantity": 1}]
    assert [dict(q) for q in result.diff.removed] == [{"part_number": gone, "quantity": 2}]
    assert [dict(q) for q in result.diff.quantity_changed] == [
        {"part_number": changed, "old_quantity": 8, "new_quantity": 12}
    ]
    assert [dict(q) for q in result.diff.unchanged] == [{"part_number": kept, "quantity": 1}]
    assert [(w.type, w.part_number) for w in result.warnings] == [("unreferenced", gone)]
    assert result.resolve_url == f"/items/{top}/bom"
    assert lines(silo, top) == {
        kept: (1, "assembly", False),
        changed: (12, "assembly", False),
        gone: (2, "assembly", True),
        new: (1, "assembly", False),
    }


def test_what_the_server_has_diffs_as_the_core_does(silo: Silo) -> None:
    """The lines are the mappings that diff_bom takes."""
    top, part = make(silo, "Top", "A01"), make(silo, "Part")
    merge(silo, top, **{key(part): 3})
    assert diff_bom([{"child_part_number": part, "quantity": 3}], silo.get_bom(top)).drifted is False


def test_a_manual_line_is_never_touched_and_a_difference_is_a_conflict(silo: Silo) -> None:
    """What people wrote stays; the assembly's other quantity is reported."""
    top, glue = make(silo, "Top", "A01"), make(silo, "Glue", "C01")
    silo.add_bom_line(top, glue, quantity=2, notes="one drop each")
    result = merge(silo, top, **{key(glue): 5})
    assert [(w.type, w.part_number) for w in result.warnings] == [("conflict", glue)]
    assert lines(silo, top) == {glue: (2, "manual", False)}
    assert silo.get_bom(top)[0].notes == "one drop each"


def test_the_same_sync_id_gives_the_same_answer(silo: Silo) -> None:
    """Sending twice does no harm, even when something happened in between."""
    top, part = make(silo, "Top", "A01"), make(silo, "Part")
    first = silo.merge_bom(top, request("sync-1", **{key(part): 1}))
    merge(silo, top, **{key(part): 7})
    again = silo.merge_bom(top, request("sync-1", **{key(part): 1}))
    assert again.diff == first.diff
    assert lines(silo, top) == {part: (7, "assembly", False)}
    with pytest.raises(ConflictError, match="sync-1"):
        silo.merge_bom(top, request("sync-1", **{key(part): 2}))


def test_a_dry_run_answers_and_changes_nothing(silo: Silo) -> None:
    """The preview is the merge's own answer."""
    top, part = make(silo, "Top", "A01"), make(silo, "Part")
    result = silo.merge_bom(top, request(dry_run=True, **{key(part): 4}))
    assert [dict(q) for q in result.diff.added] == [{"part_number": part, "quantity": 4}]
    assert silo.get_bom(top) == []


def test_all_unknown_children_are_reported_at_once_and_nothing_changes(silo: Silo) -> None:
    """One 400 with every bad entry, by its index."""
    top, part = make(silo, "Top", "A01"), make(silo, "Part")
    with pytest.raises(RejectedError) as caught:
        merge(silo, top, no_such_1=1, **{key(part): 1}, no_such_2=2)
    assert len(caught.value.problems) == 2
    assert "entries[0]" in caught.value.problems[0]
    assert "entries[2]" in caught.value.problems[1]
    assert silo.get_bom(top) == []


def test_an_unknown_assembly_is_reported_as_such(silo: Silo) -> None:
    """404 for the parent."""
    part = make(silo, "Part")
    with pytest.raises(NotFoundError, match="Z98-0001"):
        merge(silo, "Z98-0001", **{key(part): 1})


def test_a_ring_is_refused_with_its_way(silo: Silo) -> None:
    """A in B in A: the path says how."""
    top, sub = make(silo, "Top", "A01"), make(silo, "Sub", "A01")
    merge(silo, top, **{key(sub): 1})
    with pytest.raises(CycleError) as caught:
        merge(silo, sub, **{key(top): 1})
    assert {top, sub} <= set(caught.value.path)
    with pytest.raises(CycleError):
        merge(silo, top, **{key(top): 1})


def test_a_version_that_is_not_the_newest_is_refused(silo: Silo) -> None:
    """If-Match: somebody was quicker."""
    top, part = make(silo, "Top", "A01"), make(silo, "Part")
    version = silo.get_bom_version(top)
    silo.merge_bom(top, request(**{key(part): 1}), if_match=version)
    with pytest.raises(VersionConflictError):
        silo.merge_bom(top, request(**{key(part): 2}), if_match=version)
    silo.merge_bom(top, request(**{key(part): 2}), if_match=silo.get_bom_version(top))
    assert lines(silo, top) == {part: (2, "assembly", False)}


def test_a_line_is_edited_and_removed_by_hand(silo: Silo) -> None:
    """A person's quantity makes the line the person's."""
    top, part = make(silo, "Top", "A01"), make(silo, "Part")
    merge(silo, top, **{key(part): 4})
    changed = silo.update_bom_line(top, part, quantity=6, find_number="10")
    assert (changed.quantity, changed.source, changed.find_number) == (6, "manual", "10")
    with pytest.raises(ConflictError):
        silo.add_bom_line(top, part)
    silo.remove_bom_line(top, part)
    assert silo.get_bom(top) == []
    with pytest.raises(NotFoundError):
        silo.remove_bom_line(top, part)


def test_a_file_becomes_a_revision_and_comes_back(silo: Silo, tmp_path: Path) -> None:
    """Upload, list, download: the bytes and their hash are the same."""
    number, content = make(silo, "Housing"), model_file(bytes(range(256)) * 700)
    source, back = tmp_path / 'Ho"use ä.FCStd', tmp_path / "back.FCStd"
    source.write_bytes(content)
    seen: list[tuple[int, int]] = []
    before = [r.revision_number for r in silo.revisions(number)]
    made = silo.upload_file(
        number, source, "first ✓", {"mass_kg": 0.2}, lambda done, total: seen.append((done, total))
    )
    sha256 = hashlib.sha256(content).hexdigest()
    assert (made.file_checksum, made.file_size, made.comment) == (sha256, len(content), "first ✓")
    assert seen[-1] == (len(content), len(content))
    assert silo.get_item(number).properties["mass_kg"] == 0.2
    second = silo.upload_file(number, source, "second", file_name="other.FCStd")
    assert [r.revision_number for r in silo.revisions(number)] == [
        second.revision_number,
        made.revision_number,
        *before,
    ]
    assert silo.download_file(number, back) == sha256
    assert back.read_bytes() == content
    assert silo.download_file(number, back, made.revision_number) == sha256
    with pytest.raises(NotFoundError):
        silo.upload_file("Z97-0001", source)
    with pytest.raises(NotFoundError):
        silo.download_file(number, back, 99)
    assert back.read_bytes() == content


def test_the_server_says_who_and_how_it_is(silo: Silo) -> None:
    """User, mode, and full addresses of pages."""
    assert silo.whoami().username
    assert silo.ready().mode == "normal"
    assert silo.web_url("/items/A01-0001/bom") == f"{silo.base_url}/items/A01-0001/bom"


def test_a_merge_is_announced(silo: Silo) -> None:
    """The event that the activity pane shows; replay gives it again."""
    top, part = make(silo, "Top", "A01"), make(silo, "Part")
    first = silo.open_events()
    events = iter(first)
    result = silo.merge_bom(top, request("announced", **{key(part): 1}))
    event = next(event for event in events if event.merge is not None)
    first.close()
    assert event.merge is not None
    assert (event.type, event.item, event.merge.sync_id) == ("bom_merge", top, "announced")
    assert event.merge.summary == "BOM updated: 1 added, 0 quantity changed, 0 unreferenced"
    assert event.merge.diff.added == result.diff.added
    assert event.merge.resolve_url == result.resolve_url
    assert event.id is not None
    replay = silo.open_events(str(int(event.id.partition("-")[0]) - 1))
    assert next(iter(replay)) == event
    replay.close()


def sha(content: str) -> str:
    return hashlib.sha256(model_file(content.encode())).hexdigest()


def with_files(silo: Silo, folder: Path) -> str:
    """An item whose revisions 1 to 5 are the files one, two, one again, a change of properties, three."""
    number = make(silo, "Top", "A01")
    for content in ("one", "two", "one", "", "three"):
        if content:
            (folder / "Top.FCStd").write_bytes(model_file(content.encode()))
            silo.upload_file(number, folder / "Top.FCStd", content)
        else:
            silo.update_item(number, properties={"mass_kg": 2})
    return number


def test_a_file_that_would_undo_the_newest_is_refused(silo: Silo, tmp_path: Path) -> None:
    """By the revision that it was made from; the newest file itself undoes nothing."""
    number, file = with_files(silo, tmp_path), tmp_path / "Top.FCStd"
    for base, content in ((4, "mine"), (3, "one"), (0, "two")):
        file.write_bytes(model_file(content.encode()))
        with pytest.raises(NewerRevisionError) as caught:
            silo.upload_file(number, file, origin=Origin(base_revision=base))
        newer = caught.value.revision
        assert (newer["revision_number"], newer["file_checksum"]) == (5, sha("three"))
        assert newer["comment"] == "three"
    assert len(silo.revisions(number)) == 5
    for made, (base, content) in enumerate(
        ((0, "three"), (6, "mine"), (8, "more"), (None, "other")), start=6
    ):
        file.write_bytes(model_file(content.encode()))
        assert silo.upload_file(number, file, origin=Origin(base_revision=base)).revision_number == made


# Revision and content that a BOM was read from → whether it may be merged.
OLDER, GONE = NewerRevisionError, MissingRevisionError
READ_FROM: list[tuple[int | None, str | None, type[ConflictError] | None]] = [
    (None, None, None),
    (None, "three", None),
    (None, "edited", None),
    (None, "one", OLDER),
    (None, "two", OLDER),
    (5, "three", None),
    (1, "three", None),
    (5, "one", None),
    (3, "one", OLDER),
    (2, "two", OLDER),
    (2, None, OLDER),
    (5, None, None),
    (5, "gone", GONE),
    (2, "gone", GONE),
    (6, "gone", GONE),
]


def test_the_bom_of_a_file_that_would_undo_the_newest_is_refused(silo: Silo, tmp_path: Path) -> None:
    """By the revision, by the content, or by both; a file that the server does not have goes first."""
    number, part = with_files(silo, tmp_path), make(silo, "Bolt", "F01")
    for count, (revision, content, refusal) in enumerate(READ_FROM, start=1):
        for dry_run in (True, False):
            document = SourceDocument(
                file="Top.FCStd", revision=revision, sha256=sha(content) if content else None
            )
            wanted = request(dry_run=dry_run, **{key(part): count}).model_copy(update={"document": document})
            before = silo.get_bom(number)
            if refusal is None:
                diff = silo.merge_bom(number, wanted).diff
                changed = [*diff.added, *diff.quantity_changed]
                assert [line.part_number for line in changed] == [part], (revision, content)
            else:
                with pytest.raises(refusal):
                    silo.merge_bom(number, wanted)
            if refusal is not None or dry_run:
                assert silo.get_bom(number) == before, (revision, content)


def test_a_file_of_several_items_has_revisions_of_its_own(silo: Silo, tmp_path: Path) -> None:
    """Its UUID is named by the first upload; each item in it knows it, with its object and its file."""
    items = [silo.create_item("kindred-rd", "M01", name) for name in ("Left", "Right")]
    uuid = DocumentId(uuid4())
    held = [HeldItem(item=item.id, object=f"Part{n}") for n, item in enumerate(items)]
    held.append(HeldItem(item=str(uuid4()), object="NotInSilo"))
    origin = Origin(base_revision=0, file_path="parts/both.FCStd", items=held)
    for number, content in enumerate((model_file(b"one"), model_file(b"two")), start=1):
        (tmp_path / "both.FCStd").write_bytes(content)
        base = origin.model_copy(update={"base_revision": number - 1})
        made = silo.upload_file(
            uuid, tmp_path / "both.FCStd", "c", idempotency_key=f"{uuid}{number}", origin=base
        )
        again = silo.upload_file(
            uuid, tmp_path / "both.FCStd", "c", idempotency_key=f"{uuid}{number}", origin=base
        )
        assert (made.revision_number, again.revision_number) == (number, number)
    (tmp_path / "both.FCStd").write_bytes(model_file(b"three"))
    old = origin.model_copy(update={"base_revision": 1})
    with pytest.raises(NewerRevisionError) as refused:
        silo.upload_file(uuid, tmp_path / "both.FCStd", origin=old)
    assert refused.value.revision["revision_number"] == 2
    assert [one.revision_number for one in silo.revisions(uuid)] == [2, 1]
    silo.download_file(uuid, tmp_path / "back", 1)
    assert (tmp_path / "back").read_bytes() == model_file(b"one")
    for item in items:
        (document,) = silo.documents_of(item.part_number)
        assert (document.id, document.part_number, document.revision_number) == (uuid, "", 2)
        assert (document.file_name, document.file_path) == ("both.FCStd", "parts/both.FCStd")
        assert document.file_checksum == hashlib.sha256(model_file(b"two")).hexdigest()
        assert silo.get_item(item.part_number).current_revision == 0
        assert silo.revisions(item.part_number) == []
    wanted = [(f"Part{n}", item.part_number) for n, item in enumerate(items)]
    assert [(one.object, one.part_number) for one in document.holds] == wanted


def test_the_file_of_one_item_is_one_document_with_the_numbers_of_the_item(
    silo: Silo, tmp_path: Path
) -> None:
    """Sent to either address it arrives at both; an upload by the item's number needs no change."""
    item = silo.create_item("kindred-rd", "M01", "Alone")
    uuid = DocumentId(item.id)
    assert silo.get_documents([item.id]) == {}
    for content, to in ((model_file(b"a"), item.part_number), (model_file(b"b"), uuid)):
        (tmp_path / "p.FCStd").write_bytes(content)
        silo.upload_file(to, tmp_path / "p.FCStd")
    assert [one.revision_number for one in silo.revisions(item.part_number)] == [2, 1]
    assert [one.revision_number for one in silo.revisions(uuid)] == [2, 1]
    found = silo.get_documents([item.id.upper(), str(uuid4())])
    assert list(found) == [item.id]
    assert found[item.id].part_number == item.part_number
    assert [(one.item, one.object) for one in found[item.id].holds] == [(item.id, "")]
    assert [one.id for one in silo.documents_of(item.part_number)] == [item.id]


def test_a_file_without_an_item_is_used_by_what_links_to_it(silo: Silo, tmp_path: Path) -> None:
    """Until a newer revision links to it no more; a link names the document or the item."""
    (tmp_path / "f.FCStd").write_bytes(model_file(b"f"))
    sheet, user = DocumentId(uuid4()), silo.create_item("kindred-rd", "A01", "Top", item_type="assembly")
    part = silo.create_item("kindred-rd", "M01", "Part")
    silo.upload_file(sheet, tmp_path / "f.FCStd")
    silo.upload_file(part.part_number, tmp_path / "f.FCStd")
    links = [LinkedFile(path="sheet.FCStd", document=sheet), LinkedFile(path="p.FCStd", item=part.id)]
    silo.upload_file(user.part_number, tmp_path / "f.FCStd", origin=Origin(links=links))
    assert [one.id for one in silo.get_document(sheet).used_by] == [user.id]
    assert silo.get_document(sheet).holds == []
    top = silo.get_document(user.id)
    assert {one.id for one in top.linked} == {str(sheet), part.id}
    assert top.links == links
    silo.upload_file(user.part_number, tmp_path / "f.FCStd", origin=Origin(links=links[1:]))
    assert silo.get_document(sheet).used_by == []
    with pytest.raises(NotFoundError):
        silo.get_document(str(uuid4()))


def test_an_archived_item_is_found_no_more(silo: Silo) -> None:
    number = make(silo, "Orphan")
    item = silo.get_item(number)
    silo.archive_item(number)
    assert silo.get_item_by_uuid(item.id) is None
    with pytest.raises(NotFoundError):
        silo.archive_item(number)


def test_a_line_gets_its_find_number_once(silo: Silo) -> None:
    """By the step; a free proposal of CAD is taken; what is removed comes back with its own number."""
    top, *parts = make(silo, "Top", "A01"), *(make(silo, f"Part {n}") for n in range(4))
    first = [MergeEntry(child_part_number=part, quantity=1) for part in parts[:2]]
    silo.merge_bom(top, MergeRequest(entries=first))
    more = [
        *first,
        MergeEntry(child_part_number=parts[2], quantity=1, find_number="20"),
        MergeEntry(child_part_number=parts[3], quantity=1, find_number="33"),
    ]
    silo.merge_bom(top, MergeRequest(entries=more))
    wanted = dict(zip(parts, ["10", "20", "40", "33"], strict=True))
    assert {line.child_part_number: line.find_number for line in silo.get_bom(top)} == wanted
    silo.remove_bom_line(top, parts[2])
    new = make(silo, "New")
    assert silo.add_bom_line(top, new).find_number == "50"
    silo.merge_bom(top, MergeRequest(entries=more))
    numbers = {line.child_part_number: line.find_number for line in silo.get_bom(top)}
    assert numbers == wanted | {new: "50"}
