# SPDX-License-Identifier: LGPL-2.1-or-later
"""Numbers, times and changes in plain words."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import pytest

from silo_server.events.log import LoggedEvent
from silo_server.values import LineState
from silo_server.web.activity_page import entry_of
from silo_server.web.line_form import changes
from silo_server.web.render import (
    arranged,
    bdi,
    closed,
    isolate,
    language_for,
    mass,
    money,
    quantity,
    segment,
    sentence,
    size,
    translated,
    when,
)

LINE = LineState(4.0, "assembly")


@pytest.mark.parametrize(
    ("value", "unit", "words"),
    [
        (12.0, None, "12"),
        (2.5, "m", "2.5 m"),
        (0.02, "l", "0.02 l"),
        (1_000_000.0, None, "1000000"),
        (0.1 + 0.2, None, "0.3"),
        (1e9, None, "1000000000"),
        (None, None, "–"),
    ],
)
def test_quantities_read_as_people_write_them(value: float | None, unit: str | None, words: str) -> None:
    """A count is a count, nothing is rounded away that counts, no exponent for what a BOM holds."""
    assert quantity(value, unit) == words


def test_small_words() -> None:
    """Sizes, times with their machine form, part numbers in a path."""
    assert (size(812), size(14_300), size(3_200_000), size(None)) == ("812 bytes", "14 kB", "3.2 MB", "")
    assert when("2026-02-08T22:15:00.123456Z") == (
        '<time datetime="2026-02-08T22:15:00.123456Z">2026-02-08 22:15</time>'
    )
    assert when(None) == "–"
    assert segment("A/B 1#") == "A~2FB%201%23"


@pytest.mark.parametrize(
    ("kilograms", "words"),
    [
        (20_700.0, "20.7 t"),
        (1_234_567.0, "1\u202f235 t"),
        (999.96, "1 t"),
        (123.456, "123.5 kg"),
        (0.9999999, "1 kg"),
        (0.5, "500 g"),
        (1e-6, "0.001 g"),
        (0, "0 kg"),
        (None, "–"),
    ],
)
def test_masses_read_as_people_write_them(kilograms: float | None, words: str) -> None:
    """The unit that fits, four digits, groups of three, and never an exponent."""
    assert mass(kilograms) == words


@pytest.mark.parametrize(
    ("amount", "words"),
    [
        (12.0, "12.00 EUR"),
        (12_345.6, "12\u202f345.60 EUR"),
        (0.0042, "0.0042 EUR"),
        (0.15, "0.15 EUR"),
        (0, "0.00 EUR"),
        (None, "–"),
    ],
)
def test_costs_have_cents_and_groups(amount: float | None, words: str) -> None:
    """Two decimals; a screw for less than a cent keeps its digits."""
    assert money(amount, "EUR") == words


def test_text_that_turns_ends_where_it_ends() -> None:
    """Overrides are left out, isolates are closed, stray ends are left out; what is left is as it was."""
    assert closed("\u2069\u202eabc\u2067") == "abc\u2067\u2069"
    assert closed("\u2068a\u2069 b\u202c") == "\u2068a\u2069 b"
    assert bdi("<b>\u202e") == "<bdi>&lt;b&gt;</bdi>"
    assert isolate("M8 bolt") == "M8 bolt"
    assert isolate("\u05d0\u202e1") == "\u2068\u05d01\u2069"


@pytest.mark.parametrize(
    ("after", "said"),
    [
        (replace(LINE, quantity=6.0), ["quantity 4 → 6"]),
        (replace(LINE, unit="m"), ["quantity 4 → 4 m"]),
        (replace(LINE, unreferenced_since="2026"), ["no longer referenced by the assembly"]),
        (replace(LINE, source="manual", reason="glue"), ["now a manual line", "reason: glue"]),
        (replace(LINE, notes="x"), ["notes none → “x”"]),
        (replace(LINE, reference_designators=("R1", "R2")), ["reference designators none → R1 R2"]),
        (LINE, []),
    ],
)
def test_what_differs_between_two_states(after: LineState, said: list[str]) -> None:
    """Each difference in words, and nothing where there is none."""
    assert changes(LINE, after) == said


def test_a_line_that_comes_back() -> None:
    """Unreferenced before, referenced now; owned by the assembly again."""
    gone = replace(LINE, unreferenced_since="2026")
    assert changes(gone, LINE) == ["referenced again"]
    # A person keeps it: no component uses it for that.
    before = replace(gone, source="assembly")
    assert changes(before, replace(LINE, source="manual")) == ["now a manual line"]
    assert changes(replace(LINE, source="manual"), LINE) == ["owned by the assembly again"]


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("item.created", {"part_number": "A", "name": "Bolt"}, "registered"),
        ("item.deleted", {"part_number": "A"}, "archived"),
        ("revision.created", {"part_number": "A", "revision_number": 2, "comment": "x"}, "revision 2: x"),
        ("server.state", {"mode": "read-only"}, "The server takes no changes at the moment"),
        ("server.state", {"mode": "normal"}, "The server takes changes again"),
        ("something.new", {}, "something.new"),
    ],
)
def test_events_in_words(name: str, data: dict[str, object], words: str) -> None:
    """Each kind of event has its words; an unknown one shows its name."""
    entry = entry_of(LoggedEvent(1, name, json.dumps(data), "2026-02-08T22:15:00.000000Z"))
    assert (entry.words, entry.item_name) == (words, data.get("name", ""))


def test_a_merge_has_its_counts() -> None:
    """Added, changed, unreferenced, to decide; a merge that changed nothing says that."""
    data = {
        "item": "A/1",
        "user": "designer",
        "diff": {"added": [1], "quantity_changed": [1, 2], "removed": [1]},
        "warnings": [{"type": "unreferenced"}, {"type": "conflict"}],
    }
    entry = entry_of(LoggedEvent(1, "bom_merge", json.dumps(data), "2026"))
    assert [(mark, count) for mark, count, _ in entry.counts] == [
        ("added", 1),
        ("changed", 2),
        ("warn", 1),
        ("conflict", 1),
    ]
    assert (entry.link, entry.user) == ("/items/A~2F1/bom", "designer")
    assert entry_of(LoggedEvent(1, "bom_merge", '{"item": "A", "diff": {}}', "2026")).counts[0][1] == 0


@pytest.mark.parametrize(
    ("message", "shown"),
    [
        *[("", ""), ("no file", "No file."), ("No file.", "No file."), ("which one?", "Which one?")],
        *[("a01-0001 is archived", "a01-0001 is archived."), ("'bolt' is archived?", "'bolt' is archived?")],
    ],
)
def test_a_message_is_shown_as_a_sentence(message: str, shown: str) -> None:
    """With a capital, but a part number or a name stays as it is; and one end."""
    assert sentence(message) == shown


@pytest.mark.parametrize(
    "names",
    [
        ["m3×6", "m3×10", "m10×2", "", ""],
        ["a01-0002", "a01-0010", "b1-1"],
        ["608", "608 zz", "6000", "x"],
        ["2026-02-08", "2026-02-09", "2026-11-01"],
        ["v", "v0", "v1", "v" + "9" * 5000],
    ],
)
def test_numbers_in_texts_sort_as_numbers(names: list[str]) -> None:
    """As a person lists them; texts that are not there come last, both ways."""
    keys = {"name": str}
    assert arranged(names[::-1], "name", keys) == names
    known = [name for name in names if name]
    assert arranged(names, "-name", keys) == [*known[::-1], *names[len(known) :]]


@pytest.mark.parametrize(
    ("chosen", "accepted", "language"),
    [
        ("", "", "en"),
        ("", "de", "de"),
        ("", "de-AT,de;q=0.9,en;q=0.5", "de"),
        ("", "en-US,en;q=0.9,de;q=0.8", "en"),
        ("", "fr, de;q=0.2, en;q=0.4", "en"),
        ("", "fr,de;q=0", "en"),
        ("", "de;q=x,en;q=2,;,", "en"),
        ("en", "de", "en"),
        ("de", "en", "de"),
        ("tlh", "de", "de"),
    ],
)
def test_the_language_of_a_page(chosen: str, accepted: str, language: str) -> None:
    """What a person chose, else what the browser asks for, by its weights."""
    assert language_for(chosen, accepted) == language


@pytest.mark.parametrize(
    ("template", "texts", "german"),
    [
        ("<h1>Users</h1>", ["Users"], "<h1>USERS</h1>"),
        (
            "<p>\n  Suppliers of <b>{{ item.number | bdi }}</b>, as\n of {{ now }}.</p>",
            ["Suppliers of <b>%(number)s</b>, as of %(now)s."],
            "<p>\n  SUPPLIERS OF <b>{{ item.number | bdi }}</b>, AS OF {{ now }}.</p>",
        ),
        (
            '<a href="/items">Items</a> › <a href="{{ path }}">{{ number }}</a> › BOM',
            ["Items", "BOM"],
            '<a href="/items">ITEMS</a> › <a href="{{ path }}">{{ number }}</a> › BOM',
        ),
        (
            '<b title="For {{ a["}}"] }}">{% if a > "%}" %}One <a href="{{ x }}">two</a>{% endif %}</b>',
            ["For %(a)s", "One %(link)stwo</a>"],
            '<b title="FOR {{ a["}}"] }}">{% if a > "%}" %}ONE <a href="{{ x }}">TWO</a>{% endif %}</b>',
        ),
        ('{{ secret(csrf) }}<input value="No text"{% if a %} disabled{% endif %}>{# no text #}', [], None),
        ("<code>no text</code> {{ number }} · × 12", [], None),
        ('<span aria-hidden="true">⚠</span> Open', ["Open"], '<span aria-hidden="true">⚠</span> OPEN'),
    ],
)
def test_a_template_is_translated_by_its_sentences(
    template: str, texts: list[str], german: str | None
) -> None:
    """Placeholders hold expressions and tags; the rest of the template stays as it is."""
    seen: list[str] = []

    def shout(text: str) -> str:
        seen.append(text)
        return re.sub(r"(%\(\w+\)s|<[^>]*>)|([^%<]+)", lambda part: part[1] or part[2].upper(), text)

    assert translated(template, shout) == (template if german is None else german)
    assert sorted(seen) == sorted(texts)
    assert translated(template, lambda text: text).split() == template.split()
