# SPDX-License-Identifier: LGPL-2.1-or-later
"""The public assemblies with ground truth, which lie beside the repository and are never part of it."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from freecad_cases.machines import REPOSITORY

FOLDER = REPOSITORY.parent / "shared" / "data" / "assemblies"


@dataclass(frozen=True)
class PublicAssembly:
    """One assembly of a public project, with the instance counts that FreeCAD 1.0 was asked for."""

    name: str
    project: Path
    top: Path
    counts: dict[tuple[str, str], int]
    missing: frozenset[str]


def public_assemblies() -> list[PublicAssembly]:
    """All of them; none where the data is not there."""
    found = []
    for file in sorted(FOLDER.glob("*/truth/*.json")):
        told = json.loads(file.read_text(encoding="utf-8"))
        project = file.parents[1]
        counts: Counter[tuple[str, str]] = Counter()
        for root in told["roots"]:
            # An Assembly4 "Parts" group beside the model holds spares and is no root of the BOM.
            if root["name"] != "Parts":
                for one in root["instance_counts"]:
                    counts[one["file"], one["object"]] += one["external"]
        found.append(
            PublicAssembly(
                file.name.removesuffix(".fc100.json"),
                project.resolve(),
                project.resolve() / told["top"],
                {key: count for key, count in counts.items() if count},
                frozenset(told["missing_files"]),
            )
        )
    return found
