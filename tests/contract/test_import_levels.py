# SPDX-License-Identifier: LGPL-2.1-or-later
"""The import of a BOM with levels: each assembly's lines, in one transaction; what is left out and what is
missing.
"""

from __future__ import annotations

from server_testing import Api, bom


def test_a_file_with_levels_builds_the_tree(api: Api) -> None:
    """By positions; the parts are made on the way; the same file again changes nothing."""
    top = api.item(item_type="assembly")
    text = (
        f"Pos.;Artikelnummer;Name;Menge\n1;S-{top};Frame;2\n1.1;P-{top};Plate;3\n2;Q-{top};Cover;1\n".encode()
    )
    done = api.good("POST", bom(top, "import?make=M01"), body=text)
    assert done["counts"]["add"] == 3
    assert [(row["parent"], row["depth"]) for row in done["rows"]] == [(top, 0), (f"S-{top}", 1), (top, 0)]
    assert api.quantities(top) == {f"S-{top}": 2, f"Q-{top}": 1}
    assert api.quantities(f"S-{top}") == {f"P-{top}": 3}
    again = api.good("POST", bom(top, "import"), body=text)
    assert again["counts"] == {"add": 0, "change": 0, "same": 3, "skip": 0, "error": 0}


def test_an_assembly_that_stands_there_twice_has_one_bom(api: Api) -> None:
    """The same rows once more are left out by name; other values are a problem."""
    top, sub, other, part = api.items(4)
    rows = [f"1,{sub},1", f"2,{part},4", f"1,{other},1", f"2,{sub},2", f"3,{part},4"]
    text = "\n".join(["Level,PN,Qty", *rows, ""])
    plan = api.good("POST", bom(top, "import?dry_run=1"), body=text.encode())
    assert [row["status"] for row in plan["rows"]] == ["add", "add", "add", "add", "skip"]
    assert plan["rows"][4]["why"] == "the same as row 3"
    wrong = api.good(
        "POST", bom(top, "import?dry_run=1"), body=text.replace(f"3,{part},4", f"3,{part},5").encode()
    )
    assert "an assembly has one BOM" in wrong["problems"][0]
    api.good("POST", bom(top, "import"), body=text.encode())
    assert (api.quantities(sub), api.quantities(other)) == ({part: 4}, {sub: 2})


def test_a_file_cannot_make_a_ring_of_its_own(api: Api) -> None:
    """Silo knows neither edge yet; nothing is written."""
    top, one, two = api.items(3)
    text = f"Level,PN,Qty\n1,{one},1\n2,{two},1\n3,{one},1\n".encode()
    assert "contains its own assembly" in api.bad(400, "POST", bom(top, "import"), body=text)["message"]
    assert api.lines(top) == api.lines(one) == {}


def test_the_row_of_the_product_itself_is_the_top(api: Api) -> None:
    """Some programs write it on level 0."""
    top, part = api.items(2)
    api.good("POST", bom(top, "import"), body=f"Level,PN,Qty\n0,{top},1\n1,{part},3\n".encode())
    assert api.quantities(top) == {part: 3}


def test_what_is_below_a_row_that_is_left_out_is_left_out_too(api: Api) -> None:
    """With both reasons, and no other BOM changes."""
    top, sub, part = api.items(3)
    text = f"Level,PN,Qty,DNP\n1,{sub},1,yes\n2,{part},3,\n".encode()
    done = api.good("POST", bom(top, "import"), body=text)
    assert [row["why"] for row in done["rows"]] == [
        "not fitted: DNP is 'yes'",
        "stands below a row that is left out",
    ]
    assert api.lines(top) == api.lines(sub) == {}


def test_our_indented_export_imported_again_changes_nothing(api: Api) -> None:
    """All of its levels are compared."""
    top, sub, part = api.items(3)
    api.merge(sub, {part: 3})
    api.merge(top, {sub: 2})
    data = api.call("GET", bom(top, "export.csv?view=indented")).body
    done = api.good("POST", bom(top, "import"), body=data)
    assert done["counts"] == {"add": 0, "change": 0, "same": 2, "skip": 0, "error": 0}


def test_lines_that_the_file_does_not_have_are_listed_and_removed_on_request(api: Api) -> None:
    """Kept unless the user says otherwise; one change takes all back."""
    top, one, two = api.items(3)
    api.add_line(top, one, quantity=1)
    api.add_line(top, two, quantity=2)
    text = f"PN,Qty\n{one},1\n".encode()
    plan = api.good("POST", bom(top, "import"), body=text)
    assert [(line["parent"], line["part_number"]) for line in plan["missing"]] == [(top, two)]
    assert (plan["removed"], api.quantities(top)) == (0, {one: 1, two: 2})
    plan = api.good("POST", bom(top, "import?remove=1"), body=text)
    assert (plan["removed"], api.quantities(top)) == (1, {one: 1})
    assert "1 removed" in api.get(bom(top, "history"))[0]["summary"]


def test_a_quantity_that_the_designators_contradict_is_a_question(api: Api) -> None:
    """It counts if the user says so; a line that Silo has as it is asks nothing."""
    top, part = api.items(2)
    text = f'PN,Ref,Qty\n{part},"R1,R2",3\n'.encode()
    assert "designators name 2" in api.bad(400, "POST", bom(top, "import"), body=text)["message"]
    api.good("POST", bom(top, "import?quantities=1"), body=text)
    assert api.quantities(top) == {part: 3}
    assert api.good("POST", bom(top, "import"), body=text)["counts"]["same"] == 1


def test_columns_that_are_not_used_are_in_the_answer(api: Api) -> None:
    """Of a BOM and of a price list."""
    top, part = api.items(2)
    plan = api.good("POST", bom(top, "import"), body=f"PN,Qty,Overage\n{part},1,5%\n".encode())
    assert plan["unused_columns"] == ["Overage"]
    text = f"PN,Supplier,Price per 100,Rating\n{part},W,12,good\nTotal,,12,\n".encode()
    answer = api.good("POST", "/api/suppliers/import", body=text)
    assert (answer["unused_columns"], answer["left_out"]) == (
        ["Rating"],
        [{"row": 3, "why": "a sum, no part"}],
    )
    (offer,) = api.get(f"/api/items/{part}/suppliers")["supplier_parts"]
    assert offer["prices"] == [{"quantity": "1", "price": "0.12"}]
