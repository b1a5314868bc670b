# SPDX-License-Identifier: LGPL-2.1-or-later
"""Every regular expression is linear: each is found, and fed growing repeats of what it is made of.

A matching holds the interpreter. So it happens in a process of its own, which is ended if it does not answer.
"""

from __future__ import annotations

import json
import re
import select
import subprocess
import sys
from pathlib import Path

import pytest
from patterns import Found, patterns_of, slow_texts

MODS = Path(__file__).resolve().parents[1] / "mods"
MATCHER = Path(__file__).resolve().parent / "support" / "patterns.py"
# A pattern whose time grows with the square of this length takes several times the limit; the slowest
# of the others take a tenth of it.
LENGTH, SECONDS = 30_000, 8
# These meet texts of ours alone: our page templates, and a list in the module itself.
OUR_TEXTS = ("silo_server/web/render.py", "silo/bom/items/standard_kind.py")
# Made at run time: of literals that are escaped, of classes of characters, or of what the user wrote for it.
MADE = {
    "silo/api/config.py",
    "silo/bom/errors.py",
    "silo/bom/text.py",
    "silo/bom/walk/references.py",
    "silo/cli/exchange/pull.py",
    "silo/fcstd/xmltext.py",
    "silo/inertia/links/patterns.py",
    "silo/inertia/names.py",
    "silo/output_files.py",
    "silo_server/schema/__init__.py",
    "silo_server/services/items.py",
}


def slow(patterns: list[Found], length: int = LENGTH, seconds: float = SECONDS) -> list[Found]:
    """Those that do not come to an end within the limit."""
    named: list[Found] = []
    rest = list(patterns)
    while rest:
        process = subprocess.Popen(
            [sys.executable, str(MATCHER)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        assert process.stdin is not None
        assert process.stdout is not None
        with process:
            while rest:
                found = rest.pop(0)
                binary = isinstance(found.pattern, bytes)
                job = {
                    "pattern": found.pattern.decode("latin-1")
                    if isinstance(found.pattern, bytes)
                    else found.pattern,
                    "binary": binary,
                    "flags": found.flags,
                    "method": found.method,
                    "length": length,
                }
                process.stdin.write(json.dumps(job) + "\n")
                process.stdin.flush()
                if not select.select([process.stdout], [], [], seconds)[0]:
                    named.append(found)
                    break
                assert process.stdout.readline() == "done\n", found
            process.kill()
    return named


@pytest.mark.skipif(sys.platform == "win32", reason="select waits for sockets alone on Windows")
def test_every_pattern_that_meets_foreign_text_is_linear() -> None:
    found, made = patterns_of(MODS)
    assert len(found) > 150
    assert {place.partition(":")[0] for place in made} <= MADE, "a pattern that this test cannot read"
    foreign = [pattern for pattern in found if not pattern.place.startswith(OUR_TEXTS)]
    named = slow(foreign)
    assert not named, "\n".join(
        f"{pattern.place} ({pattern.method}): {pattern.pattern!r}" for pattern in named
    )


@pytest.mark.skipif(sys.platform == "win32", reason="select waits for sockets alone on Windows")
@pytest.mark.parametrize(
    ("pattern", "method"),
    [
        (r"(a+)+$", "match"),
        (r"\s*(.*?)\s*x", "search"),
        (r"<([^>]*)>", "search"),
        (rb"\d+ *= *\(", "search"),
        (r"(?:\w+\s?)*$", "fullmatch"),
    ],
)
def test_the_check_knows_slow_patterns(pattern: str | bytes, method: str) -> None:
    assert slow([Found("here", pattern, 0, method)], length=60_000, seconds=1)


def test_a_slow_text_repeats_what_a_pattern_is_made_of() -> None:
    texts = list(slow_texts(Found("here", r"x\s*=\s*(\d+),", 0, "match"), 10))
    assert any(re.fullmatch(r"x {9,}\0", str(text)) for text in texts), texts
    assert any(re.fullmatch(r"x = 0{9,}", str(text)) for text in texts), texts
