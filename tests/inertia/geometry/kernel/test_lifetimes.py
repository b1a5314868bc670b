# SPDX-License-Identifier: LGPL-2.1-or-later
"""Nothing of the kernel is read while only a temporary owns it: the rule, and a run with poisoned memory.

Also which errors of the kernel are suppressed.
"""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import same_bits
from OCP.Standard import Standard_ConstructionError
from OCP.StdFail import StdFail_NotDone

from silo.inertia.geometry import kernel as occt

SAME = os.environ.get("SILO_SAME", "30 2").split()
"""Products and rounds; the long run is ``SILO_SAME="2000 20"``."""

MODS = Path(__file__).parents[4] / "mods"
READS_LATER = re.compile(r"Iterator|Explorer|Adaptor|Domain|Analy|Classifier|_Face\b")
"""Classes of the kernel that look into what they are given after they were made."""

KEEPS_NOTHING = re.compile(r"BRepGProp_Vinert|_s\Z")
"""Done with its arguments when it returns; arguments live as long as the call."""


def temporaries(source: str) -> Iterator[str]:
    """Each call in ``source`` that has a class of the kernel read what nobody else holds."""
    tree = ast.parse(source)
    kernel = {
        name.asname or name.name
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "OCP"
        for name in node.names
    }
    inner = {
        id(argument)
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and KEEPS_NOTHING.search(ast.unparse(node.func))
        for argument in node.args
    }
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call) or id(node) in inner:
            continue
        name = node.func.id if isinstance(node.func, ast.Name) else ""
        begins = isinstance(node.func, ast.Attribute) and node.func.attr.startswith(("Init", "Load"))
        reads = (name in kernel and READS_LATER.search(name)) or begins
        if reads and any(isinstance(part, ast.Call) for argument in node.args for part in ast.walk(argument)):
            yield f"line {node.lineno}: {ast.unparse(node)}"


def test_no_temporary_is_read_after_it_is_gone() -> None:
    """All modules that import the kernel; a shape is given a name before something iterates over it."""
    using = [path for path in MODS.rglob("*.py") if "from OCP." in path.read_text("utf-8")]
    assert len(using) > 3
    found = [f"{path.name}, {words}" for path in using for words in temporaries(path.read_text("utf-8"))]
    assert not found, "give it a name first: " + "; ".join(found)


@pytest.mark.parametrize(
    "line",
    [
        "TopoDS_Iterator(load(path), True, True)",
        "TopExp_Explorer(one.Shape(), TopAbs_FACE)",
        "iterator.Initialize(one.Shape())",
        "BRepAdaptor_Curve(TopoDS.Edge(edge))",
        "TopoDS_Iterator(shapes()[0])",
    ],
)
def test_the_rule_finds_them(line: str) -> None:
    """Each way of reading a temporary that was ever written here, and its brothers."""
    head = "from OCP.TopExp import TopExp_Explorer\nfrom OCP.TopoDS import TopoDS_Iterator\n"
    assert list(temporaries(f"{head}from OCP.BRepAdaptor import BRepAdaptor_Curve\n{line}\n"))


@pytest.mark.parametrize("error", [StdFail_NotDone, Standard_ConstructionError, ZeroDivisionError])
def test_errors_of_the_kernel_are_suppressed_whatever_their_class(error: type[Exception]) -> None:
    """None of them is a Standard_Failure in Python."""
    with occt.Attempt():
        raise error("of the kernel")


@pytest.mark.parametrize("error", [TypeError, MemoryError, KeyboardInterrupt])
def test_other_errors_are_not_suppressed(error: type[BaseException]) -> None:
    """A mistake of ours, a limit, a person."""
    with pytest.raises(error), occt.Attempt():
        raise error("not of the kernel")


def test_no_module_trusts_a_base_class_of_the_kernels_errors() -> None:
    """``except Standard_Failure`` suppresses that class alone."""
    assert not [path for path in MODS.rglob("*.py") if "import Standard_Failure" in path.read_text("utf-8")]


def test_one_process_and_many_give_the_same_bits() -> None:
    """Freed memory is poisoned in all of them (glibc; nothing else knows the variable)."""
    poison = {"MALLOC_PERTURB_": "165", "PYTHONMALLOC": "malloc"}
    paths = os.pathsep.join(path for path in sys.path if path)
    done = subprocess.run(
        [sys.executable, same_bits.__file__, *SAME],
        env={**os.environ, **poison, "PYTHONPATH": paths},
        capture_output=True,
        text=True,
    )
    assert not done.returncode, done.stdout + done.stderr
    assert f"round {SAME[1]} of {SAME[1]}: 0 differ, 0 processes lost" in done.stdout
