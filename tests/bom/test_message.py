# SPDX-License-Identifier: LGPL-2.1-or-later
"""A message keeps its template and values until it is shown."""

from __future__ import annotations

import json
import pickle

from hypothesis import given
from hypothesis import strategies as st

from silo.bom.message import Message, carried, counted_message, from_carried, from_json, joined, message


class German:
    """A catalogue with two texts."""

    TEXTS = {"The file {file} is missing": "Die Datei {file} fehlt", "same part": "dasselbe Teil"}

    def gettext(self, message: str, /) -> str:
        return self.TEXTS.get(message, message)

    def ngettext(self, msgid1: str, msgid2: str, n: int, /) -> str:
        return "{n} Zeile" if n == 1 else "{n} Zeilen"


def test_a_message_reads_as_its_english_sentence() -> None:
    missing = message("The file {file} is missing", file="a.FCStd")
    assert missing == "The file a.FCStd is missing"
    assert missing.said(German()) == "Die Datei a.FCStd fehlt"


def test_a_value_that_is_one_of_our_sentences_stays() -> None:
    assert (
        message("The file {file} is missing", file="same part").said(German()) == "Die Datei same part fehlt"
    )


def test_a_message_in_a_message_is_translated_by_its_own_template() -> None:
    inner = message("same part")
    assert message("The file {file} is missing", file=inner).said(German()) == "Die Datei dasselbe Teil fehlt"
    assert joined("; ", [inner, "same part"]).said(German()) == "dasselbe Teil; same part"


def test_a_number_decides_between_singular_and_plural() -> None:
    assert [counted_message(n, "{n} line", "{n} lines") for n in (0, 1, 2)] == [
        "0 lines",
        "1 line",
        "2 lines",
    ]
    assert [counted_message(n, "{n} line", "{n} lines").said(German()) for n in (1, 2)] == [
        "1 Zeile",
        "2 Zeilen",
    ]


@given(st.text(), st.text())
def test_values_appear_unchanged_and_survive_json_and_processes(file: str, other: str) -> None:
    made = message("{other} of {file}", file=message("The file {file} is missing", file=file), other=other)
    assert made.said(German()) == f"{other} of Die Datei {file} fehlt"
    for again in (from_json(json.loads(json.dumps(made.as_json()))), pickle.loads(pickle.dumps(made))):
        assert isinstance(again, Message)
        assert (again, again.template, again.said(German())) == (made, made.template, made.said(German()))


def test_json_has_the_values_of_the_sentence_and_no_others() -> None:
    made = Message("{n} line of {file}", {"n": 2, "file": "a", "obj": "L1"}, "{n} lines")
    assert made.as_json()["values"] == {"n": 2, "file": "a"}


def test_what_is_no_stored_message_is_none() -> None:
    for stored in ("a text", None, {"template": "{a}", "values": {}}, {"template": 1, "values": {}}):
        assert from_json(stored) is None


@given(st.text(), st.text())
def test_what_another_process_sends_is_said_in_the_language_of_this_one(file: str, plain: str) -> None:
    """The reason of a file that FreeCAD could not open, say; a text of a stranger stays as it is."""
    reason = message("The file {file} is missing", file=file)
    sent = json.loads(json.dumps([carried(reason), carried(plain)]))
    read = [from_carried(one) for one in sent]
    assert read == [reason, plain]
    assert isinstance(read[0], Message)
    assert read[0].said(German()) == f"Die Datei {file} fehlt"
