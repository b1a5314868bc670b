# SPDX-License-Identifier: LGPL-2.1-or-later
"""The HTML report without a browser: whole, closed in itself, and with what the report says."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from bodies import box

from silo.drawing.page import report_html
from silo.inertia.codes import Source
from silo.inertia.geometry import Mesh
from silo.inertia.report import InertiaReport

Fixture = Callable[..., Any]
HOSTILE = "</script><script>alert(1)</script>/*GLB*/&amp;"


def element(page: str, name: str) -> str:
    found = re.search(rf'<script id="{name}"[^>]*>(.*?)</script>', page, re.DOTALL)
    assert found is not None
    return found[1]


@pytest.fixture(name="page")
def _page(assemble: Fixture, compute: Fixture) -> str:
    corner = Mesh(np.eye(4, 3) * 0.1, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
    part = box(HOSTILE, 0.1, 0.1, 0.1, mesh=corner)
    plain = box("plain", 0.1, 0.1, 0.1)
    asm = assemble((f"a/{HOSTILE.replace('/', '')}", part), ("b/x", plain), ("b/y", plain), name=HOSTILE)
    return report_html(compute(asm, "Name,Mass,Material\nplain,0.5 kg,\nghost,1 kg,\n"), asm)


def test_the_page_holds_all_that_it_needs(page: str) -> None:
    """Viewer and GLB are inside; it may load nothing; what a file says ends no element."""
    assert base64.b64decode(element(page, "glb")).startswith(b"glTF")
    assert "var THREE=" in page
    assert "MIT License" in page
    assert "default-src 'none'" in page
    assert not re.search(r"(src|href)=\"(?!data:)", page)
    assert "/*DATA*/" not in page
    assert page.count("<script") == 4 == page.count("</script>")


def test_what_the_report_says_is_on_the_page(page: str) -> None:
    """Masses by source, warnings by code with the mass they concern, links and parts."""
    data = json.loads(element(page, "data"))
    assert data["name"] == HOSTILE
    assert [view["name"] for view in data["views"]] == ["a", "b"]
    sources = {row["name"]: (row["mass"], row["pieces"]) for row in data["sources"]}
    assert sources == {"BOM mass": (1.0, 2), "default density × volume": (pytest.approx(1.0), 1)}
    groups = {group["title"]: group for group in data["warnings"]}
    assert groups["not in bom"]["mass"] == pytest.approx(1.0)
    assert groups["row unused"]["mass"] == 1.0
    assert next(iter(groups)) == "row unused"  # a row without geometry that weighs half of the robot
    assert [(part["link"], part["quantity"]) for part in data["parts"]] == [("a", 1), ("b", 2)]
    assert data["links"][1]["com"] == [0.0, 0.0, 0.0]


def test_values_that_are_not_finite_are_no_zero(page: str, assemble: Fixture, compute: Fixture) -> None:
    """JSON has no NaN, and 0 would be a lie."""
    from dataclasses import replace

    asm = assemble(("a/x", box("x", 0.1, 0.1, 0.1)))
    report: InertiaReport = compute(asm, None)
    link = report.links["a"]
    report.links["a"] = replace(link, props=replace(link.props, mass=np.nan, inertia=np.full((3, 3), np.nan)))
    data = json.loads(element(report_html(report, asm), "data"))
    assert data["links"][0]["mass"] is None
    assert data["links"][0]["moments"] == [None] * 3
    assert not data["shapes"]


def test_every_source_has_a_colour() -> None:
    """A new source of masses must not break the page."""
    from silo.drawing.page import _SOURCE_COLOURS
    from silo.inertia.output.words import SOURCE_WORDS

    assert set(SOURCE_WORDS) == set(_SOURCE_COLOURS) == set(Source)
