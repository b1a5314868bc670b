# SPDX-License-Identifier: LGPL-2.1-or-later
"""Mutated files: a DocumentError or a sane document, nothing else."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

import pytest
from fcstd_writer import Doc, container, locals_, part
from hunting import examples
from hypothesis import given, settings
from hypothesis import strategies as st

from silo.bom.entry import Extraction
from silo.bom.errors import DocumentError
from silo.bom.walk.document import LinkProblem
from silo.bom.walk.links import extract
from silo.fcstd import Library, Limits, stamp

LIMITS = Limits(document_xml=1 << 20, packed=1 << 20, side_entry=1 << 16, objects=1000)

relaxed = settings(max_examples=examples(40))


def top() -> Doc:
    """An assembly with an array, a chain and a broken link."""
    doc = Doc("top").link("L1", "part.FCStd", "Box").link("L2", "", "L1").link("L3", "none.FCStd", "Box")
    doc.link(
        "L4", "part.FCStd", "Box", ElementCount=2, ScaleList=doc.vectors("Scales", [(1, 1, 1), (1, -1, 1)])
    )
    return doc.add("App::Part", "A", Group=locals_("L1", "L2", "L3", "L4"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the one part that the assembly links to."""
    folder = tmp_path_factory.mktemp("fuzz")
    part(uuid="u-1").save(folder / "part.FCStd")
    return folder


def visit(path: Path) -> None:
    """Ask everything of a file, as a walker and more; then stamp it. Only DocumentError may come of it."""
    with contextlib.suppress(DocumentError), Library(limits=LIMITS) as library:
        document = library.open(path)
        assert isinstance(document.Label, str)
        assert isinstance(document.Meta, dict)
        for obj in document.Objects:
            ask(obj)
            assert isinstance(extract(obj), Extraction)
    with contextlib.suppress(DocumentError):
        stamp(path, "u-9", limits=LIMITS)
        with Library(limits=LIMITS) as library:
            assert library.open(path).Meta["SiloUUID"] == "u-9"


def ask(obj: Any) -> None:
    """Every property of an object."""
    assert obj.isDerivedFrom("App::DocumentObject")
    assert isinstance(obj.Label, str)
    for name in obj.PropertiesList:
        getattr(obj, name, None)
    assert obj.LinkProblem is None or isinstance(obj.LinkProblem, LinkProblem)


def mutated(data: bytes, draw: Any) -> bytes:
    """Some bytes changed, inserted, taken away, doubled or moved."""
    raw = bytearray(data)
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, max(0, len(raw) - 1)))
        length = draw(st.sampled_from([1, 1, 2, 10, 100, 1000]))
        change = draw(st.sampled_from(["set", "insert", "delete", "double", "cut"]))
        if change == "set":
            raw[at : at + 1] = draw(st.binary(min_size=1, max_size=1))
        elif change == "insert":
            raw[at:at] = draw(st.one_of(st.binary(max_size=8), st.sampled_from(PIECES)))
        elif change == "delete":
            del raw[at : at + length]
        elif change == "double":
            raw[at:at] = raw[at : at + length]
        else:
            del raw[at + length :]
    return bytes(raw)


PIECES = [
    b"<!--",
    b"-->",
    b"<![CDATA[",
    b"]]>",
    b"<!DOCTYPE a>",
    b"&#0;",
    b"&amp;",
    b"&lt;",
    b'<Object name="A">',
    b"</Object>",
    b'<Property name="Group">',
    b"</Property>",
    b"</Properties>",
    b"</ObjectData>",
    b"</Document>",
    b"<?x ?>",
    b"'",
    b'"',
    b"\xff",
    b"\0",
    b"99999999999999999999",
]


@relaxed
@given(data=st.data())
def test_mutated_text(folder: Path, data: st.DataObject) -> None:
    """Document.xml with damage, in a sound container."""
    doc = top()
    xml = mutated(doc.xml().encode(), data.draw)
    path = folder / "top.FCStd"
    path.write_bytes(container({"Document.xml": xml, **doc.entries}))
    visit(path)


@relaxed
@given(data=st.data())
def test_mutated_container(folder: Path, data: st.DataObject) -> None:
    """A damaged container."""
    path = folder / "top.FCStd"
    path.write_bytes(mutated(top().bytes(), data.draw))
    visit(path)


@relaxed
@given(data=st.data())
def test_mutated_part(folder: Path, data: st.DataObject) -> None:
    """Damage in a linked file is the link's problem; the assembly is still walked or refused."""
    xml = mutated(part(uuid="u-1").xml().encode(), data.draw)
    (folder / "other.FCStd").write_bytes(container({"Document.xml": xml}))
    path = (
        Doc()
        .link("L", "other.FCStd", "Box")
        .add("App::Part", "A", Group=locals_("L"))
        .save(folder / "t.FCStd")
    )
    visit(path)


@relaxed
@given(st.binary(max_size=400))
def test_any_bytes(folder: Path, raw: bytes) -> None:
    """Whatever a file holds."""
    path = folder / "any.FCStd"
    path.write_bytes(raw)
    visit(path)


@relaxed
@given(st.text(max_size=60))
def test_any_recorded_path(folder: Path, file: str) -> None:
    """Whatever path a link records, the answer is a target or a problem."""
    doc = Doc()
    try:
        path = doc.link("L", file, "Box").save(folder / "t.FCStd")
    except UnicodeEncodeError:
        return
    visit(path)
