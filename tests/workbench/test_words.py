# SPDX-License-Identifier: LGPL-2.1-or-later
"""Texts of others, made safe to show."""

from __future__ import annotations

import re
import unicodedata
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from silo.bom.errors import DocumentError, NotFoundError
from silo.workbench import words
from silo.workbench.pane.banner import banner
from silo.workbench.session.state import PaneState
from silo.workbench.settings.server import ServerChoice
from silo.workbench.words import breakable, counted, plain, quantity, tip, told_apart, visible


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("Base plate", "Base plate"),
        ("\x1b[31mred\x1b[0m", "[31mred [0m"),
        ("one\ntwo\ttabbed", "one two tabbed"),
        ("a\u202egnp.exe", "a gnp.exe"),
        ("zero\u200bwidth", "zero width"),
        ("  wide   blanks ", "wide blanks"),
        ("<b>bold</b>", "<b>bold</b>"),
        ("", ""),
    ],
)
def test_text_of_others_is_one_visible_line(text: str, shown: str) -> None:
    """Control and direction characters become blanks; markup stays what it is: text."""
    assert plain(text) == shown


def test_long_text_is_cut_and_says_so() -> None:
    """A label of a million letters costs no more than a long one."""
    assert plain("x" * 1_000_000, 10) == "x" * 9 + "…"


def test_text_of_exactly_the_limit_is_whole() -> None:
    """The mark of a cut stands only where something was cut."""
    assert plain("x" * 10, 10) == "x" * 10


@given(st.text(max_size=300), st.integers(min_value=2, max_value=80))
def test_whatever_comes_out_is_short_and_harmless(text: str, most: int) -> None:
    """No length and no character escapes."""
    shown = plain(text, most)
    assert len(shown) <= most
    assert not any(unicodedata.category(c) in ("Cc", "Cf", "Zl", "Zp", "Cs", "Co") for c in shown)


def test_several_lines_stay_lines() -> None:
    """A message box or the report view keeps its lines; what could steer a terminal is gone."""
    assert visible("one\n  two \x1b[31m\u202e\r") == "one\n  two  [31m  "
    assert visible("x" * 50, 10) == "x" * 10 + "…"


@given(st.text(max_size=300))
def test_whatever_the_report_view_gets_is_harmless(text: str) -> None:
    """Only line ends are left of the control characters."""
    assert not any(
        unicodedata.category(c) in ("Cc", "Cf", "Zl", "Zp", "Cs", "Co") for c in visible(text) if c != "\n"
    )


def test_a_tool_tip_shows_markup_as_text() -> None:
    """Qt would draw it otherwise, and load pictures that it names."""
    assert tip('a <img src="x"> & b') == '<qt>a &lt;img src="x"&gt; &amp; b</qt>'
    assert tip("") == ""
    # What a cell cuts is whole here.
    assert "the end" in tip("word " * 500 + "the end")


def test_one_and_many() -> None:
    """A count of one has its own sentence."""
    assert counted(1, "{n} part", "{n} parts") == "1 part"
    assert counted(2, "{n} part", "{n} parts") == "2 parts"
    assert counted(0, "{n} part", "{n} parts") == "0 parts"


def test_quantities_are_written_short() -> None:
    """12, never 12.0; unknown is a question mark."""
    assert [quantity(v) for v in (12.0, 0.5, None)] == ["12", "0.5", "?"]


def test_texts_are_translated_by_what_freecad_offers() -> None:
    """Outside FreeCAD the text stays as it is."""
    assert words.translate("Silo", "Sync") == "Sync"
    words.use(lambda context, text: f"{context}:{text[::-1]}")
    try:
        assert words.translate("Silo", "Sync") == "Silo:cnyS"
    finally:
        words.use(lambda _context, text: text)


def test_sentences_are_in_the_language_of_the_translation() -> None:
    """Errors of the server and of the library, and what FreeCAD could not do; names in them stay."""
    said = {
        NotFoundError(
            "item 'A-1' does not exist on this server"
        ): "Artikel 'A-1' gibt es auf diesem Server nicht",
        DocumentError("Arm.FCStd", "FreeCAD did not load it"): "Arm.FCStd: FreeCAD hat es nicht geladen",
        "The file Arm.FCStd is missing; used by Cover": "Die Datei Arm.FCStd fehlt; verwendet von Cover",
    }
    assert words.spoken("FreeCAD did not load it") == "FreeCAD did not load it"
    words.use(lambda _context, text: {"en": "de"}.get(text, text))
    try:
        for sentence, german in said.items():
            assert words.spoken(sentence) == german
        reason = "the server is stopping; try again later"
        told = banner(
            PaneState(server=ServerChoice("https://silo.example.com"), connection="offline", reason=reason)
        )
        assert "Der Server wird angehalten; später noch einmal versuchen" in told.text
    finally:
        words.use(lambda _context, text: text)


def test_errors_are_shown_in_the_language_of_the_person() -> None:
    """What is shown directly went through ``spoken``; windows, boxes and lines of news say what they get."""
    direct = re.compile(
        r"\.set(Text|ToolTip)\((?!spoken).*str\(error\)|console\(f\"[^\"]*\{(error|problem)\}"
    )
    for path in Path(words.__file__).parent.rglob("*.py"):
        assert not direct.search(path.read_text("utf-8")), path.name


@pytest.mark.parametrize("text", ["", "a short text", "BOM Updated: A01-0001 Torso", "x" * 26])
def test_ordinary_texts_are_not_broken(text: str) -> None:
    """What a person copies is what was said."""
    assert breakable(text) == text


def test_a_long_word_can_be_broken_anywhere_sensible() -> None:
    """No piece is longer than a narrow pane takes, and nothing is lost."""
    word = "/home/ann/projects/TorsoTopPlateWithAVeryLongName" + "x" * 60 + ".FCStd"
    text = f"read-only: {word} is"
    found = breakable(text)
    assert found.replace("\u200b", "") == text
    assert max(map(len, re.split("[ \u200b]", found))) <= 26


def test_files_of_one_name_are_told_apart_by_their_folders() -> None:
    """As many of them as it takes; one file in several rows needs none."""
    same = [
        "/p/a/Lid.FCStd",
        "/p/b/Lid.FCStd",
        "/q/b/Lid.FCStd",
        "/p/Box.FCStd",
        "/p/Box.FCStd",
        "",
        "Lid.FCStd",
    ]
    assert list(told_apart(same).values()) == [
        "Box.FCStd",
        "",
        "Lid.FCStd",
        "a/Lid.FCStd",
        "p/b/Lid.FCStd",
        "q/b/Lid.FCStd",
    ]
    assert told_apart(["C:\\\\v\\\\a\\\\Lid.FCStd"]) == {"C:\\\\v\\\\a\\\\Lid.FCStd": "Lid.FCStd"}


def test_a_value_is_put_in_as_it_is() -> None:
    """A name that looks like a place for another value stays, and so does a place without a value."""
    assert words.filled("{who}: {n} {left}", who="{n}", n=3) == "{n}: 3 {left}"
    assert words.translate("Silo", "{who} has {n}", who="Arm {n}", n=2) == "Arm {n} has 2"
