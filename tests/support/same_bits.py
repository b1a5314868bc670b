# SPDX-License-Identifier: LGPL-2.1-or-later
"""One process and many give the same bits: ``python same_bits.py 2000 20 [SEED]``.

Every product is measured here once, then in so many rounds by this process and the others together. A
process that crashes shows, though its work is done again. Run it with ``MALLOC_PERTURB_=165`` (glibc), with
``PYTHONMALLOC=malloc`` so that Python's own objects are poisoned as well, and with the folders ``mods`` and
``tests/support`` on ``PYTHONPATH``.
"""

from __future__ import annotations

import gc
import hashlib
import os
import random
import sys
from collections.abc import Sequence
from typing import Any

from OCP.BRep import BRep_Builder
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeBox,
    BRepPrimAPI_MakeCone,
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakeSphere,
    BRepPrimAPI_MakeTorus,
)
from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS_Compound

from silo.inertia.geometry import kernel as occt
from silo.inertia.geometry.helpers import Helpers
from silo.inertia.geometry.kernel.solids import measure_all
from silo.inertia.geometry.measured import Measured
from silo.inertia.geometry.options import ReadOptions

OPTIONS = ReadOptions(isolate=False, cache=False)


def products(count: int, dice: random.Random) -> list[list[Any]]:
    """So many products of up to five bodies each, in compounds or beside each other."""
    return [[shape(dice, 2) for _ in range(dice.randrange(4))] for _ in range(count)]


def shape(dice: random.Random, depth: int) -> Any:
    """A solid, its shell, one of its faces or a compound of such shapes, anywhere and either way round."""
    if depth and dice.random() < 0.3:
        builder, whole = BRep_Builder(), TopoDS_Compound()
        builder.MakeCompound(whole)
        for _ in range(dice.randrange(4)):
            builder.Add(whole, shape(dice, depth - 1))
        return whole
    a, b, c = (dice.uniform(1, 9) for _ in range(3))
    made = dice.choice(
        (
            lambda: BRepPrimAPI_MakeBox(a, b, c),
            lambda: BRepPrimAPI_MakeCylinder(a, b),
            lambda: BRepPrimAPI_MakeTorus(a + b, a),
            lambda: BRepPrimAPI_MakeSphere(a),
            lambda: BRepPrimAPI_MakeCone(a, a + b, c),
        )
    )()
    found = made.Shape()
    if (kind := dice.random()) < 0.2:
        faces, shells = occt.faces_of(found), list(occt.inside(found))
        found = dice.choice(faces if kind < 0.1 else shells)
    turn, step = gp_Trsf(), gp_Trsf()
    turn.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(a, b, c)), dice.uniform(0, 6))
    step.SetTranslation(gp_Vec(*(dice.uniform(-30, 30) for _ in range(3))))
    found = found.Located(TopLoc_Location(turn.Multiplied(step)))
    return found.Reversed() if dice.random() < 0.2 else found


def bits(found: Measured) -> str:
    """Everything that was measured, down to the last bit."""
    solids = [(s.volume_m3, s.com_m.tobytes(), s.inertia_unit.tobytes(), s.reversed) for s in found.solids]
    mesh = (found.mesh.vertices.tobytes(), found.mesh.faces.tobytes()) if found.mesh is not None else ()
    words = repr((solids, found.problems, mesh, found.has_faces, found.has_wires))
    return hashlib.sha256(words.encode()).hexdigest()


def main(arguments: Sequence[str]) -> str:
    """The verdict: "" if every round gave the same bits and no process was lost."""
    count, rounds, seed = [int(text) for text in arguments] + [7] * (3 - len(arguments))
    occt.quiet()
    made = products(count, random.Random(seed))
    with Helpers() as nobody:
        alone = [bits(one) for one in measure_all(made, options=OPTIONS, helpers=nobody, done=print_nothing)]
    print(f"{count} products, {len(set(alone))} different, seed {seed}", flush=True)
    with Helpers(max((os.cpu_count() or 1) - 1, 1), 4000) as helpers:
        helpers.start()
        helpers.load_kernel()
        helpers.begin(gc.set_threshold, 50)()
        for number in range(1, rounds + 1):
            together = measure_all(made, options=OPTIONS, helpers=helpers, done=print_nothing)
            wrong = [n for n, one in enumerate(together) if bits(one) != alone[n]]
            lost = sum(one.one(os.getpid, ()).result() is None for one in helpers._running)
            print(f"round {number} of {rounds}: {len(wrong)} differ, {lost} processes lost", flush=True)
            if wrong or lost:
                return f"round {number}: products {wrong[:10]} differ, {lost} processes lost"
            gc.collect()
    return ""


def print_nothing(done: int, total: int) -> None:
    """Nobody listens."""


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]) or 0)
