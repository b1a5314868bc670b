# SPDX-License-Identifier: LGPL-2.1-or-later
"""Hand-made assemblies of closed-form bodies, and BOMs from text."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bodies import placement

from silo.inertia.assembly import Assembly, Instance, Prototype
from silo.inertia.bom.parser import BOMParser
from silo.inertia.bom.table import BomTable
from silo.inertia.calculation import calculate
from silo.inertia.calculator import read_geometry
from silo.inertia.materials.table import load_materials
from silo.inertia.report import InertiaReport
from silo.inertia.task import Task

try:
    import OCP.BRep  # noqa: F401
except ImportError as error:
    if os.environ.get("SILO_REQUIRE_KERNEL"):
        raise
    NO_KERNEL = f"the geometry kernel cannot be loaded: {error}"
    collect_ignore = ["geometry", "cases"]
else:
    NO_KERNEL = ""

NEED_KERNEL = ("cli", "test_calculator.py", "test_docs.py", "test_python_objects.py", "test_real_files.py")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Without the kernel what reads geometry is skipped, loudly."""
    here = Path(__file__).parent
    for item in items if NO_KERNEL else ():
        if any(item.path.is_relative_to(here / name) for name in NEED_KERNEL):
            item.add_marker(pytest.mark.skip(reason=NO_KERNEL))


@pytest.fixture(name="geometry_cache", scope="session")
def _geometry_cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What one test has read is kept for the others, also for those in other processes."""
    folder = tmp_path_factory.getbasetemp()
    return (folder.parent if "PYTEST_XDIST_WORKER" in os.environ else folder) / "geometry-cache"


@pytest.fixture(autouse=True)
def _children_are_warm(warm: None, geometry_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What reads in a child does not load the kernel anew, with ``cold`` it does; nothing is read twice."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(geometry_cache))


@pytest.fixture(name="cold")
def _cold(warm: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """Children start as users have them."""
    monkeypatch.delenv("SILO_WARM_READER", raising=False)


STEP_FILES = Path(__file__).parents[2] / "../shared/data/step"


@pytest.fixture(name="step_files", scope="session")
def _step_files() -> Path:
    """The public STEP files; without them the test is skipped, loudly."""
    if not STEP_FILES.is_dir():
        pytest.skip(f"the STEP test data is not at {STEP_FILES}")
    return STEP_FILES.resolve()


@pytest.fixture(name="real", scope="session")
def _real(step_files: Path) -> Callable[[str], Assembly]:
    """``real(name)``: a public STEP file, read once."""
    return cache(lambda name: read_geometry(step_files / name))


@pytest.fixture(name="materials", scope="session")
def _materials() -> Any:
    """The package's table alone: an installed FreeCAD must not decide a test."""
    return load_materials(freecad=False)


@pytest.fixture(name="assemble")
def _assemble() -> Callable[..., Assembly]:
    """``assemble(("link/part", prototype[, transform[, products]]), …)`` → an assembly."""

    def assemble(*placed: Sequence[Any], name: str = "asm", **more: Any) -> Assembly:
        prototypes: dict[str, Prototype] = {}
        instances = []
        for path, prototype, *rest in placed:
            prototypes[prototype.key] = prototype
            names = tuple(path.split("/"))
            transform = rest[0] if rest and rest[0] is not None else np.eye(4)
            products = tuple(rest[1].split("/")) if len(rest) > 1 else (*names[:-1], prototype.name)
            instances.append(Instance(names, products, prototype.key, transform))
        return Assembly(name, prototypes, tuple(instances), **more)

    return assemble


@pytest.fixture(name="bom")
def _bom() -> Callable[..., BomTable]:
    """A BOM from CSV text."""

    def bom(text: str, **options: Any) -> BomTable:
        return BOMParser(**options).parse_bytes(text.encode("utf-8"), "bom.csv")

    return bom


@pytest.fixture(name="compute")
def _compute(materials: Any, bom: Callable[..., BomTable]) -> Callable[..., InertiaReport]:
    """``compute(assembly, csv_text | table | None, **task)``."""

    def compute(assembly: Assembly, table: BomTable | str | None = None, **task: Any) -> InertiaReport:
        if isinstance(table, str):
            table = bom(table)
        return calculate(assembly, table, Task(materials=materials, **task))

    return compute


@pytest.fixture(name="codes")
def _codes() -> Callable[..., list[str]]:
    """Warning codes of a report, for one part or for all."""

    def codes(report: InertiaReport, part: str | None = None) -> list[str]:
        return [str(w.code) for w in report.warnings if part is None or w.part_name == part]

    return codes


@pytest.fixture(name="part")
def _part() -> Callable[..., Any]:
    """The only part result with a name."""

    def part(report: InertiaReport, name: str) -> Any:
        (found,) = [p for _, p in report.parts() if p.name == name]
        return found

    return part


@pytest.fixture(name="at")
def _at() -> Callable[..., Any]:
    """``at(x, y, z)``: a placement."""
    return lambda *xyz, turn=None: placement(xyz, turn)
