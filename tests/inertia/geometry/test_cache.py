# SPDX-License-Identifier: LGPL-2.1-or-later
"""What was read is kept by content, and given back only while it still holds."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut

from silo.bom.errors import DocumentError, InputError
from silo.inertia.assembly import Assembly, Instance, Prototype
from silo.inertia.geometry import Mesh, ReadOptions, read
from silo.inertia.geometry.cache import Cache, default_folder, fingerprint, key_of, key_parts, measured_by
from silo.inertia.geometry.stored import FORMAT, load, save
from silo.inertia.notes import Note
from silo.platform.user_folders import cache_folder

IMPOSSIBLE = 1
"""[MB] of memory with which nothing can be read: what is answered then comes from the cache."""


@pytest.fixture(name="kept")
def _kept(tmp_path: Path) -> Any:
    """``kept(**options)``: options with a cache folder of the test's own."""

    def kept(**more: Any) -> ReadOptions:
        return ReadOptions(cache_dir=tmp_path / "cache", **more)

    return kept


def files(folder: Path) -> list[Path]:
    """All files below."""
    return sorted(path for path in folder.rglob("*") if path.is_file())


def test_the_second_reading_comes_from_the_cache(
    box: Any, step_part: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Equal to the first, also of a copy elsewhere, and without the kernel: with 1 MB nothing could be read.

    In the user's folder, if nobody has named one; entries appear whole, by renaming.
    """
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    path = step_part(box(1, 2, 3), "bracket")
    read(path, options=ReadOptions(cache=False))
    assert not default_folder().exists()
    first = read(path)
    assert [entry.suffix for entry in files(default_folder())] == [".npz"]
    (tmp_path / "elsewhere").mkdir()
    copy = path.rename(tmp_path / "elsewhere" / path.name)
    again = read(copy, options=ReadOptions(memory_mb=IMPOSSIBLE))
    assert again.source == str(copy)
    (one,), (two,) = first.prototypes.values(), again.prototypes.values()
    assert one.volume_m3 == two.volume_m3
    assert one.inertia_unit.tolist() == two.inertia_unit.tolist()


def test_other_content_or_options_are_read_anew(box: Any, step_part: Any, kept: Any) -> None:
    """A changed byte and a changed option each miss the cache; limits and callbacks do not."""
    path = step_part(box(1, 2, 3))
    read(path, options=kept())
    with pytest.raises(DocumentError):
        read(path, options=kept(memory_mb=IMPOSSIBLE, eps=1e-6))
    assert read(path, options=kept(memory_mb=IMPOSSIBLE, timeout_s=50)).instances
    path.write_bytes(path.read_bytes() + b"\n")
    with pytest.raises(DocumentError):
        read(path, options=kept(memory_mb=IMPOSSIBLE))


def test_a_damaged_entry_counts_as_none(box: Any, step_part: Any, kept: Any, tmp_path: Path) -> None:
    """A half-written or foreign file in the cache is overwritten by a new reading."""
    path = step_part(box(1, 2, 3))
    read(path, options=kept())
    (entry,) = files(tmp_path / "cache")
    entry.write_bytes(entry.read_bytes()[:100])
    assert read(path, options=kept()).instances
    assert read(path, options=kept(memory_mb=IMPOSSIBLE)).instances


def test_a_sibling_that_appears_or_changes_is_noticed(box: Any, step: Any, tmp_path: Path, kept: Any) -> None:
    """A split assembly is kept with the files it was completed from, and with those it lacked."""
    folder = tmp_path / "asm"
    folder.mkdir()
    document = step()
    top = document.assembly("top")
    document.place(top, document.part(box(3, 3, 3), "cube"), name="cube_1")
    path = document.write(folder / "top.step", external=True)
    (folder / "cube.stp").rename(tmp_path / "away.stp")

    def volume() -> float:
        assembly = read(path, options=kept())
        return sum(p.volume_m3 for p in assembly.prototypes.values()) * 1e9

    assert volume() == 0.0
    (tmp_path / "away.stp").rename(folder / "cube.stp")
    assert volume() == pytest.approx(27)
    other = step()
    other.part(box(4, 4, 4), "cube")
    other.write(folder / "cube.stp")
    assert volume() == pytest.approx(64)


def test_a_file_that_changes_while_it_is_read_is_read_again(box: Any, step: Any, tmp_path: Path) -> None:
    """CAD saves over a file that is being read: neither the old numbers nor a mix of both are kept."""
    path = tmp_path / "part.step"

    def save(size: float) -> None:
        document = step()
        document.part(box(size, size, size), "cube")
        document.write(path)

    def options(changes: list[float]) -> ReadOptions:
        def progress(at: Any) -> None:
            if at.stage == "measuring" and changes:
                save(changes.pop())

        return ReadOptions(cache_dir=tmp_path / "cache", progress=progress)

    for changes in ([2.0], []):
        save(3.0)
        (part,) = read(path, options=options(list(changes))).prototypes.values()
        assert part.volume_m3 * 1e9 == pytest.approx(8 if changes else 27)
    save(9.0)
    with pytest.raises(DocumentError, match="changed while it was read"):
        read(path, options=options([4.0, 5.0, 6.0, 7.0]))


def test_a_sibling_that_changes_while_it_is_read_is_read_again(box: Any, step: Any, tmp_path: Path) -> None:
    """Neither the old numbers nor a mix of both are kept; the new file may be an old copy."""
    document = step()
    top = document.assembly("top")
    block = BRepAlgoAPI_Cut(box(4, 4, 4), box(1, 1, 1)).Shape()  # the larger file, so read first
    for name, shape in (("block", block), ("cube", box(1, 1, 1))):
        document.place(top, document.part(shape, name), name=name)
    path = document.write(tmp_path / "top.step", external=True)
    assert (tmp_path / "block.stp").stat().st_size > (tmp_path / "cube.stp").stat().st_size
    changed = step()
    changed.part(box(5, 5, 5), "block")
    waiting = [changed.write(tmp_path / "saved.tmp")]
    seen: list[str] = []

    def progress(at: Any) -> None:
        seen.append(at.stage)
        if at.stage == "reading cube.stp" and waiting:
            other = waiting.pop()
            os.utime(other, (1e9, 1e9))
            other.replace(tmp_path / "block.stp")

    for _ in range(2):  # read, then from the cache
        assembly = read(path, options=ReadOptions(cache_dir=tmp_path / "cache", progress=progress))
        assert sorted(round(p.volume_m3 * 1e9, 6) for p in assembly.prototypes.values()) == [1, 125]
    assert seen.count("reading block.stp") == 2


def test_the_cache_is_bounded(box: Any, step_part: Any, kept: Any, tmp_path: Path) -> None:
    """What was not used for longest goes first; what was just written stays."""
    paths = [step_part(box(1, 2, n + 1), f"part{n}") for n in range(4)]
    for path in paths[:3]:
        read(path, options=kept())
    entries = {path.stat().st_size for path in files(tmp_path / "cache")}
    assert read(paths[0], options=kept(memory_mb=IMPOSSIBLE)).instances  # used again
    small = Cache(tmp_path / "cache", max_bytes=2 * max(entries) + 10)
    result = tmp_path / "result.npz"
    save(read(paths[3], options=ReadOptions(cache=False)), result)
    small.put("ff" + "0" * 62, result)
    assert len(files(tmp_path / "cache")) == 2
    assert read(paths[0], options=kept(memory_mb=IMPOSSIBLE)).instances
    with pytest.raises(DocumentError):
        read(paths[1], options=kept(memory_mb=IMPOSSIBLE))


def test_the_key_knows_the_code_that_measured(tmp_path: Path) -> None:
    """A release with another integration must not give the old one's numbers."""
    code = tmp_path / "quadrature.py"
    code.write_text("MAX_SPLITS = 14")
    before = fingerprint([code])
    code.write_text("MAX_SPLITS = 15")
    assert fingerprint([code]) != before
    assert measured_by() in key_parts(code, {})


def test_the_folder_is_the_user_s_cache_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Where everything of ours that can be made again lies; an empty or relative variable moves nothing."""
    for value in (str(tmp_path), "", "relative"):
        monkeypatch.setenv("XDG_CACHE_HOME", value)
        assert default_folder() == cache_folder() / "geometry"


def test_a_folder_without_the_right_to_write_is_no_error(
    box: Any, step_part: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A home that cannot be written (here: a file in the way): read anyway, and nothing kept."""
    (tmp_path / "home").write_text("in the way")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    assert read(step_part(box(1, 2, 3))).instances
    assert (tmp_path / "home").read_text() == "in the way"


def test_the_key_depends_on_content_name_options_and_kernel(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Unnamed parts are called after the file, so its name counts; its folder does not."""
    one, two = tmp_path / "a" / "x.step", tmp_path / "b" / "x.step"
    for path in (one, two):
        path.parent.mkdir()
        path.write_bytes(b"content")
    same = ReadOptions().content_options()
    assert key_of(one, same) == key_of(two, same)
    renamed = one.rename(one.with_name("y.step"))
    assert key_of(renamed, same) != key_of(two, same)
    before = key_of(two, same)
    assert key_of(two, ReadOptions(mesh_check=False).content_options()) != before
    monkeypatch.setattr(sys.modules["silo.inertia.geometry.cache"], "KERNELS", ("numpy",))
    assert key_of(two, same) != before


def assembly() -> Assembly:
    """One with everything in it."""
    part = Prototype(
        "k/1", "Peça ✓", 4e-6, np.array([0.1, 2.0, 3.0]), np.diag([0.1, 2.0, 2.5]), True,
        (Note("name", "said"),), 7850.0, "Steel", 4.1e-6, "F01-1",
        Mesh(np.eye(3), np.array([[0, 1, 2]])),
    )  # fmt: skip
    empty = Prototype("k/2", "empty", has_solid=False)
    turn = np.eye(4)
    turn[:3, 3] = (0.1, -0.2, 0.3)
    return Assembly(
        "top",
        {part.key: part, empty.key: empty},
        (Instance(("a", "b"), ("A", "B"), "k/1", turn), Instance(("c",), ("C",), "k/2")),
        (Note("units", "mm?"),),
        "where.step",
        "mm",
        {("a",): turn},
    )


def test_a_stored_assembly_comes_back_as_it_was(tmp_path: Path) -> None:
    """All fields, of all kinds; what is kept beside comes along."""
    before = assembly()
    save(before, tmp_path / "x.npz", {"others": {"a": "b"}})
    after, extra = load(tmp_path / "x.npz")
    assert extra == {"others": {"a": "b"}}
    assert (after.name, after.source, after.unit) == (before.name, before.source, before.unit)
    assert after.problems == before.problems
    assert list(after.prototypes) == list(before.prototypes)
    one, two = before.prototypes["k/1"], after.prototypes["k/1"]
    for name in ("name", "volume_m3", "has_solid", "problems", "step_density", "step_material"):
        assert getattr(one, name) == getattr(two, name)
    assert (two.stated_volume_m3, two.part_number) == (4.1e-6, "F01-1")
    np.testing.assert_array_equal(two.com_m, one.com_m)
    np.testing.assert_array_equal(two.inertia_unit, one.inertia_unit)
    np.testing.assert_array_equal(two.mesh.faces, one.mesh.faces)
    assert after.prototypes["k/2"].mesh is None
    assert [(i.path, i.product_path, i.prototype) for i in after.instances] == [
        (i.path, i.product_path, i.prototype) for i in before.instances
    ]
    np.testing.assert_array_equal(after.instances[0].transform, before.instances[0].transform)
    np.testing.assert_array_equal(after.frames[("a",)], before.frames[("a",)])


def test_a_pickle_in_a_stored_file_is_never_loaded(tmp_path: Path) -> None:
    """An array of objects would run code when it is read: refused."""
    path = tmp_path / "evil.npz"
    np.savez(path, header=np.array([{"format": FORMAT}], dtype=object))
    with pytest.raises(InputError, match="not stored geometry"):
        load(path)
    assert Cache(tmp_path).get("evil", path) is None
