# SPDX-License-Identifier: LGPL-2.1-or-later
"""``pull`` fetches models and, if wanted, attachments beside them; none takes the place of another."""

from __future__ import annotations

from pathlib import Path

from fcstd_writer import part
from model_file import model_file

from silo.testing import FakeSilo
from silo.vault.pull import PullState, place
from silo.vault.tree import fetched

PDF = b"%PDF-1.7 wheel"


def filled(folder: Path) -> tuple[FakeSilo, str, bytes]:
    """A Silo with a wheel that has a model and attachments; the wheel's number and model."""
    silo = FakeSilo()
    wheel = silo.create_item("kindred-rd", "M01", "Wheel").part_number
    model = part("wheel").bytes()
    files = {"wheel.FCStd": model, "wheel.pdf": PDF, "page.FCStd": model_file(b"page")}
    for name, content in files.items():
        (folder / name).write_bytes(content)
    silo.upload_file(wheel, folder / "wheel.FCStd")
    silo.attach_file(wheel, folder / "wheel.pdf", "wheel.pdf")
    silo.attach_file(wheel, folder / "wheel.pdf", "wheel.FCStd")  # a drawing with the name of the model
    silo.attach_file(wheel, folder / "page.FCStd", "page.FCStd", kind="drawing")
    return silo, wheel, model


def test_attachments_come_beside_the_model_and_never_in_its_place(tmp_path: Path) -> None:
    """Without the option only the model; with it all, none under a name that means a model."""
    (tmp_path / "from").mkdir()
    silo, wheel, model = filled(tmp_path / "from")
    into = tmp_path / "into"
    into.mkdir()
    with fetched(silo, wheel) as tree:
        place(tree, into)
    assert [path.name for path in into.rglob("*.*") if path.is_file() and path.name[0] != "."] == [
        "wheel.FCStd"
    ]
    with fetched(silo, wheel, attachments=True) as tree:
        pulled = place(tree, into)
    assert pulled.complete
    assert [file.state for file in pulled.files] == [PullState.SAME, *[PullState.NEW] * 3]
    assert (into / "wheel.FCStd").read_bytes() == model
    assert (into / "wheel.pdf").read_bytes() == PDF
    assert (into / f"{wheel}-wheel.FCStd.drawing").read_bytes() == PDF
    assert (into / f"{wheel}-page.FCStd.drawing").read_bytes() == model_file(b"page")


def test_a_drawing_in_the_place_of_a_model_is_passed_over(tmp_path: Path) -> None:
    """A Silo without kinds: the newest revision that is a model is taken, and a remark says so."""
    silo, wheel, model = filled(tmp_path)
    for _ in range(2):
        silo.upload_file(wheel, tmp_path / "wheel.pdf", file_name="wheel.FCStd")
    stored = silo._stored(wheel)
    stored.revisions[:] = [one.model_copy(update={"kind": None}) for one in stored.revisions]
    with fetched(silo, wheel) as tree:
        assert tree.files[0].content.read_bytes() == model
        assert tree.remarks == (f"{wheel}: revision 3 is no model, so revision 1 was taken",)
