# SPDX-License-Identifier: LGPL-2.1-or-later
"""A BOM on paper: all rows of a view on one page, of the draft or of a revision as it was frozen.

The *cost sheet* has mass and cost. The *traveller* goes through the workshop with the product: no cost, but
what a hand needs, and room to sign.

Paper outlives the screen: whatever is not released says so in large letters on each sheet.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Query
from markupsafe import Markup
from starlette.responses import Response

from silo.bom.errors import BusyError, ConflictError
from silo.bom.quantities import exact_product, exact_sum
from silo_server.db.transaction import Tx
from silo_server.errors import TooLargeError
from silo_server.routes.requests import NumberedRoute
from silo_server.services import releases
from silo_server.services.attachments import attachments_of
from silo_server.services.items import get_item
from silo_server.services.product.cost import bought_whole, prices_in, with_costs
from silo_server.services.product.flat import flatten
from silo_server.services.product.frozen import ProductContent, frozen_files, frozen_product
from silo_server.services.product.parts import RolledItem
from silo_server.services.product.rollup import roll_up_cost
from silo_server.services.product.summary import Summary
from silo_server.services.product.summary_make import MOST_NAMED
from silo_server.services.product.tree import levels_of
from silo_server.services.product.worth import MassAndCost
from silo_server.services.releases import Release
from silo_server.services.suppliers import rates_of
from silo_server.values import Item, Line
from silo_server.web.accounts import Reader
from silo_server.web.item_page import (
    AskedLook,
    Branch,
    Look,
    ShownStructure,
    Totals,
    cost_of_found,
    flat_page,
    structure_of,
    tree_page,
)
from silo_server.web.releases_page import STAMPS
from silo_server.web.render import Address, Page, page, segment

router = APIRouter(route_class=NumberedRoute, include_in_schema=False)

# Some 400 sheets of paper.
MOST_PRINTED = 20_000
DRAWING = "drawing"


class FrozenStructure(ShownStructure):
    """The lines of a frozen product at today's prices; nothing else is read from what the product is now."""

    def __init__(self, tx: Tx, product: ProductContent, look: Look, page_rows: int) -> None:
        graph, parts = product.graph, product.parts
        prices = prices_in(graph, parts, rates_of(tx), look.pieces)
        super().__init__(tx, graph, look, prices, page_rows)
        self.frozen_parts = parts
        self.worths = with_costs(graph, parts, product.worths, prices)

    @cached_property
    def parts(self) -> Mapping[int, RolledItem]:
        """Return the parts as they were frozen."""
        return self.frozen_parts

    def lines_of(self, item_id: int, level: int) -> Sequence[Line]:
        """Return the frozen lines; the ids of a frozen product are its own."""
        return self.graph.lines.get(item_id, ())

    def _known(self, children: Collection[int]) -> dict[int, tuple[RolledItem, MassAndCost, Summary | None]]:
        return {child: (self.parts[child], self.worths[child], None) for child in children}


@router.get("/items/{part_number}/print")
def print_page(
    call: Reader,
    part_number: str,
    look: AskedLook,
    release: Annotated[str, Query(max_length=16)] = "",
    sheet: Literal["", "traveller"] = "",
) -> Response:
    """Show the BOM for paper: all rows of the view on one page, with what a reader must know on top.

    ``release``: a revision as it was frozen. Raises NotFoundError if there is none with this label.
    """
    traveller = sheet == "traveller"
    if traveller:  # a line of a BOM has a number and a remark; a row of the flat list is of many lines
        look = replace(look, view="tree", sort="")
    with call.server.large_reads.enter(), call.read() as tx:
        item = get_item(tx, part_number, include_archived=True)
        of = releases.get_release(tx, item, release) if release else None
        shown = structure_of_release(tx, item, of, look) if of else structure_of(tx, item, look, MOST_PRINTED)
        if traveller:
            shown["drawings"] = _drawings(tx, item, of, shown["table"])
        numbered = [one for one in releases.list_releases(tx, item) if one.status in releases.NUMBERED]
        approvals = releases.approvals_of(tx, of) if of else []
        draft, now = releases.coming_label(tx, item), tx.stamp
    path = f"/items/{segment(item.part_number)}"
    view = look.address(path)
    asked = {"release": release, "sheet": sheet}
    if traveller:
        about = f"{path}/releases/{segment(of.label)}" if of else path
        shown["code"] = _code(f"{call.server.settings.public_url or ''}{about}")
    return page(
        call,
        "traveller.html" if traveller else "print.html",
        item=shown.pop("item", item),
        look=look,
        at=view,
        of=of,
        approvals=approvals,
        releases=numbered,
        draft=draft,
        stamp=STAMPS[of.status if of else ""],
        here_at=Address(f"{path}/print", {**view.params, **{name: v for name, v in asked.items() if v}}),
        now=now,
        **shown,
    )


def _code(address: str) -> Markup:
    """Draw the QR code of a page's address."""
    import segno  # for paper alone: a server starts without it

    return Markup(segno.make_qr(address, error="m").svg_inline(scale=3, border=2, light="#fff"))


def _drawings(tx: Tx, item: Item, of: Release | None, table: Page[Branch] | None) -> list[Mapping[str, Any]]:
    """Find the drawings of a product and of what is in it, each as file name, revision and document."""
    if of is not None:
        return [one for one in frozen_files(tx, of.record)[1] if one["kind"] == DRAWING]
    ids = {item.id, *(row.line.child_id for row in table.rows)} if table else {item.id}
    found = [
        {
            "part_number": one.part_number,
            "document": one.id,
            "revision": one.revision_number,
            "file_name": one.file_name,
        }
        for several in attachments_of(tx, ids).values()
        for one in several
        if one.kind == DRAWING
    ]
    return sorted(found, key=lambda one: (one["part_number"], one["file_name"]))


def structure_of_release(tx: Tx, item: Item, of: Release, look: Look) -> dict[str, Any]:
    """Collect what the paper of a revision shows, as :func:`structure_of` does for the draft."""
    content = frozen_product(tx, item, of)
    values: dict[str, Any] = {"item": content.graph.root, "last": None, "gaps": (), "of_all": None}
    values |= {"problem": "", "table": None, "totals": None, "levels": 0, "depth": 0}
    try:
        counts = levels_of(content.graph)
        if not counts:
            return values
        depth = look.depth or len(counts)
        shown = FrozenStructure(tx, content, replace(look, depth=depth), MOST_PRINTED)
        table = flat_page(shown) if look.is_flat else tree_page(shown, sum(counts))[0]
        values |= {"levels": len(counts), "depth": min(depth, len(counts)), "table": table}
        return values | {"totals": _totals(tx, shown)}
    except (BusyError, ConflictError, TooLargeError) as error:
        return {**values, "problem": str(error)}


def _totals(tx: Tx, shown: FrozenStructure) -> Totals:
    """Add up what all pieces of the shown parts of a frozen product weigh and cost."""
    root, rates, pieces = shown.worths[shown.graph.root.id], rates_of(tx), shown.look.pieces
    rows = shown.found if shown.look.is_filtered else flatten(shown.graph)
    worths = [(row, shown.worths[row.line.child_id]) for row in rows]
    no_mass = [row.line.child_part_number for row, worth in worths if not worth.mass_whole or row.unit_open]
    mass = None if root.mass is None else exact_product((root.mass, pieces))
    if shown.look.is_filtered:
        masses = [exact_product((worth.mass, row.total, pieces)) for row, worth in worths if worth.mass]
        mass = exact_sum(masses) if masses else None
        cost = cost_of_found(shown, rates)
    else:
        leaves = flatten(shown.graph, bought_whole(shown.graph, shown.parts))
        cost = roll_up_cost(leaves, shown.parts, shown.prices, pieces)
    return Totals(
        mass,
        cost.totals,
        len(no_mass),
        len(cost.missing),
        sorted(no_mass)[:MOST_NAMED],
        sorted(cost.missing)[:MOST_NAMED],
    )
