# SPDX-License-Identifier: LGPL-2.1-or-later
"""Items: identity, numbers, search, change, archive."""

from __future__ import annotations

import hashlib
import json
import threading
import uuid
from typing import Any
from urllib.parse import quote

import pytest
from hunting import BOTH, examples
from hypothesis import given, settings
from hypothesis import strategies as st
from model_file import model_file
from server_testing import Api, bom
from web_visitor import enter

from silo.api.wire import ItemTexts
from silo.bom.text import character_problem
from silo_server.services.search import words_of


def test_an_item_gets_a_number_of_its_category(api: Api) -> None:
    """``kindred-rd``: category and a 4-digit serial, counted per category."""
    made = api.good("POST", "/api/items", {"schema": "kindred-rd", "category": "F03", "description": "Eye"})
    again = api.good("POST", "/api/items", {"schema": "kindred-rd", "category": "f03", "name": "Eye 2"})
    assert made["part_number"] == "F03-0001"
    assert again["part_number"] == "F03-0002"
    assert (made["name"], made["description"], made["item_type"]) == ("Eye", "Eye", "part")
    assert uuid.UUID(made["id"])


def test_the_category_says_the_type(api: Api) -> None:
    """A01 is an assembly unless the request says otherwise."""
    made = api.good("POST", "/api/items", {"category": "A02", "name": "Robot"})
    assert made["item_type"] == "assembly"
    made = api.good("POST", "/api/items", {"category": "A02", "name": "Robot", "item_type": "tool"})
    assert made["item_type"] == "tool"


def test_a_taken_number_is_jumped_over(api: Api) -> None:
    """An explicit number in the way leaves a gap, never an error."""
    api.item("F09-0001")
    api.item("F09-0002")
    assert api.good("POST", "/api/items", {"category": "F09", "name": "Rivet"})["part_number"] == "F09-0003"


@BOTH
def test_many_at_once_get_different_numbers(api: Api) -> None:
    """Numbers are unique however many ask at the same moment."""
    numbers: list[str] = []

    def make() -> None:
        mine = api.as_(api.token)
        for _ in range(5):
            made = mine.good("POST", "/api/items", {"category": "C01", "name": "Glue"})
            numbers.append(made["part_number"])

    threads = [threading.Thread(target=make) for _ in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(numbers) == [f"C01-{n:04d}" for n in range(1, 31)]


def test_numbers_are_unique_whatever_their_case(api: Api) -> None:
    """409 for a number that is there already."""
    number = api.item()
    error = api.bad(409, "POST", "/api/items", {"part_number": number.swapcase(), "name": "x"})
    assert error["error"] == "duplicate"


def test_a_number_can_be_seen_and_stands_in_one_line(api: Api) -> None:
    """What has no picture or several lines is no part number; blanks, dots, slashes and any letters may."""
    for number in ("", " ", "a\nb", "a\tb", "x" * 65):
        api.bad(400, "POST", "/api/items", {"part_number": number, "name": "x"})
    number = api.item(f"Ä 12.5 +x {uuid.uuid4().hex[:6]}")
    assert api.get("/api/items/" + quote(number))["part_number"] == number


def test_an_id_that_is_no_uuid_is_refused(api: Api) -> None:
    """400 that names the field; no item with another identity is made behind the client's back."""
    name = uuid.uuid4().hex
    for nonsense in ("", "M01-0001", 5):
        error = api.bad(400, "POST", "/api/items", {"id": nonsense, "category": "M01", "name": name})
        assert "id: " in error["message"]
    assert api.get(f"/api/items/search?q={name}") == []


def test_an_id_of_another_item_is_a_conflict(api: Api) -> None:
    """409 that names the item which has it; in any written form of the UUID."""
    number = api.item()
    identity = api.get(f"/api/items/{number}")["id"]
    error = api.bad(
        409, "POST", "/api/items", {"id": identity.upper(), "part_number": "T-" + uuid.uuid4().hex}
    )
    assert number in error["message"]
    api.bad(409, "POST", "/api/items", {"id": identity, "part_number": number.lower()})


def test_an_id_of_an_archived_item_is_a_conflict(api: Api) -> None:
    """It is not handed out as if it were in use; after it was brought back, the repeat finds it."""
    body = {"id": str(uuid.uuid4()), "category": "M01", "name": "Bracket"}
    number = api.good("POST", "/api/items", body)["part_number"]
    api.good("DELETE", f"/api/items/{number}")
    assert "archived" in api.bad(409, "POST", "/api/items", body)["message"]
    api.good("POST", f"/api/items/{number}/unarchive")
    assert api.call("POST", "/api/items", body).status == 200


@BOTH
def test_look_alikes_of_many_components_in_one_request(api: Api) -> None:
    """By name as people read it or by file; each answer at its question's place; archived items are none."""
    word = uuid.uuid4().hex[:8]
    digest = hashlib.sha256(model_file(word.encode())).hexdigest()
    named, archived, uploaded = (
        api.item(f"{word}-{kind}", name=name)
        for kind, name in (("N", f"Größe {word}"), ("A", f"Größe {word}"), ("U", "third"))
    )
    registered = api.item(f"{word}-R", name="other", properties={"file_sha256": digest.upper()})
    api.good("DELETE", f"/api/items/{archived}")
    api.upload(uploaded, model_file(word.encode()), "Part.FCStd")
    wanted = [
        {"name": f"GRÖSSE_{word}.FCStd", "sha256": ""},
        {"name": "nothing like it " + word},
        {"name": f"größe {word}", "sha256": digest},
        {"name": "", "sha256": ""},
    ]
    found = api.good("POST", "/api/items/look-alikes", {"wanted": wanted})["look_alikes"]
    assert [[(one["part_number"], one["same_file"]) for one in likes] for likes in found] == [
        [(named, False)],
        [],
        [(registered, True), (uploaded, True), (named, False)],
        [],
    ]
    assert api.good("POST", "/api/items/look-alikes", {"wanted": []}) == {"look_alikes": []}
    api.bad(400, "POST", "/api/items/look-alikes", {"wanted": wanted * 251})


@BOTH
def test_search_and_paging(api: Api) -> None:
    """Every word must be somewhere in number, name or description; the total is in a header."""
    word = uuid.uuid4().hex[:8]
    for n in range(5):
        api.item(f"S-{word}-{n}", name=f"Hex bolt {n}", description="zinc", item_type="tool")
    answer = api.call("GET", f"/api/items?search=BOLT+{word}&limit=2&offset=1")
    assert [item["part_number"] for item in answer.json()] == [f"S-{word}-1", f"S-{word}-2"]
    assert answer.headers["x-total-count"] == "5"
    assert len(api.get(f"/api/items/search?q={word}+zinc")) == 5
    assert api.get(f"/api/items?search={word}&item_type=part") == []
    # Neither is a wildcard; both only part words.
    assert api.get(f"/api/items?search={word}%25zz") == []
    assert api.get(f"/api/items?search={word}_zz") == []
    assert api.get("/api/items?search=%25") == []


@BOTH
def test_a_part_number_of_signs_alone_can_be_kept_and_found_by_its_name(api: Api) -> None:
    """There is no word in it, so the index has none of it."""
    for sign in ("~", "+-+", "…", "½", "𦸉", "+="):
        name = "n" + uuid.uuid4().hex[:8]
        api.call("POST", "/api/items", {"part_number": sign * 2, "name": name})
        assert len(api.get(f"/api/items?search={name}")) == 1


@BOTH
def test_search_ranks_and_knows_what_people_type(api: Api) -> None:
    """Numbers without dashes, parts of words, accents, supplier and its number, file names; best first."""
    word = "q" + uuid.uuid4().hex[:8]
    supplier = {
        "supplier": f"Schräubli {word}",
        "supplier_part_number": f"91290-A{word}",
        "list": [{"a": word}],
    }
    numbers = [f"{word}-10", f"A{word}-1", f"B-{word[:4]}", "C-" + word[5:], f"D{word}"[:20]]
    api.item(numbers[0], name="Zylinderschraube Größe ½")
    api.item(numbers[2], name=f"x{word}x")
    api.item(numbers[3], description=f"beside {word}")
    api.item(numbers[4] + "-S", properties=supplier)
    api.upload(api.item(numbers[1]), name=f"Halter {word}.FCStd")

    def found(query: str) -> list[str]:
        return [item["part_number"] for item in api.get(f"/api/items/search?q={quote(query)}")]

    assert found(f"{word}10") == [numbers[0]]
    assert found(f"{word}-10")[0] == numbers[0]
    # In the number first, then in the name, then in all else.
    assert found(word) == [*sorted([numbers[0], numbers[1], numbers[4] + "-S"]), numbers[2], numbers[3]]
    assert found(f"{word} schraube") == [numbers[0]]
    assert found(f"{word} grosse") == found(f"GRÖSSE {word.upper()}") == [numbers[0]]
    assert found(f"{word} schraubli") == [numbers[4] + "-S"]
    assert found(f"91290A{word}") == found(f"91290-a{word}") == [numbers[4] + "-S"]
    assert found(f"halter {word}") == [numbers[1]]
    # One letter is the beginning of a number.
    letters = {item["part_number"][0].lower() for item in api.get("/api/items/search?q=A&limit=1000")}
    assert letters == {"a"}
    # What was changed is found by the new words, and by the old ones no more.
    api.good("PUT", f"/api/items/{numbers[0]}", {"name": "Mutter"})
    assert found(f"{word} mutter") == [numbers[0]]
    assert found(f"{word} schraube") == []
    api.good("DELETE", f"/api/items/{numbers[0]}")
    assert found(f"{word} mutter") == []


@BOTH
def test_no_query_is_an_error(api: Api) -> None:
    """What is syntax to a database is only a text here."""
    api.item()
    for query in ('"', "'", "' OR 1=1", "a:* & !", "NEAR(", "{number}: x", "*", "\\", "Ａ", "ﬁ", "\u202e"):
        assert isinstance(api.get(f"/api/items/search?q={quote(query)}"), list)


@BOTH
@given(name=st.text(min_size=1, max_size=40))
@settings(max_examples=examples(20))
def test_an_item_is_found_by_each_word_of_its_name(api: Api, name: str) -> None:
    """Whatever the script: what the index has is what the query asks for, on both databases."""
    words = words_of(name)
    if not words or character_problem(name):
        return
    mark = "m" + uuid.uuid4().hex[:10]
    answer = api.call("POST", "/api/items", {"part_number": mark, "name": name})
    if answer.status == 201:
        for query in [*words[:5], name]:
            assert [i["part_number"] for i in api.get(f"/api/items/search?q={mark}%20{quote(query)}")] == [
                mark
            ]


def test_archiving_is_no_deleting(api: Api) -> None:
    """An archived item is not found, keeps its number and its place in BOMs, and can come back."""
    parent, child = api.items(2)
    api.merge(parent, {child: 1})
    api.good("DELETE", f"/api/items/{child}")
    api.bad(404, "GET", f"/api/items/{child}")
    api.bad(409, "POST", "/api/items", {"part_number": child, "name": "x"})
    assert api.lines(parent)[child]["child_archived"] is True
    assert api.good("POST", f"/api/items/{child}/unarchive")["part_number"] == child
    assert api.get(f"/api/items/{child}")["archived_at"] is None
    assert api.get(bom(child, "where-used"))[0]["parent_part_number"] == parent


@BOTH
def test_texts_that_no_database_takes_are_refused_or_kept(api: Api) -> None:
    """NUL and lone surrogates are 400 on both databases; every real text comes back as it was."""
    for escape in (b"\\u0000", b"\\ud800"):
        body = b'{"part_number": "N-1", "name": "a' + escape + b'b"}'
        api.bad(400, "POST", "/api/items", body=body, headers={"Content-Type": "application/json"})
    text = "Ünïcode 螺栓 🔩 <b>&amp;'\"\\"
    number = api.item(name=text, description=text, properties={"note": text})
    item = api.get(f"/api/items/{number}")
    assert (item["name"], item["description"], item["properties"]) == (text, text, {"note": text})


def test_unknown_schema_and_category(api: Api) -> None:
    """The message says where the known ones are."""
    api.bad(404, "POST", "/api/items", {"schema": "other", "category": "F01", "name": "x"})
    error = api.bad(400, "POST", "/api/items", {"category": "Q99", "name": "x"})
    assert "/api/schemas/kindred-rd" in error["message"]
    api.bad(400, "POST", "/api/items", {"name": "neither number nor category"})


@BOTH
def test_the_list_is_in_one_order_on_both_databases(api: Api) -> None:
    """By code point: a PostgreSQL would sort by its language else."""
    word = uuid.uuid4().hex[:8]
    for ending in ("b", "-a", "_c", "ä", "Z", "10", "9"):
        api.item(f"{word}{ending}")
    found = [item["part_number"].removeprefix(word) for item in api.get(f"/api/items?search={word}")]
    assert found == ["-a", "10", "9", "_c", "b", "Z", "ä"]


def test_a_part_number_has_no_character_that_nobody_sees(api: Api) -> None:
    """Two numbers that look the same are the same; the answer names the character. A rename too."""
    number = api.item()
    for hidden in "\u202e\u200b\u200d\ufeff\u00a0\u00ad\u2066\u3164\U000e0041":
        body = {"part_number": f"{number}{hidden}1"}
        for method, path in (("POST", "/api/items"), ("PUT", f"/api/items/{number}")):
            assert f"U+{ord(hidden):04X}" in api.bad(400, method, path, body)["message"]
    assert api.get(f"/api/items/{number}")["part_number"] == number


def test_a_change_counts_the_item_s_version_once(api: Api) -> None:
    """Also where it makes a revision, which counts the version itself; not where nothing differs."""
    name = api.item()
    for change in ({"properties": {"a": 1}}, {"description": "new"}, {"properties": {"a": 1}}):
        before = api.get(f"/api/items/{name}")
        after = api.good("PUT", f"/api/items/{name}", change)
        differs = any(before[key] != value for key, value in change.items())
        assert after["version"] == before["version"] + differs


@pytest.mark.parametrize("column", ItemTexts.model_fields)
def test_a_text_column_goes_through_every_way(api: Api, column: str) -> None:
    """Made, changed by a program and by the form, shown on the page, named by the schema."""
    new = {"category": "F01", "name": "Bolt", column: "purchased"}
    number = api.good("POST", "/api/items", new)["part_number"]
    assert api.get(f"/api/items/{number}")[column] == "purchased"
    assert api.good("PUT", f"/api/items/{number}", {"name": "Bolt 8"})[column] == "purchased"
    assert api.good("PUT", f"/api/items/{number}", {column: "manufactured"})[column] == "manufactured"
    editor = enter(api, "admin")
    page = f"/items/{number}/edit"
    before = {"name": "Bolt 8", "part_number": number, "item_type": "part", column: "manufactured"}
    was = {f"was.{name}": value for name, value in before.items()}
    assert editor.post(page, **{**before, **was, column: "purchased"}).status == 303
    assert api.get(f"/api/items/{number}")[column] == "purchased"
    assert "purchased" in editor.get(f"/items/{number}").body.decode()
    assert f'"name":"{column}"' in json.dumps(api.get("/api/schemas/kindred-rd/form"), separators=(",", ":"))
    too_long = api.bad(400, "PUT", f"/api/items/{number}", {column: "x" * 10_001})
    assert column in str(too_long)


def test_what_cad_says_does_not_replace_a_person(api: Api) -> None:
    """Mass and material keep where they come from: hand and scale win over CAD, CAD over CAD."""
    number = api.item()

    def say(source: str, **facts: object) -> dict[str, Any]:
        path = f"/api/items/{number}/properties?source={source}"
        told: dict[str, Any] = api.good("PATCH", path, facts)
        return told

    assert "origins" not in api.get(f"/api/items/{number}")
    made = say("cad", mass_kg=1.5, volume_m3=0.0002, colour="red")
    assert {name: one["source"] for name, one in made["origins"].items()} == {
        "mass_kg": "cad",
        "volume_m3": "cad",
    }
    assert say("cad", mass_kg=1.6)["properties"]["mass_kg"] == 1.6
    weighed = say("scale", mass_kg=1.55)
    assert weighed["origins"]["mass_kg"]["source"] == "scale"
    again = say("cad", mass_kg=1.7, volume_m3=0.0003)
    assert (again["properties"]["mass_kg"], again["properties"]["volume_m3"]) == (1.55, 0.0003)
    assert again["origins"]["mass_kg"] == weighed["origins"]["mass_kg"]
    assert say("hand", mass_kg=None)["origins"].keys() == {"volume_m3"}
    assert say("cad", mass_kg=1.7)["origins"]["mass_kg"]["source"] == "cad"
    typed = api.good("PUT", f"/api/items/{number}", {"properties": {"mass_kg": 2}})
    assert typed["origins"]["mass_kg"]["source"] == "hand"
    whole = {"properties": {"mass_kg": 3, "material": "Steel"}, "source": "cad"}
    assert api.good("PUT", f"/api/items/{number}", whole)["properties"] == {"mass_kg": 2, "material": "Steel"}
    assert api.bad(400, "PUT", f"/api/items/{number}", {**whole, "source": "guess"})


def test_the_content_of_a_file_is_no_property(api: Api) -> None:
    """What an older program sends at the registration finds the item, and is shown nowhere."""
    digest = uuid.uuid4().hex * 2
    number = api.item(properties={"file_sha256": digest.upper(), "finish": "raw"})
    assert api.get(f"/api/items/{number}")["properties"] == {"finish": "raw"}
    assert [one["part_number"] for one in api.get(f"/api/items/search?q={digest}")] == [number]
