# SPDX-License-Identifier: LGPL-2.1-or-later
"""The tests of the spec (bom-inertia, Tasks 1 and 2) as written there, with the package renamed."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import silo.inertia
from silo.inertia.bom import BOMEntry, BOMParser
from silo.inertia.calculator import MATERIAL_DENSITIES, InertiaCalculator
from silo.inertia.codes import MassCode
from silo.inertia.report import InertiaReport, PartWarning
from silo.inertia.types import InertialProperties


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


SPEC = Path(__file__).parents[2] / "../shared/spec/bom-inertia.md"


@pytest.mark.skipif(not SPEC.exists(), reason="the spec lies beside the checkout, not in it")
def test_the_tests_in_the_spec_pass(tmp_path: Path) -> None:
    """The spec's own text, taken out of its page: only the name of the package is another one."""
    blocks = re.findall(r"```python\n(.*?)```", SPEC.read_text("utf-8"), re.DOTALL)
    tests = [block.replace("onshape2xacro", "silo") for block in blocks if "import pytest" in block]
    assert len(tests) == 2
    (tmp_path / "fixtures").mkdir()
    shutil.copy(Path(__file__).parents[1] / "data" / "inertia" / "test_bom.csv", tmp_path / "fixtures")
    (tmp_path / "test_inertia").mkdir()
    for number, text in enumerate(tests):
        (tmp_path / "test_inertia" / f"test_task_{number}.py").write_text(text, "utf-8")
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(tmp_path)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    assert "6 passed" in done.stdout


def test_names_of_the_spec() -> None:
    """Each name stands in the module that the spec gives it."""
    assert MATERIAL_DENSITIES["ppa-cf"] == 1400
    assert MATERIAL_DENSITIES["default"] == 1000
    assert InertiaCalculator().default_density == 1000.0
    assert PartWarning("link", "part", "message").code == "note"
    assert InertialProperties(mass=0.0, com=(0, 0, 0), ixx=0, iyy=0, izz=0).ixy == 0.0


def test_summary_begins_with_the_spec_s_words() -> None:
    """Parts without a mass come first, each counted once; other warnings are not called missing masses."""
    report = InertiaReport()
    report.add_warning("link1", "part_a", "No mass or material")
    report.add_warning("link1", "part_b", "Part not found in BOM", MassCode.NOT_IN_BOM)
    report.add_warning("link1", "part_b", "no solid", MassCode.NO_VOLUME)
    report.add_warning("link2", "part_c", "Unknown material 'custom'", MassCode.UNKNOWN_MATERIAL)
    lines = report.get_summary().splitlines()
    assert lines[0] == "⚠️  3 parts with missing mass properties:"
    assert lines[2:4] == ["  link1:", "    - part_a: No mass or material"]

    report.add_warning("", "", "the file states no unit")
    report.add_warning("link1", "part_d", "rounded", MassCode.ROUNDED)
    lines = report.get_summary().splitlines()
    assert lines[0] == "⚠️  3 parts with missing mass properties:"
    assert lines[-7:] == [
        "2 other warnings:",
        "",
        "  whole assembly:",
        "    - the file states no unit",
        "",
        "  link1:",
        "    - part_d: rounded",
    ]

    alone = InertiaReport()
    alone.add_warning("link1", "part_d", "rounded", MassCode.ROUNDED)
    assert alone.get_summary().splitlines()[0] == "⚠️  1 warning:"
    assert InertiaReport().get_summary() == "No warnings - all parts have mass properties."


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
