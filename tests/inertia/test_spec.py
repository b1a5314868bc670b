# SPDX-License-Identifier: LGPL-2.1-or-later
"""The tests of the spec (bom-inertia, Tasks 1 and 2) as written there, imports aside."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import silo.inertia
from silo.inertia import BOMEntry, BOMParser, InertiaReport


@pytest.fixture
def bom_csv() -> Path:
    return Path(__file__).parents[1] / "data" / "inertia" / "test_bom.csv"


def test_parse_bom(bom_csv: Path) -> None:
    """Spec, Task 1."""
    parser = BOMParser()
    entries = parser.parse(bom_csv)

    assert len(entries) == 4

    # Part with mass
    assert entries["part_with_mass"].mass_kg == pytest.approx(0.3)
    assert entries["part_with_mass"].material is None

    # Part with material but no mass
    assert entries["part_with_material"].mass_kg is None
    assert entries["part_with_material"].material == "ppa-cf"

    # Part without either
    assert entries["part_without_either"].mass_kg is None
    assert entries["part_without_either"].material is None

    # Part with empty mass field
    assert entries["part_empty_mass"].mass_kg is None
    assert entries["part_empty_mass"].material == "aluminum"


def test_bom_entry_has_mass() -> None:
    """Spec, Task 1."""
    entry = BOMEntry(name="test", material=None, mass_kg=1.0)
    assert entry.has_mass is True
    assert entry.has_material is False


def test_bom_entry_has_material() -> None:
    """Spec, Task 1."""
    entry = BOMEntry(name="test", material="steel", mass_kg=None)
    assert entry.has_mass is False
    assert entry.has_material is True


def test_report_add_warning() -> None:
    """Spec, Task 2."""
    report = InertiaReport()
    report.add_warning("link1", "part_a", "No mass or material assigned")

    assert len(report.warnings) == 1
    assert report.warnings[0].link_name == "link1"
    assert report.warnings[0].part_name == "part_a"


def test_report_summary() -> None:
    """Spec, Task 2."""
    report = InertiaReport()
    report.add_warning("link1", "part_a", "No mass or material")
    report.add_warning("link1", "part_b", "No mass or material")
    report.add_warning("link2", "part_c", "Unknown material 'custom'")

    summary = report.get_summary()
    assert "3 warnings" in summary.lower() or "3 parts" in summary.lower()


def test_report_no_warnings() -> None:
    """Spec, Task 2."""
    report = InertiaReport()
    summary = report.get_summary()
    assert "no warnings" in summary.lower() or summary == ""


def test_print_summary_goes_to_the_log(caplog: pytest.LogCaptureFixture) -> None:
    """Warnings are logged as such, their absence as information."""
    report = InertiaReport()
    with caplog.at_level("INFO"):
        report.print_summary()
        report.add_warning("arm", "bolt", "Part not found in BOM")
        report.print_summary()
    assert [record.levelname for record in caplog.records] == ["INFO", "WARNING"]
    assert "bolt: Part not found in BOM" in caplog.text


def test_public_names() -> None:
    """Every name of the public surface is importable from silo.inertia, and listed."""
    for name in silo.inertia.__all__:
        value = getattr(silo.inertia, name)
        also = {"EnhancedInertiaCalculator": "InertiaCalculator", "MATERIAL_DENSITIES": ""}
        assert getattr(value, "__name__", "") == also.get(name, name)
        assert name in dir(silo.inertia)
    with pytest.raises(AttributeError, match="Nonsense"):
        _ = silo.inertia.Nonsense


def test_import_is_light() -> None:
    """``import silo.inertia`` loads neither numpy nor the CAD kernel, nor does reading a BOM."""
    code = (
        "import sys, silo.inertia; from silo.inertia import BOMParser, InertiaReport; BOMParser(); "
        "heavy = {'numpy', 'OCP', 'trimesh', 'rich', 'yaml'} & sys.modules.keys(); "
        "sys.exit(str(heavy) if heavy else 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_the_readers_load_without_the_kernel() -> None:
    """FreeCAD has no OCP: the add-on imports the package of the readers there."""
    code = "import sys; sys.modules['OCP'] = None; import silo.inertia.geometry.freecad"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
