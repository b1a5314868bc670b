# SPDX-License-Identifier: LGPL-2.1-or-later
"""The solids whose mass counts, by their volumes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from silo.fcstd import Library
from silo.inertia.geometry.fcstd import Entries, StoredFacts, Unpacked, measured_files
from silo.inertia.geometry.freecad import Leaf, Walk, assembled, one_by_one
from silo.inertia.geometry.measured import Measured
from silo.inertia.geometry.options import ReadOptions


def weighed(top: Path, written: Callable[[float], str]) -> Counter[str]:
    """Volume, as ``written`` writes mm³, → solids, of all pieces whose mass counts."""
    entries = Entries()
    solids: list[list[str]] = []
    options = ReadOptions(eps=1e-6, mesh_check=False)
    with Library() as library, TemporaryDirectory() as folder:
        document = library.open(top)
        walk = Walk(StoredFacts(entries))
        shapes = Unpacked(entries, Path(folder))

        def measure(leaf: Leaf) -> Measured:
            found = measured_files(shapes.files(leaf), options.eps, options.mesh_check)
            assert isinstance(found, Measured), found
            solids.append([written(one.volume_m3 * 1e9) for one in found.solids])
            return found

        quiet = lambda _stage, _number, _total: None  # noqa: E731
        whole = assembled(walk, walk.top(document, None), str(top), options, one_by_one(measure), quiet)
    entries.close()
    of = dict(zip(dict.fromkeys(one.prototype for one in whole.instances), solids, strict=True))
    return Counter(volume for one in whole.instances for volume in of[one.prototype])
