# SPDX-License-Identifier: LGPL-2.1-or-later
"""What goes into Silo comes out again: each project, committed and pulled into an empty folder, is the same.

The same relative paths, the same bytes, the same BOM, and no link that leads nowhere unless it did before.
For the real assemblies of ``../shared/data``, where they are, and for random ones.
"""

from __future__ import annotations

import os
import random
import shutil
import tempfile
import uuid
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from fcstd_writer import Doc, Raw, locals_, text
from hunting import examples
from hypothesis import given, settings
from hypothesis import strategies as st
from public_projects import ASSEMBLIES

from silo.bom.errors import InputError
from silo.bom.walk.links import extract
from silo.bom.walk.roots import choose_assembly
from silo.fcstd import Library
from silo.fcstd.linked import recorded_paths
from silo.files import documents_in
from silo.locator import FoundFile, Locator
from silo.outbox.send import send_all
from silo.outbox.store import Store
from silo.registering.closed_files import proposals_for, register_all
from silo.testing import FakeSilo
from silo.vault.project import (
    Belonging,
    commits,
    compare,
    find_project,
    keep,
    name_documents,
    read_project,
)
from silo.vault.pull import place
from silo.vault.tree import fetched

PROJECTS = {
    "alarm_clock/parts": 20,
    "asm4-examples/Asm4_Example1": 1,
    "asm4-examples/Asm4_Example2": 1,
    "asm4-examples/Asm4_Example3": 1,
    "asm4-examples/Asm4_Tutorial4": 1,
    "dingo-batterytray": 1,
    "lmn3": 1,
}


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing of the user's own data is read or written."""
    for name in ("HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_CACHE_HOME"):
        monkeypatch.setenv(name, str(tmp_path / name.lower()))


def commit(root: Path, silo: FakeSilo, store: Store) -> Belonging:
    """Send the whole folder; everything arrives."""
    found = name_documents(read_project([str(root)], find_project([str(root)])), silo)
    for file, one in commits(found, compare(found, silo, store), allow_missing=True):
        keep(found.project, store, file, one, silo.base_url)
    report = send_all(store, silo, force=True)
    assert not report.held, report.held
    assert not report.failed, report.failed
    return found


def below(path: str, root: Path) -> dict[str, dict[str, bool]]:
    """All that a file links to inside the root: place → recorded path → whether it leads to a file there."""
    locator, found, left = Locator(str(root)), dict[str, dict[str, bool]](), [path]
    while left:
        one = left.pop()
        at = os.path.relpath(one, root).replace(os.sep, "/")
        if at in found:
            continue
        targets = {name: locator.find(name, (os.path.dirname(one),)) for name in recorded_paths(one)}
        found[at] = {name: isinstance(target, FoundFile) for name, target in targets.items()}
        left += [target.real for target in targets.values() if isinstance(target, FoundFile)]
    return found


def bom(path: Path, root: Path) -> Any:
    """The BOM of a file with all below it, with paths as seen from the project."""

    def told(entries: Any) -> list[Any]:
        return [
            (os.path.relpath(e.doc_path, root), e.object_name, e.silo_uuid, e.quantity, told(e.children))
            for e in entries
        ]

    with Library(root) as library:
        try:
            found = extract(choose_assembly(library.open(path)))
        except InputError as error:
            return type(error)
    return told(found.entries), sorted((f.code, f.severity) for f in found.findings)


def check_it_comes_back(root: Path, tops: Iterable[Any], silo: FakeSilo, scratch: Path) -> None:
    """Pull these files of a project, and compare."""
    for number, top in enumerate(tops):
        into = scratch / str(number)
        item = silo.get_item_by_uuid(top.item)
        assert item is not None
        with fetched(silo, item.part_number) as tree:
            pulled = place(tree, into)
        before, after = below(top.path, root), below(str(into / top.place), into)
        assert after == before
        for at in before:
            assert (into / at).read_bytes() == (root / at).read_bytes(), at
        assert {Path(p).relative_to(into).as_posix() for p in documents_in([str(into)])} == set(before)
        assert len(pulled.lost) == sum(not there for links in before.values() for there in links.values())
        assert bom(into / top.place, into) == bom(root / top.place, root)
        again = read_project([str(into)], find_project([str(into)]))
        assert {one.state.name for one in compare(name_documents(again, silo, new=False), silo, Store())} == {
            "SAME"
        }
        shutil.rmtree(into)


@pytest.mark.parametrize("name", PROJECTS)
def test_a_real_project_comes_back_whole(name: str, tmp_path: Path) -> None:
    """Registered as its owner would do it: parts and assemblies, also several in a file."""
    if not (ASSEMBLIES / name).is_dir():
        pytest.skip(f"{ASSEMBLIES / name} is not here; NOT tested")
    root = tmp_path / "project"
    shutil.copytree(ASSEMBLIES / name, root, copy_function=shutil.copyfile)
    for folder, _, _ in os.walk(root):
        os.chmod(folder, 0o755)  # the data are read-only
    silo, store = FakeSilo(), Store(tmp_path / "outbox.sqlite3")
    for path in documents_in([str(root)]):
        with Library() as library:
            try:
                found = extract(choose_assembly(library.open(path)))
            except InputError:
                continue
        register_all(proposals_for(found, silo, "kindred-rd"), silo, schema="kindred-rd")
    belonging = commit(root, silo, store)
    tops = [file for file in belonging.files if file.item]
    assert len(tops) >= PROJECTS[name]
    # One with each number of files below it: the parts of a project come back in the same way.
    check_it_comes_back(
        root, {len(below(top.path, root)): top for top in tops}.values(), silo, tmp_path / "back"
    )


FOLDERS = ("", "a", "a/b", "lib", "Größe ß")
ENDINGS = ("FCStd", "fcstd")


@contextmanager
def random_project(rng: random.Random) -> Iterator[tuple[Path, FakeSilo]]:
    """Files in folders that link to earlier ones: parts, assemblies, files of several items, sheets."""
    silo = FakeSilo()

    def item(kind: str) -> str:
        category = "A01" if kind == "assembly" else "M01"
        return silo.create_item("kindred-rd", category, f"n{rng.random()}", item_type=kind).id

    with tempfile.TemporaryDirectory() as scratch:
        root = Path(scratch) / "robot"
        made: list[tuple[str, list[str]]] = []
        for number in range(rng.randint(2, 7)):
            at = "/".join(filter(None, (rng.choice(FOLDERS), f"Teil {number}.{rng.choice(ENDINGS)}")))
            kind = rng.choice(("part", "several", "sheet", "assembly", "assembly"))
            whole = (
                {"SiloUUID": item(kind)}
                if kind == "part" or (kind == "assembly" and rng.random() < 0.8)
                else {}
            )
            own = Raw("App::PropertyUUID", f'<Uuid value="{uuid.UUID(int=rng.getrandbits(128))}"/>')
            doc = Doc(label=f"d{number}", meta=whole, extra={"Uid": own})
            names = [f"B{number}"]
            if kind == "several":
                names = [f"B{number}", f"C{number}"]
            if kind == "sheet":
                doc.add("Spreadsheet::Sheet", names[0])
            else:
                for name in names:
                    marked = {"SiloUUID": text_property(item("part"))} if kind == "several" else {}
                    doc.add("Part::Box", name, Height=float(number + 1), **marked)
            links = []
            if kind == "assembly":
                for link in range(rng.randint(0, 4)):
                    to, objects = rng.choice(made) if made and rng.random() < 0.85 else ("gone.FCStd", ["X"])
                    path = os.path.relpath(to, os.path.dirname(at) or ".").replace(os.sep, "/")
                    links.append(f"L{link}")
                    doc.link(links[-1], path, rng.choice(objects))
                doc.add("Assembly::AssemblyObject", "Asm", Group=locals_(*links), Type="Assembly")
                names = ["Asm"]
            doc.save(root / at)
            made.append((at, names))
        yield root, silo


def text_property(value: str) -> Raw:
    """A string property as FreeCAD writes it."""
    return Raw("App::PropertyString", f'<String value="{text(value)}"/>')


@settings(max_examples=examples(8), deadline=None)
@given(st.integers(0, 2**32))
def test_a_random_project_comes_back_whole(seed: int) -> None:
    """Libraries, sheets and files of several items have no item, and come with what links to them."""
    with random_project(random.Random(seed)) as (root, silo):
        store = Store(root.parent / "outbox.sqlite3")
        belonging = commit(root, silo, store)
        tops = [file for file in belonging.files if file.item]
        check_it_comes_back(root, tops, silo, root.parent / "back")
