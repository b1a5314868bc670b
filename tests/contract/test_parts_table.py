# SPDX-License-Identifier: LGPL-2.1-or-later
"""The list of parts as a table: in with own numbers, out again, and in once more as an update with
differences.
"""

from __future__ import annotations

from server_testing import Api

IMPORT = "/api/items/import"


def test_parts_come_in_and_go_out_and_come_in_again(api: Api) -> None:
    """Numbers, texts and makers are kept as they are; the export changes nothing."""
    mark = api.item()
    text = (
        "IPN;Name;Description;Category;Purchaseable;Notes;Manufacturer;MPN;In Stock\n"
        f"00123-{mark};Träger „groß“;½ hart;F01;True;Zeile 1;SKF;6004;3\n"
        f"=SUM-{mark};Blech;;M01;False;;;;\n"
    )
    checked = api.good("POST", f"{IMPORT}?dry_run=1", body=text.encode())
    assert (checked["counts"]["add"], checked["unused_columns"]) == (2, ["In Stock"])
    api.bad(404, "GET", f"/api/items/00123-{mark}")
    api.good("POST", IMPORT, body=text.encode())
    item = api.get(f"/api/items/00123-{mark}")
    assert (item["name"], item["description"], item["category"]) == ("Träger „groß“", "½ hart", "F01")
    assert (item["sourcing_type"], item["long_description"]) == ("purchased", "Zeile 1")
    assert item["properties"] == {"manufacturer": "SKF", "manufacturer_part_number": "6004"}
    assert api.good("POST", IMPORT, body=text.encode())["counts"]["same"] == 2
    sent = api.call("GET", "/api/items/export.csv").body
    counts = api.good("POST", IMPORT, body=sent)["counts"]
    assert counts == {"add": 0, "change": 0, "same": sent.decode().count("\n") - 1, "skip": 0, "error": 0}


def test_an_update_shows_its_differences(api: Api) -> None:
    """An empty cell changes nothing."""
    number = api.item(name="Plate", description="of steel")
    text = f"Part number,Name,Description\n{number},Big plate,\n".encode()
    (row,) = api.good("POST", IMPORT, body=text)["rows"]
    assert (row["status"], row["changes"]) == ("change", {"name": {"before": "Plate", "after": "Big plate"}})
    item = api.get(f"/api/items/{number}")
    assert (item["name"], item["description"]) == ("Big plate", "of steel")


def test_what_would_be_guessed_is_a_question(api: Api) -> None:
    """A number that stands there twice, and a category that decides a number; then nothing is written."""
    mark = api.item()
    text = (
        f"Part number,Name,Category\nX-{mark},one,F01\nx-{mark},two,F01\n,three {mark},Normteile/Schrauben\n"
    )
    problems = api.bad(400, "POST", IMPORT, body=text.encode())["problems"]
    assert ["more than once" in problem for problem in problems] == [True, True, False]
    assert "there is no category 'Normteile/Schrauben'" in problems[2]
    api.bad(404, "GET", f"/api/items/X-{mark}")
    named = f"Name,Category\nthree {mark},Normteile/Schrauben\n".encode()
    assert api.good("POST", f"{IMPORT}?category=F01", body=named)["counts"]["add"] == 1
    # A row without a number is the item of its name.
    assert api.good("POST", IMPORT, body=named)["counts"]["same"] == 1
