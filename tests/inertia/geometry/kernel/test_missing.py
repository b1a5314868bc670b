# SPDX-License-Identifier: LGPL-2.1-or-later
"""A machine without the geometry kernel, or with one that cannot be used: one sentence, and what to do."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from silo.bom.errors import ConfigError
from silo.inertia.geometry import ReadOptions, read

STEP = Path(__file__).parents[4] / "examples" / "arm" / "arm.step"


@pytest.mark.parametrize(
    ("kernel", "words"),
    [
        ("raise ModuleNotFoundError(\"No module named 'OCP'\", name='OCP')", "which is not installed: pip"),
        ("raise ImportError('libGL.so.1: cannot open shared object file')", "apt-get install libgl1"),
        ("__version__ = '7.8.1'", "OCP 7.8.1 loses placements"),
    ],
)
def test_a_kernel_that_cannot_be_used(
    kernel: str, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the process that reads, whichever of its modules comes first."""
    (tmp_path / "OCP").mkdir()
    (tmp_path / "OCP" / "__init__.py").write_text(kernel, "utf-8")
    (tmp_path / "OCP" / "BRep.py").write_text("", "utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ConfigError, match=words):
        read(STEP, options=ReadOptions(cache=False))


def test_the_text_of_a_step_file_is_read_without_the_kernel() -> None:
    """So that another process can begin with it while this one loads the kernel."""
    code = "import sys, silo.inertia.geometry.step_text; sys.exit('OCP' in sys.modules)"
    assert not subprocess.run([sys.executable, "-c", code], env={"PYTHONPATH": ":".join(sys.path)}).returncode
