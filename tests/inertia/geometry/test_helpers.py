# SPDX-License-Identifier: LGPL-2.1-or-later
"""Other processes help with one reading: the same numbers to the last bit, and nothing depends on them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from fcstd_writer import Doc, Raw
from OCP.BRep import BRep_Builder
from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder, BRepPrimAPI_MakeTorus
from OCP.BRepTools import BRepTools
from OCP.TopoDS import TopoDS_Compound
from step_writer import StepDocument, emptied, trsf_of

from silo.inertia.assembly import Assembly
from silo.inertia.geometry import ReadOptions, read
from silo.inertia.geometry.fcstd import read_freecad
from silo.inertia.geometry.helpers import LEAST_MB, WORTH_HELP, Helpers, helpers_for
from silo.inertia.geometry.kernel.solids import measure_all
from silo.inertia.geometry.step import read_step
from silo.inertia.geometry.step_text import begin
from silo.inertia.notes import GeometryCode
from silo.platform.processes import processors

OPTIONS = ReadOptions(isolate=False, cache=False)


def quiet(*what: Any) -> None:
    """Nobody listens."""


@pytest.fixture(name="helpers")
def _helpers() -> Iterator[Helpers]:
    """One helper that is ready."""
    with Helpers(1, 4000) as helpers:
        assert helpers.start()
        helpers.load_kernel()
        helpers.begin(os.getpid)()  # waits until it is ready
        yield helpers


@pytest.fixture(name="nobody")
def _nobody() -> Iterator[Helpers]:
    """No helper: everything is done here."""
    with Helpers() as helpers:
        yield helpers


class Counting(Helpers):
    """Passes everything on, and counts what the helper was sent."""

    def __init__(self, other: Helpers) -> None:
        super().__init__()
        self.other, self.sent = other, 0

    def start(self) -> bool:
        """See :class:`Helpers`."""
        return self.other.start()

    def folder(self) -> Path:
        """See :class:`Helpers`."""
        return self.other.folder()

    def all(self, rows: Any, task: Any, done: Any) -> Any:
        """See :class:`Helpers`; here it waits until the helper has taken something."""
        taken = threading.Event()
        reader = threading.current_thread()

        def counted(row: Any) -> Any:
            if threading.current_thread() is not reader:
                self.sent += 1
                taken.set()
            elif len(rows) > 1:
                assert taken.wait(60)
            return task(row)

        return self.other.all(rows, counted, done)


def same(one: Assembly, other: Assembly) -> None:
    """Every number of both is the same, every word too."""
    assert list(one.prototypes) == list(other.prototypes)
    for a, b in zip(one.prototypes.values(), other.prototypes.values(), strict=True):
        assert a.volume_m3 == b.volume_m3
        assert a.com_m.tolist() == b.com_m.tolist()
        assert a.inertia_unit.tolist() == b.inertia_unit.tolist()
        assert (a.name, a.problems) == (b.name, b.problems)
        assert len(a.mesh or ()) == len(b.mesh or ())
    assert one.problems == other.problems
    assert [i.path for i in one.instances] == [i.path for i in other.instances]


def test_shapes_are_measured_to_the_same_numbers(helpers: Helpers, nobody: Helpers, box: Any) -> None:
    """Placed, mirrored, several in one product, a product without a solid."""
    builder, two = BRep_Builder(), TopoDS_Compound()
    builder.MakeCompound(two)
    builder.Add(two, BRepPrimAPI_MakeTorus(7, 2).Shape())
    builder.Add(two, box(1, 2, 3, (50, 0, 0)))
    products = [[two], [box(3, 2, 1), BRepPrimAPI_MakeCylinder(2, 9).Shape()], [], [box(5, 5, 5).Reversed()]]
    counting = Counting(helpers)
    alone = measure_all(products, options=OPTIONS, helpers=nobody, done=quiet)
    together = measure_all(products, options=OPTIONS, helpers=counting, done=quiet)
    assert counting.sent
    for one, other in zip(alone, together, strict=True):
        assert [s.volume_m3 for s in one.solids] == [s.volume_m3 for s in other.solids]
        assert [s.inertia_unit.tolist() for s in one.solids] == [
            s.inertia_unit.tolist() for s in other.solids
        ]
        assert one.problems == other.problems


def split_assembly(folder: Path, count: int) -> Path:
    """An assembly file without geometry, and its parts beside it."""
    document = StepDocument()
    top = document.assembly("top")
    for number in range(count):
        shape = BRepPrimAPI_MakeTorus(9 + number, 1 + number / 9).Shape()
        document.place(top, document.part(shape, f"p{number}"), trsf_of((number, 0, 0)), f"i{number}")
        part = StepDocument()
        part.part(shape, f"p{number}")
        part.write(folder / f"p{number}.step")
    return emptied(document.write(folder / "top.step"), *(f"p{n}" for n in range(count)))


def test_a_split_assembly_is_the_same_assembly(helpers: Helpers, nobody: Helpers, tmp_path: Path) -> None:
    """Files in the same order, whoever read them; a damaged one is reported as it is without help."""
    path = split_assembly(tmp_path, 5)
    counting = Counting(helpers)
    alone = read_step(path, OPTIONS, quiet, nobody)
    together = read_step(path, OPTIONS, quiet, counting)
    assert counting.sent
    same(alone.assembly, together.assembly)
    assert alone.others == together.others
    (tmp_path / "p2.step").write_bytes(b"ISO-10303-21;\nHEADER;")
    alone = read_step(path, OPTIONS, quiet, nobody)
    together = read_step(path, OPTIONS, quiet, Counting(helpers))
    assert [p.problems for p in together.assembly.prototypes.values()] == [
        p.problems for p in alone.assembly.prototypes.values()
    ]
    codes = [problem.code for part in together.assembly.prototypes.values() for problem in part.problems]
    assert codes == [GeometryCode.NOT_READ]


class Planned(Helpers):
    """Starts nothing, and keeps what was asked of it."""

    def __init__(self) -> None:
        super().__init__()
        self.asked: list[str] = []

    def start(self) -> bool:
        """See :class:`Helpers`."""
        self.asked.append("start")
        return True

    def load_kernel(self) -> None:
        """See :class:`Helpers`."""
        self.asked.append("load the kernel")


def test_helpers_of_a_split_assembly_start_before_the_kernel_is_loaded(tmp_path: Path) -> None:
    """Its text names the files; small ones, and those of parts that have geometry already, need no help."""

    def asked(path: Path, **options: Any) -> list[str]:
        with Planned() as planned:
            found = begin(path, replace(OPTIONS, **options), planned)()
        assert len(found.products.uses) == 2
        return planned.asked

    path = split_assembly(tmp_path, 2)
    assert asked(path) == []
    with (tmp_path / "p1.step").open("ab") as stream:
        stream.write(b" " * WORTH_HELP)
    assert asked(path) == ["start", "load the kernel"]
    assert asked(path, siblings=False) == []
    document = StepDocument()
    top = document.assembly("top")
    for name in ("p0", "p1"):
        document.place(top, document.part(BRepPrimAPI_MakeTorus(9, 1).Shape(), name))
    assert asked(document.write(tmp_path / "whole.step")) == []


def test_a_freecad_document_is_the_same_assembly(helpers: Helpers, nobody: Helpers, tmp_path: Path) -> None:
    """Shapes from the entries of its file; one of them is damaged."""
    doc = Doc("many")
    for number in range(5):
        stored = tmp_path / f"{number}.brp"
        assert BRepTools.Write_s(BRepPrimAPI_MakeTorus(9 + number, 2).Shape(), str(stored))
        doc.entries[f"Body{number}.brp"] = stored.read_bytes() if number != 3 else b"DBRep_DrawableShape"
        shape = Raw("Part::PropertyPartShape", f'<Part ElementMap="0.4" file="Body{number}.brp"/>')
        # Other materials make them other products.
        stuff = {"Name": f"Stuff {number}", "Density": f"{1000 + number} kg/m^3"}
        doc.add("App::MaterialObjectPython", f"Mat{number}", Material=stuff)
        material = Raw("App::PropertyLink", f'<Link value="Mat{number}"/>')
        doc.add("Part::Feature", f"Body{number}", Shape=shape, Material=material)
    path = doc.save(tmp_path / "many.FCStd")
    counting = Counting(helpers)
    alone = read_freecad(path, OPTIONS, quiet, nobody)
    together = read_freecad(path, OPTIONS, quiet, counting)
    assert counting.sent
    assert len(alone.assembly.prototypes) == 5
    same(alone.assembly, together.assembly)


def test_a_whole_reading_with_two_processes(tmp_path: Path) -> None:
    """Large enough that a helper looks through the text, and measures: the numbers of one process."""
    document = StepDocument()
    top = document.assembly("top")
    parts = [document.part(BRepPrimAPI_MakeTorus(9 + n, 1).Shape(), f"p{n}") for n in range(4)]
    for number in range(1100):
        document.place(top, parts[number % 4], trsf_of((number, 0, 0)), f"i{number}" + "x" * 2000)
    path = document.write(tmp_path / "large.step")
    assert path.stat().st_size > 2_000_000
    same(
        read(path, options=ReadOptions(cache=False, processes=1)),
        read(path, options=ReadOptions(cache=False, processes=2)),
    )


FAILING: list[Callable[[], Any]] = [lambda: int("no number"), lambda: os._exit(3), os.abort]


def failing(how: int, reader: int, row: int) -> int:
    """A task that only this process can do."""
    return row * 10 if os.getpid() == reader else FAILING[how]()


@pytest.mark.parametrize("how", range(len(FAILING)))
def test_what_a_helper_cannot_do_is_done_here(helpers: Helpers, how: int) -> None:
    """An error, or the end of the helper: all results are there, in order."""
    counting = Counting(helpers)
    found = counting.all(range(6), lambda row: (failing, (how, os.getpid(), row)), quiet)
    assert found == [0, 10, 20, 30, 40, 50]
    assert counting.sent
    assert helpers.begin(str, 7)() == "7"


def test_nobody_waits_for_a_helper_that_is_not_ready() -> None:
    """It would sleep for ten minutes first."""
    with Helpers(1, 4000) as helpers:
        helpers.start()
        helpers.begin(time.sleep, 600)
        found = helpers.all(range(3), lambda row: (str, (row,)), quiet)
    assert found == ["0", "1", "2"]


@pytest.mark.skipif(sys.platform != "linux", reason="memory is limited by other means, or not at all")
def test_a_helper_has_a_share_of_the_memory(helpers: Helpers) -> None:
    """So that all of them together keep to the limit of the reading."""
    import resource

    assert helpers.begin(resource.getrlimit, resource.RLIMIT_AS)()[0] == 4000 * 1024**2


def test_an_error_here_ends_everything(helpers: Helpers) -> None:
    """A cancelled reading does not continue."""

    def done(number: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), helpers:
        helpers.all(range(100), lambda row: (time.sleep, (row,)), done)


def test_what_the_kernel_says_in_a_helper_is_heard(
    helpers: Helpers, capfd: pytest.CaptureFixture[str]
) -> None:
    """It goes where this process's own complaints go."""
    helpers.begin(os.write, 1, b"*** ERR StepFile\n")()
    assert "ERR StepFile" in capfd.readouterr().out


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL")
def test_a_helper_ends_when_the_process_that_reads_is_killed() -> None:
    """Its input ends, and so does it."""
    code = """
import os, time
from silo.inertia.geometry.helpers import Helpers
helpers = Helpers(1, 4000)
helpers.start()
print(helpers.begin(os.getpid)(), flush=True)
time.sleep(600)
"""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, env=environment) as process:
        assert process.stdout is not None
        pid = int(process.stdout.readline())
        process.kill()
    for _ in range(500):
        state = Path(f"/proc/{pid}/stat")
        if not state.is_file() or state.read_text().rpartition(")")[2].split()[0] == "Z":
            return
        threading.Event().wait(0.02)
    os.kill(pid, signal.SIGKILL)
    raise AssertionError("the helper continues alone")


def test_how_many_help() -> None:
    """No more than there are processors or than the memory is for; the memory is shared."""
    assert helpers_for(1, 8192).count == 0
    assert helpers_for(3, 8192).count == 2
    assert helpers_for(3, LEAST_MB - 1).count == 0
    assert helpers_for(4, 2 * LEAST_MB).count == 2
    assert helpers_for(0, 100_000).count == min(processors() - 1, 7)
    assert helpers_for(100, 0).count == 7
    assert not helpers_for(1, 8192).start()
