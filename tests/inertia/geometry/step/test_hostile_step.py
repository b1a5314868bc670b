# SPDX-License-Identifier: LGPL-2.1-or-later
"""STEP files that mean harm, or that came to harm: one sentence, in bounded time, with bounded memory."""

from __future__ import annotations

import random
import re
from pathlib import Path
from typing import Any

import pytest

from silo.bom.errors import DocumentError
from silo.inertia.geometry import ReadOptions, read

HEAD = (
    b"ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\n"
    b"FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'));\nENDSEC;\nDATA;\n"
)
TAIL = b"ENDSEC;\nEND-ISO-10303-21;\n"

# A face whose bound is itself, a shell that holds its solid, a representation that is its own context.
CIRCLES = (
    b"#1=AXIS2_PLACEMENT_3D('',#1,#1,#1);\n#2=ADVANCED_FACE('',(#2),#2,.T.);\n"
    b"#3=MANIFOLD_SOLID_BREP('',#4);\n#4=CLOSED_SHELL('',(#2,#3,#4));\n"
    b"#5=SHAPE_REPRESENTATION('',(#3,#5),#5);\n"
)
FILES = {
    "parentheses": HEAD + b"#1=PRODUCT(" + b"(" * 500_000 + TAIL,
    "string": HEAD + b"#1=PRODUCT('" + b"a" * 5_000_000 + b"');\n" + TAIL,
    "unclosed": HEAD + b"#1=PRODUCT('" + b"a" * 1_000_000 + TAIL,
    "noise": HEAD + random.Random(1).randbytes(500_000) + TAIL,
    "circles": HEAD + CIRCLES + TAIL,
}


@pytest.mark.slow
@pytest.mark.parametrize("name", FILES)
def test_what_no_program_wrote(name: str, tmp_path: Path) -> None:
    """Nesting without end, a string of megabytes, noise, references in circles."""
    path = tmp_path / f"{name}.step"
    path.write_bytes(FILES[name])
    with pytest.raises(DocumentError) as told:
        read(path, options=ReadOptions(cache=False, timeout_s=60, memory_mb=3000))
    assert "\n" not in str(told.value)
    assert path.name in str(told.value)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_references_that_lead_elsewhere(seed: int, box: Any, step_part: Any, tmp_path: Path) -> None:
    """Every twentieth reference to a wrong entity: a crash of the kernel is a sentence, and no silent mass.

    Where the file can still be read, what is not as it was is reported.
    """
    path = step_part(box(10, 20, 30))
    content = path.read_bytes()
    whole = read(path, options=ReadOptions(cache=False))
    chance = random.Random(seed)
    numbers = re.findall(rb"#\d+", content)

    def other(found: re.Match[bytes]) -> bytes:
        return chance.choice(numbers) if chance.random() < 0.05 else found[0]

    path.write_bytes(re.sub(rb"#\d+(?=[,)])", other, content))
    try:
        assembly = read(path, options=ReadOptions(cache=False, timeout_s=60, memory_mb=3000))
    except DocumentError:
        return
    problems = [*assembly.problems, *(p for part in assembly.prototypes.values() for p in part.problems)]
    volumes = [sum(p.volume_m3 for p in a.prototypes.values()) for a in (whole, assembly)]
    assert problems or volumes[1] == pytest.approx(volumes[0])
