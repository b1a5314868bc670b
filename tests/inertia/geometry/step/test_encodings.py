# SPDX-License-Identifier: LGPL-2.1-or-later
"""Names in the code page of the machine that wrote a STEP file, which the standard does not allow."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from silo.cli.main import main
from silo.inertia.notes import GeometryCode

NAMES = [
    ("shift_jis", "表示ソ能"),  # 表, ソ and 能 end with the byte of a backslash in Shift-JIS
    ("gbk", "誠实轴承"),
    ("cp1251", "Вал привода"),
    ("euc_kr", "축 받침"),
    ("latin_1", "Träger è"),
]


@pytest.fixture(name="named")
def _named(box: Any, trsf: Any, step: Any, tmp_path: Path) -> Any:
    """A file with two parts; one name of raw bytes, the other and the occurrence of raw UTF-8."""

    def make(name: str, encoding: str, wrapped: bool = False) -> Path:
        document = step()
        top = document.assembly("top")
        document.place(top, document.part(box(10, 20, 30), "PART-X"), trsf((0, 0, 0)), "one")
        document.place(top, document.part(box(10, 10, 10), "PART-Y"), trsf((50, 0, 0)), "two")
        path: Path = document.write(tmp_path / "named.step")
        raw = name.encode(encoding)
        raw = b"\n".join([raw[:1], raw[1:]]) if wrapped else raw
        data = path.read_bytes().replace(b"PART-X", raw).replace(b"PART-Y", "größer".encode())
        path.write_bytes(data)
        return path

    return make


def _names(assembly: Any) -> list[str]:
    return [assembly.prototypes[i.prototype].name for i in assembly.instances]


@pytest.mark.parametrize("wrapped", [False, True])
@pytest.mark.parametrize(("encoding", "name"), NAMES)
def test_names_are_read_in_the_encoding_that_the_user_names(
    encoding: str, name: str, wrapped: bool, named: Any, read_in: Any, codes_of: Any
) -> None:
    """UTF-8 in the same file stays UTF-8; a line may break in the middle of a character."""
    assembly = read_in(named(name, encoding, wrapped), step_encoding=encoding)
    assert _names(assembly) == [name, "größer"]
    assert codes_of(assembly) == []
    assert assembly.prototypes[assembly.instances[0].prototype].volume_m3 == pytest.approx(6e-6)


@pytest.mark.parametrize(("encoding", "name"), NAMES)
def test_a_guess_is_reported(encoding: str, name: str, named: Any, read_in: Any, codes_of: Any) -> None:
    """Without a word of the user the names are Windows-1252, and a warning says which they are."""
    assembly = read_in(named(name, encoding))
    read = name.encode(encoding).decode("cp1252", "replace")
    assert codes_of(assembly) == [GeometryCode.NAME]
    assert "--step-encoding" in assembly.problems[0].message
    if "\\" not in read and read.isprintable():  # else the guess makes escapes of it
        assert _names(assembly)[0] == read
        assert read in assembly.problems[0].message


def test_utf_8_and_ascii_need_no_word(named: Any, read_in: Any, codes_of: Any) -> None:
    assembly = read_in(named("Träger", "utf-8"), step_encoding="shift_jis")
    assert _names(assembly) == ["Träger", "größer"]
    assert codes_of(read_in(named("Träger", "utf-8"))) == []


def test_an_author_in_another_code_page_is_no_warning(named: Any, read_in: Any, codes_of: Any) -> None:
    """Only names matter: the header is full of people."""
    path = named("plain", "ascii")
    path.write_bytes(path.read_bytes().replace(b"'Author'", "'Jörg'".encode("cp1252")))
    assert "Jörg".encode("cp1252") in path.read_bytes()
    assembly = read_in(path)
    assert _names(assembly) == ["plain", "größer"]
    assert codes_of(assembly) == []


@pytest.mark.parametrize("option", ["--encoding", "--step-encoding"])
def test_a_bom_in_the_same_code_page_finds_the_part(
    option: str, named: Any, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    path = named("表示ソ能", "shift_jis")
    bom = tmp_path / "bom.csv"
    bom.write_text("Name,Mass\n表示ソ能,1.5 kg\ngrößer,0.5 kg\n", "utf-8-sig")
    if option == "--encoding":
        bom.write_text("Name,Mass\n表示ソ能,1.5 kg\n", "shift_jis")
    assert main(["inertia", str(path), "--bom", str(bom), option, "shift_jis", "--json", "--no-cache"]) == 0
    parts = [part for link in json.loads(capsys.readouterr().out)["links"] for part in link["parts"]]
    assert {part["name"]: part["mass"] for part in parts}["表示ソ能"] == 1.5


@pytest.mark.parametrize("command", ["inertia", "links"])
def test_an_unknown_encoding_is_refused(command: str, named: Any, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([command, str(named("a", "ascii")), "--step-encoding", "klingon"]) == 2
    assert "there is no encoding klingon" in capsys.readouterr().err
