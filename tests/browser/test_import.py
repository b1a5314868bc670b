# SPDX-License-Identifier: LGPL-2.1-or-later
"""Import of a CSV: files of others are understood, asked about, or refused with what to do."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect
from server_testing import Api

Visit = Callable[..., Page]


def check(page: Page, text: str) -> None:
    """Choose a file with this text and have it checked."""
    file = {"name": "bom.csv", "mimeType": "text/csv", "buffer": text.encode()}
    page.get_by_label("CSV file or workbook").set_input_files([file])  # type: ignore[list-item]
    page.get_by_role("button", name="Check the file").click()
    expect(page.locator("#checked, [role=alert]")).to_be_visible()


@pytest.mark.parametrize("script", [True, False])
def test_columns_are_chosen_by_hand(api: Api, visit: Visit, script: bool) -> None:
    """A header in no language that we know: the message says what is missing, and the columns are chosen."""
    parent, one, other = api.items(3)
    page = visit("editor", java_script_enabled=script)
    page.goto(f"/items/{parent}/import")
    # Columns that were chosen once are remembered for files with the same headings.
    headings = "Číslo;Kolik;Pozn" if script else "Prvek;Kolik;Pozn"
    check(page, f"Bill of the day;;\n{headings}\n{one};1.250;abc\n{other};3;\n")
    expect(page.get_by_role("alert")).to_contain_text("File: found no header line")
    page.get_by_label("Separated by").select_option("semicolons")
    page.get_by_label("Header").select_option(index=1)
    page.get_by_role("button", name="Check again").click()
    expect(page.get_by_role("alert")).to_contain_text("File: choose the column of Part number, Quantity")
    page.get_by_label("Part number choose").select_option(index=1)
    page.get_by_label("Quantity").select_option(index=2)
    page.get_by_label("Notes").select_option(index=3)
    page.get_by_role("button", name="Check again").click()
    # "1.250" in a file with semicolons can be read two ways.
    expect(page.locator("#checked")).to_contain_text("1 row has a problem")
    expect(page.locator("main")).to_contain_text("1250 or 1.25")
    if script:
        page.get_by_text("How this file is read").click()
    else:
        page.locator("details.reading summary").click()
    page.get_by_label("Numbers such as 1,000").select_option(",")
    page.locator("details.reading").get_by_role("button", name="Check again").click()
    expect(page.locator("#checked")).to_contain_text("2 to add")
    assert api.lines(parent) == {}
    page.get_by_role("button", name="Import 2 rows").click()
    expect(page.locator(".notice")).to_contain_text("2 added")
    assert api.quantities(parent) == {one: 1250, other: 3}
    assert api.lines(parent)[one]["notes"] == "abc"
    page.locator(".notice").get_by_role("button", name="Undo").click()
    expect(page.locator(".notice")).to_contain_text("Undone")
    assert api.lines(parent) == {}


def test_what_an_import_must_not_do_is_said_in_the_check(api: Api, visit: Visit) -> None:
    """The assembly in itself, what contains it, a flat export, a missing column."""
    top, sub, part = api.items(3)
    api.merge(sub, {part: 2})
    api.merge(top, {sub: 3})
    page = visit("editor")
    page.goto(f"/items/{sub}/import")
    check(page, f"Part No.,Qty\n{sub},1\n{top},1\n{part},5\n")
    expect(page.locator("#checked")).to_contain_text("2 rows have problems")
    expect(page.locator("main")).to_contain_text("the assembly itself")
    expect(page.locator("main")).to_contain_text(f"{sub} → {top} → {sub}")
    check(page, f"PN,Unit\n{part},m\n")
    expect(page.get_by_role("alert")).to_contain_text("there is no column 'Quantity'")
    flat = api.call("GET", f"/api/items/{top}/bom/export.csv?view=flat").body.decode()
    page.goto(f"/items/{top}/import")
    check(page, flat)
    expect(page.get_by_role("alert")).to_contain_text("flat export")
    assert api.quantities(top) == {sub: 3}
    check(page, f"PN,Qty,Quantity\n{sub},3,4\n")
    expect(page.get_by_role("alert")).to_contain_text("'Quantity' and 'Qty' both mean the quantity")
    page.locator("[name=column_quantity]").select_option(index=2)
    page.get_by_role("button", name="Check again").click()
    expect(page.locator("#checked")).to_contain_text("nothing to do")
    check(page, f"PN,Qty\n{sub},3\n")
    expect(page.locator("#checked")).to_contain_text("nothing to do")
