# SPDX-License-Identifier: LGPL-2.1-or-later
"""One plan for a folder: the BOMs are those of each file synced alone, whoever reads and whatever dies."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any

import pytest
from fcstd_writer import Doc, locals_, part
from hunting import examples
from hypothesis import given, settings
from hypothesis import strategies as st

from silo.batch import SyncOptions, TopResult
from silo.bom.errors import AuthError, SiloError, UnreachableError
from silo.bom.walk.links import extract
from silo.bom.walk.roots import choose_assembly
from silo.bom_sync.resolved import resolve
from silo.bom_sync.steps import Status, sync_tree
from silo.fcstd import Library
from silo.files import documents_in
from silo.testing import FakeSilo
from silo.vault.index import Index
from silo.vault.job import SyncJob
from silo.vault.plan import make_plan
from silo.vault.pool import Pool, pool_of
from silo.vault.questions import Question, work
from silo.vault.reading import VaultReader


def write(folder: Path, silo: FakeSilo | None, assemblies: dict[int, dict[int, int]], parts: int = 4) -> None:
    """Parts 0…, and assemblies 100… that hold parts and assemblies of these numbers."""

    def identity(category: str, name: str) -> str | None:
        return None if silo is None else silo.create_item("kindred-rd", category, name).id

    for number in range(parts):
        part(f"p{number}", uuid=identity("M01", f"p{number}")).save(folder / f"parts/p{number}.FCStd")
    for number, holds in assemblies.items():
        doc = Doc(f"a{number}", meta={"SiloUUID": identity("A01", f"a{number}") or ""})
        for place, (child, count) in enumerate(holds.items()):
            file = f"../asm/a{child}.FCStd" if child >= 100 else f"../parts/p{child}.FCStd"
            doc.link(f"L{place}", file, "Assembly" if child >= 100 else "Box", ElementCount=count)
        names = [f"L{place}" for place in range(len(holds))]
        doc.add("Assembly::AssemblyObject", "Assembly", Group=locals_(*names))
        doc.save(folder / f"asm/a{number}.FCStd")


def run(
    folder: Path, api: Any, *, pool: Pool | None = None, index: Path | None = None, **options: Any
) -> list[TopResult]:
    """The job, as the command line runs it."""
    tops = documents_in([str(folder)])
    with Index(index) as memory:
        reading = VaultReader(memory, pool)
        plan = make_plan(tops, reading)
        return list(
            SyncJob(plan, reading, api, SyncOptions(recursive=True, **options), str(folder)).results()
        )


def boms(silo: FakeSilo) -> dict[str, dict[str, float | None]]:
    """Every BOM of the server: name → name → quantity."""
    names = {
        number.upper(): stored.item.name or stored.item.description for number, stored in silo.items.items()
    }
    return {
        names[number.upper()]: {
            names[line.child_part_number.upper()]: line.quantity for line in silo.get_bom(number)
        }
        for number in silo.items
    }


@st.composite
def vaults(draw: st.DrawFn) -> dict[int, dict[int, int]]:
    """Assemblies without rings."""
    count = draw(st.integers(1, 6))
    return {
        100 + number: draw(
            st.dictionaries(
                st.sampled_from([*range(5), *range(100, 100 + number)]), st.integers(1, 9), max_size=4
            )
        )
        for number in range(count)
    }


@settings(max_examples=examples(10))
@given(vaults())
def test_the_boms_are_those_of_each_file_alone(
    tmp_path_factory: pytest.TempPathFactory, holds: dict[int, dict[int, int]]
) -> None:
    """Part 4 is missing: what uses it is blocked. Each assembly has one result, children first."""
    folder = tmp_path_factory.mktemp("vault")
    ours, theirs = FakeSilo(), FakeSilo()
    write(folder, ours, holds)
    for stored in ours.items.values():
        theirs.items[stored.item.part_number.casefold()] = type(stored)(item=stored.item)
    results = run(folder, ours)
    for top in documents_in([str(folder)]):
        with Library() as library:
            found = extract(choose_assembly(library.open(top)))
        if found.entries or found.blocked:
            list(sync_tree(resolve(found, theirs), theirs, sync_id=lambda: os.urandom(8).hex()))
    assert boms(ours) == boms(theirs)
    seen: list[str] = []
    for result in results:
        for outcome in result.outcomes:
            below = [entry.doc_path for entry in outcome.resolved.entries if entry.is_assembly]
            assert all(path in seen for path in below if holds.get(int(Path(path).stem[1:])))
            seen.append(outcome.assembly.doc_path)
    assert len(seen) == len(set(seen))
    assert all(one.status is Status.UNCHANGED for r in run(folder, ours) for one in r.outcomes if r.fine)


def test_assemblies_that_contain_each_other_are_left_alone(tmp_path: Path) -> None:
    """With what lies above them; the others are synced."""
    silo = FakeSilo()
    write(tmp_path, silo, {100: {101: 1, 0: 2}, 101: {100: 1}, 102: {101: 1}, 103: {0: 5}})
    results = {Path(r.top).stem: r.outcomes[0].status for r in run(tmp_path, silo, allow_missing=True)}
    assert results == {
        **dict.fromkeys(["a100", "a101", "a102"], Status.BLOCKED),
        "a103": Status.MERGED,
    }


def test_two_files_that_claim_to_be_one_item(tmp_path: Path) -> None:
    """A copy changes nothing; where one of them was edited, neither is taken for the truth."""
    silo = FakeSilo()
    write(tmp_path, silo, {100: {0: 2}, 101: {1: 1}})
    original, copy = tmp_path / "asm/a100.FCStd", tmp_path / "asm/copy.FCStd"
    copy.write_bytes(original.read_bytes())
    assert [r.outcomes[0].status for r in run(tmp_path, silo)].count(Status.MERGED) == 2
    uuid = next(s.item.id for s in silo.items.values() if s.item.description == "a100")
    doc = Doc("a100", meta={"SiloUUID": uuid}).link("L0", "../parts/p0.FCStd", "Box", ElementCount=7)
    doc.add("Assembly::AssemblyObject", "Assembly", Group=locals_("L0")).save(copy)
    results = {Path(r.top).stem: r for r in run(tmp_path, silo)}
    assert results["a100"].outcomes[0].status is results["copy"].outcomes[0].status is Status.BLOCKED
    assert "copy.FCStd" in results["a100"].findings[0].message
    assert boms(silo)["a100"] == {"p0": 2}


class Counting:
    """A server that counts questions."""

    def __init__(self, silo: FakeSilo) -> None:
        self._silo = silo
        self.calls: list[str] = []

    def __getattr__(self, name: str) -> Any:
        if name in ("get_boms", "get_bom", "merge_bom", "get_items_by_uuid", "get_item_by_uuid"):
            self.calls.append(name)
        return getattr(self._silo, name)


def test_requests_depend_on_identities_and_changes(tmp_path: Path) -> None:
    """Not on the number of assemblies: one for the identities, one for each layer's BOMs, one per change."""
    silo = FakeSilo()
    write(
        tmp_path,
        silo,
        {100 + n: {n % 4: n + 1, **({100 + n // 3: 1} if n % 3 else {})} for n in range(30)} | {100: {0: 1}},
    )
    first, second = Counting(silo), Counting(silo)
    run(tmp_path, first)
    run(tmp_path, second)
    assert first.calls.count("merge_bom") == 30
    assert len(first.calls) - 30 < 10
    assert "merge_bom" not in second.calls
    assert len(second.calls) < 10


@pytest.mark.parametrize("error", [AuthError("no"), UnreachableError("gone")])
def test_a_server_that_went_away_is_asked_once_more_at_most_for_each_sender(
    tmp_path: Path, error: SiloError
) -> None:
    """The others have the same error; nothing is sent after it, and the next run continues."""
    silo = FakeSilo()
    write(tmp_path, silo, {100 + n: {0: n + 1} for n in range(20)})
    asked = []

    def refuse(name: str) -> None:
        if name in ("merge_bom", "ready"):
            asked.append(name)
            if len(asked) > 3:
                raise error

    silo.before = refuse
    results = run(tmp_path, silo)
    assert asked.count("merge_bom") <= 3 + 4
    assert all(outcome.error in (None, error) for r in results for outcome in r.outcomes)
    assert sum(r.fine for r in results) == 3
    silo.before = lambda _name: None
    assert all(r.fine for r in run(tmp_path, silo))
    assert len(boms(silo)) == 24


def test_a_file_that_changes_while_the_job_runs_is_left_for_the_next(tmp_path: Path) -> None:
    """What would be sent is not what the file says now."""
    silo = FakeSilo()
    write(tmp_path, silo, {100: {0: 2}})
    silo.before = lambda name: write(tmp_path, None, {100: {0: 3}}) if name == "get_boms" else None
    (result,) = run(tmp_path, silo)
    assert "changed while the job ran" in str(result.outcomes[0].error)
    assert boms(silo)["a100"] == {}


# --- workers --------------------------------------------------------------------------------------------


class Dying(Executor):
    """Loses its worker at the first tasks; nothing of them comes back."""

    deaths = 0

    def submit(self, work: Any, /, *args: Any, **options: Any) -> Future[Any]:
        future: Future[Any] = Future()
        Dying.deaths += 1
        if Dying.deaths < 4:
            future.set_exception(BrokenProcessPool("killed"))
        else:
            future.set_result(work(*args))
        return future


def answers(folder: Path, pool: Pool | None) -> list[str]:
    """All answers as text, asked for without an index."""
    with Index(None) as memory:
        tops = documents_in([str(folder)])
        return [one.known.answer for one in VaultReader(memory, pool).ask_many(Question(top) for top in tops)]


def test_a_worker_that_dies_costs_its_task_only(tmp_path: Path) -> None:
    """It is asked again; the answers and their order are the same."""
    write(tmp_path, FakeSilo(), {100 + n: {n % 4: n + 1} for n in range(20)})
    Dying.deaths = 0
    assert answers(tmp_path, Pool(Dying, 2, worth=0, chunk=4)) == answers(tmp_path, None)
    assert Dying.deaths > 4


class Broken(Executor):
    """Takes one task and loses its workers; then it refuses all others, as a pool of processes does."""

    made = 0

    def __init__(self) -> None:
        Broken.made += 1
        self.tasks = 0

    def submit(self, work: Any, /, *args: Any, **options: Any) -> Future[Any]:
        self.tasks += 1
        if self.tasks > 1 and Broken.made == 1:
            raise BrokenProcessPool("killed")
        future: Future[Any] = Future()
        future.set_result(work(*args))
        return future


def test_a_pool_that_broke_between_two_tasks_is_made_anew(tmp_path: Path) -> None:
    """A pool of processes notices a death only when the next task is given."""
    write(tmp_path, FakeSilo(), {100 + n: {n % 4: n + 1} for n in range(20)})
    Broken.made = 0
    assert answers(tmp_path, Pool(Broken, 2, worth=0, chunk=4)) == answers(tmp_path, None)
    assert Broken.made > 1


def _kill_some(questions: Any, supplies: Any, run: str) -> Any:
    if any("a107" in question.path for question in questions):
        os.kill(os.getpid(), signal.SIGKILL)
    return work(questions, supplies, run)


class Killing(ProcessPoolExecutor):
    """Its workers die of one file."""

    def submit(self, work: Any, /, *args: Any, **options: Any) -> Future[Any]:
        return super().submit(_kill_some, *args)


def test_a_file_that_kills_every_reader_is_named_and_the_others_are_read(tmp_path: Path) -> None:
    """Real processes, really killed."""
    write(tmp_path, FakeSilo(), {100 + n: {n % 4: n + 1} for n in range(12)})
    wanted = answers(tmp_path, None)
    found = answers(tmp_path, Pool(lambda: Killing(2), 2, alone=lambda: Killing(1), worth=0, chunk=8))
    different = [text for text, other in zip(found, wanted, strict=True) if text != other]
    assert len(different) == 1
    assert "a107.FCStd" in different[0]
    assert "the process that read it died" in different[0]


def test_processes_give_the_same_answers(tmp_path: Path) -> None:
    """To the byte and in order; and each file is read once, whoever needs it."""
    write(tmp_path, FakeSilo(), {100 + n: {n % 4: n + 1} for n in range(12)})
    tops = documents_in([str(tmp_path)])
    for jobs in (2, 1):
        with pool_of(jobs, worth=0) as pool, Index(None) as memory:
            if pool is not None:
                pool.chunk = 3
            reading = VaultReader(memory, pool)
            found = [one.known.answer for one in reading.ask_many(Question(top) for top in tops)]
        assert found == answers(tmp_path, None)
        assert reading.reads == len(tops)


def test_a_dask_cluster_gives_the_same_answers(tmp_path: Path) -> None:
    """Through the same executor's interface."""
    distributed = pytest.importorskip("dask.distributed", reason="the extra 'dask' is not installed")
    write(tmp_path, FakeSilo(), {100 + n: {n % 4: n + 1} for n in range(12)})
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None
        ) as cluster,
        pool_of(1, cluster.scheduler_address, worth=0) as pool,
    ):
        assert pool is not None
        for _ in range(2):
            assert answers(tmp_path, pool) == answers(tmp_path, None)
            pool.renew()  # as after a lost worker


@pytest.mark.parametrize("uuid", ["assembly", None])
def test_parts_in_the_file_of_an_assembly_are_its_bom_where_it_is_registered(
    tmp_path: Path, uuid: str | None
) -> None:
    """Without an identity such a file is a library, from which others take parts."""
    doc = Doc("own", meta={} if uuid is None else {"SiloUUID": uuid})
    doc.add("Part::Box", "One", SiloItemId="one").add("Part::Box", "Two", SiloItemId="two")
    doc.add("Assembly::AssemblyObject", "Assembly", Group=locals_("One", "Two")).save(tmp_path / "own.FCStd")
    with Index(None) as memory:
        plan = make_plan(documents_in([str(tmp_path)]), VaultReader(memory))
    assert (len(plan.nodes), plan.parts) == ((1, 0) if uuid else (0, 1))


def test_a_worker_starts_without_the_network() -> None:
    """Each worker imports what it needs again; HTTP and TLS would be a tenth of it."""
    code = (
        "import sys, silo.vault.reading as _; print([n for n in ('http.client', 'ssl') if n in sys.modules])"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, check=True).stdout == b"[]\n"


def test_progress_counts_what_is_read(tmp_path: Path) -> None:
    """Not what is asked for: when the last file is announced, it has been read."""
    write(tmp_path, None, {0: {0: 1, 1: 1}})
    tops = documents_in([str(tmp_path)])
    seen: list[str] = []

    def progress(path: str) -> None:
        seen.append(path)
        if len(seen) == len(tops):
            for top in tops:
                Path(top).write_bytes(b"")

    with Index(None) as memory:
        plan = make_plan(tops, VaultReader(memory), progress=progress)
    assert (sorted(seen), plan.errors) == (sorted(tops), {})
