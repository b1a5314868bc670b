# SPDX-License-Identifier: LGPL-2.1-or-later
"""Finding items, and one item with all that is known of it: BOM, totals, revisions, where-used.

A BOM over all levels as a table: which rows of the tree are open, and its flat list.

Only what is open is walked, so that a tree with a million occurrences costs what is looked at of it.
"""

from __future__ import annotations

import hashlib
import secrets
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from decimal import Decimal
from functools import cache, cached_property
from itertools import accumulate, islice
from typing import Annotated, Any, Literal, NamedTuple, TypeVar

from fastapi import APIRouter, Depends, Query
from starlette.responses import Response

from silo.bom.errors import BusyError, ConflictError, NotFoundError
from silo.bom.quantities import as_decimal
from silo_server.db.transaction import Tx
from silo_server.errors import TooLargeError
from silo_server.routes.items import told_of
from silo_server.routes.requests import NumberedRoute
from silo_server.schema import ITEM_TYPES
from silo_server.services import documents, revisions
from silo_server.services.attachments import attachments_of
from silo_server.services.bom.last_sync import in_sentences, last_sync
from silo_server.services.bom.lines import lines_of_many
from silo_server.services.documents import documents_holding, get_document
from silo_server.services.following import is_followed
from silo_server.services.items import ItemQuery, get_item, list_items
from silo_server.services.looks import last_look
from silo_server.services.product.amounts import Exact, product, totals_of
from silo_server.services.product.cost import (
    PartCost,
    ProductCost,
    at_prices,
    bought_whole,
    own_worth,
    part_cost,
    prices_in,
    shown_worth,
)
from silo_server.services.product.flat import FlatRow, flatten, leaves_in
from silo_server.services.product.graph import MAX_DEPTH, Graph, load_graph
from silo_server.services.product.line_filter import found_parts, leading_to, sought
from silo_server.services.product.parts import RolledItem, parts_of, some_parts
from silo_server.services.product.rollup import CostRollup, roll_up_cost, roll_up_mass
from silo_server.services.product.summary import Summary
from silo_server.services.product.summary_make import MOST_NAMED
from silo_server.services.product.summary_read import (
    at_once,
    marks_of,
    prices_besides,
    product_cost,
    standing_alone,
    summaries,
    summary_of,
)
from silo_server.services.product.where_used import use_counts, where_used
from silo_server.services.product.worth import MassAndCost, in_unit_of
from silo_server.services.scheme import scheme_of
from silo_server.services.suppliers import rates_of
from silo_server.values import Item, Line
from silo_server.web.accounts import Reader
from silo_server.web.attachments import kind_words
from silo_server.web.item_edit_page import shown_properties
from silo_server.web.releases_page import state_of
from silo_server.web.render import PAGE_ROWS, Address, Page, _, arranged, page, page_of, segment

# No reader pages through more open rows than this; a filter or fewer levels bring them down.
MOST_OPEN = 20_000
# A filter and the flat list read all lines of a product, up to so many.
MOST_READ = 20_000
MOST_PIECES = 1_000_000


@dataclass(frozen=True)
class Look:
    """The part of the address that says how a BOM over all levels is shown.

    depth
        levels that are open (0: as many as fit on a page); ``flip`` names the branches that are not so.
    pieces
        for how many of the assembly the quantities are.
    beside
        the part number of an item that is shown beside the table.
    """

    view: Literal["tree", "flat"] = "tree"
    q: Annotated[str, Query(max_length=200)] = ""
    type: Annotated[str, Query(max_length=20)] = ""
    sort: Annotated[str, Query(max_length=20)] = ""
    page: Annotated[int, Query(ge=1, le=10**9)] = 1
    depth: Annotated[int, Query(ge=0, le=MAX_DEPTH)] = 0
    flip: Annotated[str, Query(max_length=20_000)] = ""
    pieces: Annotated[int, Query(ge=1, le=MOST_PIECES)] = 1
    beside: Annotated[str, Query(max_length=64)] = ""

    @property
    def is_flat(self) -> bool:
        return self.view == "flat"

    @property
    def is_filtered(self) -> bool:
        return bool(self.q or self.type)

    @property
    def flips(self) -> list[str]:
        """List the branches that are not as ``depth`` says."""
        return list(dict.fromkeys(filter(None, self.flip.split(","))))

    def address(self, path: str) -> Address:
        """Return the address of the page with this view."""
        values = {field.name: (getattr(self, field.name), field.default) for field in fields(self)}
        return Address(path, {name: str(value) for name, (value, usual) in values.items() if value != usual})

    def flipped(self, key: str) -> str:
        """Return ``flip`` with this branch the other way round."""
        keys = self.flips
        return ",".join(name for name in keys if name != key) if key in keys else ",".join([*keys, key])


@dataclass(frozen=True, slots=True)
class Branch:
    """A row of the tree. ``key`` names the branch, "" if nothing is below.

    total
        of all pieces, in ``unit``, of one of which ``worth`` is; None below a line whose unit is open.
    marks
        what is open about the line, or, below a closed branch, in it.
    """

    line: Line
    part: RolledItem
    depth: int
    total: Exact | None
    unit: str | None
    worth: MassAndCost
    marks: Sequence[str] = ()
    key: str = ""
    is_open: bool = False

    @property
    def mass(self) -> Decimal | None:
        """Return the mass of all pieces [kg]."""
        return _times(self.total, self.worth.mass)

    @property
    def costs(self) -> Mapping[str, Decimal]:
        """Return the cost of all pieces, per currency."""
        costs = {currency: _times(self.total, cost) for currency, cost in self.worth.costs.items()}
        return {currency: cost for currency, cost in costs.items() if cost is not None}


def _times(total: Exact | None, value: Decimal | None) -> Decimal | None:
    return None if total is None or value is None else value * as_decimal(total)


class StructureRow(NamedTuple):
    """An open row of the tree before it is dressed; ``above``: the key of what it is in, None if it can be
    no branch.

    flat
        it is a row of the flat list, in the unit of its part.
    """

    line: Line
    depth: int
    total: Exact | None
    above: str | None = None
    is_open: bool = False
    flat: bool = False

    @property
    def unit(self) -> str | None:
        """Return the unit of the total."""
        return self.line.child_unit if self.flat else self.line.unit

    @property
    def key(self) -> str:
        """Return the key that names the branch, "" if the line can be no branch."""
        if self.above is None:
            return ""
        return hashlib.blake2b(f"{self.above} {self.line.id}".encode(), digest_size=4).hexdigest()


class ShownStructure:
    """The lines that a view of a product needs, with all that its rows show; the rest is never read.

    graph
        the levels that are open, or the whole for a filter or the flat list.
    prices
        of the product's parts whose price depends on the quantity, for all pieces.
    """

    def __init__(
        self, tx: Tx, graph: Graph, look: Look, prices: Mapping[int, PartCost], page_rows: int = PAGE_ROWS
    ) -> None:
        self._tx = tx
        self.graph = graph
        self.look = look
        self.prices = prices
        self.page_rows = page_rows
        self._lines = dict(graph.lines)
        self._worths: dict[int, MassAndCost] = {}

    @cached_property
    def parts(self) -> Mapping[int, RolledItem]:
        """Read what a filter looks in, for all of the graph."""
        return parts_of(self._tx, self.graph)

    @cached_property
    def fitting(self) -> Callable[[Line], bool]:
        """Make the test of lines for the view's filter; without a filter it reads nothing."""
        look = self.look
        return sought(look.q, look.type, self.parts) if look.is_filtered else lambda _line: True

    @cached_property
    def leaves(self) -> Sequence[FlatRow]:
        """Add up the flat list, unfiltered."""
        return flatten(self.graph)

    @cached_property
    def found(self) -> Sequence[FlatRow]:
        """Find the parts that match the filter: of the flat list, or first on each way down the tree."""
        if self.look.is_flat:
            return [row for row in self.leaves if self.fitting(row.line)]
        return found_parts(self.graph, self.fitting)

    def lines_of(self, item_id: int, level: int) -> Sequence[Line]:
        """Return the lines below a row of this level; below the open levels read them only when needed."""
        if item_id not in self._lines and level >= self.look.depth and not self.look.is_filtered:
            self._lines[item_id] = lines_of_many(self._tx, [item_id]).get(item_id, [])
        return self._lines.get(item_id, ())

    def worth(self, line: Line) -> MassAndCost:
        """Return mass and cost of one unit of a line, to sort by it."""
        if line.child_id not in self._worths:
            known = self._known({other.child_id for other in self._lines[line.parent_id]})
            self._worths |= {child: worth for child, (_part, worth, _summary) in known.items()}
        return in_unit_of(line, self._worths[line.child_id])

    def _known(self, children: Collection[int]) -> dict[int, tuple[RolledItem, MassAndCost, Summary | None]]:
        """Read each child, its mass and cost, and its summary; without a BOM it has what it states."""
        # A filter has read all of them.
        parts = self.parts if self.look.is_filtered else some_parts(self._tx, children)
        by_item = summaries(self._tx, {child for child in children if parts[child].has_bom})
        worths = {
            child: by_item[child].as_part if child in by_item else own_worth(child, parts[child])
            for child in children
        }
        self.prices = prices_besides(self._tx, worths.values(), self.prices)
        return {
            child: (parts[child], at_prices(worth, self.prices), by_item.get(child))
            for child, worth in worths.items()
        }

    def worth_of_part(self, row: FlatRow) -> MassAndCost:
        """Return mass and cost of one unit of a row of the flat list, to sort by it."""
        child = row.line.child_id
        return self._known({child})[child][1] if child not in self._worths else self._worths[child]

    def read_worths(self, rows: Sequence[FlatRow]) -> None:
        """Read mass and cost of all rows of the flat list at once, before they are sorted by it."""
        known = self._known({row.line.child_id for row in rows})
        self._worths |= {child: worth for child, (_part, worth, _summary) in known.items()}

    def dressed(self, rows: Sequence[tuple[StructureRow, Sequence[str]]]) -> list[Branch]:
        """Give the rows everything that they show; beside each row come the doubts of its line."""
        known = self._known({row.line.child_id for row, _ in rows})

        def dress(row: StructureRow, doubts: Sequence[str]) -> Branch:
            child = row.line.child_id
            part, worth, summary = known[child]
            worth = shown_worth(worth, {}, doubts) if row.flat else in_unit_of(row.line, worth)
            if summary is None:
                return Branch(row.line, part, row.depth, row.total, row.unit, worth, doubts)
            marks = [*summary.inside(child, is_open=row.is_open), *doubts]
            key = row.key if row.is_open or summary.levels else ""
            return Branch(row.line, part, row.depth, row.total, row.unit, worth, marks, key, row.is_open)

        return [dress(*row) for row in rows]


def usual_depth(counts: Sequence[int]) -> int:
    """Count the levels that fit on a page, at least one."""
    return max(1, sum(rows <= PAGE_ROWS for rows in accumulate(counts)))


def tree_page(shown: ShownStructure, total: int) -> tuple[Page[Branch], Sequence[Branch]]:
    """Make a page of the open rows, and the branches above its first one (none on the first page).

    TooLargeError if more is open than anybody can page through.
    """
    look = shown.look
    rows = list(islice(_walk(shown), MOST_OPEN + 1))
    if len(rows) > MOST_OPEN:
        raise TooLargeError(
            _(
                "more than %(most)s of the %(total)s rows of this tree are open; show fewer levels or "
                "take an export",
                most=MOST_OPEN,
                total=total,
            )
        )
    rows_of_page = page_of(rows, total if look.is_filtered else len(rows), look.page, shown.page_rows)
    above: list[StructureRow] = []
    for row in reversed(rows[: rows_of_page.start]):
        if row.depth < (above[-1] if above else rows[rows_of_page.start]).depth:
            above.append(row)
    here = shown.dressed([(row, shown.graph.doubts(row.line)) for row in rows_of_page.rows])
    page = Page(here, rows_of_page.total, rows_of_page.found, rows_of_page.number, rows_of_page.size)
    return page, shown.dressed([(row, ()) for row in above[::-1]])


def _walk(shown: ShownStructure) -> Iterator[StructureRow]:
    graph, look = shown.graph, shown.look
    filtered, flipped = look.is_filtered, set(look.flips)
    hit = leading_to(graph, shown.fitting) if filtered else lambda _line: True
    keys = _tree_keys(shown)

    @cache
    def lines_of(item_id: int, level: int) -> Sequence[Line]:
        below = shown.lines_of(item_id, level)
        return arranged([line for line in below if hit(line)], look.sort, keys) if below else ()

    exact: Exact | None = look.pieces
    stack = [(1, exact, "", iter(lines_of(graph.root.id, 0)))]
    while stack:
        level, factor, above, lines = stack[-1]
        for line in lines:
            total, amount = totals_of(factor, line)
            if line.state.rel_type != "component" or level >= MAX_DEPTH:
                yield StructureRow(line, level, total)
                continue
            row = StructureRow(line, level, total, above)
            is_open = filtered or (level < look.depth) != (bool(flipped) and row.key in flipped)
            inner = lines_of(line.child_id, level) if is_open else ()
            if inner:
                yield row._replace(is_open=True)
                stack.append((level + 1, amount, row.key, iter(inner)))
                break
            yield row
        else:
            stack.pop()


R = TypeVar("R")


def _keys(
    line: Callable[[R], Line], total: Callable[[R], Any], worth: Callable[[R], MassAndCost]
) -> dict[str, Callable[[R], Any]]:
    """Make the keys that rows are sorted by: the columns that the tree and the flat list both have."""

    def cost(row: R) -> Decimal | None:
        # Currencies cannot be compared; if there are several, the amounts are.
        return max(worth(row).costs.values(), default=None)

    return {
        "number": lambda row: line(row).child_part_number.casefold(),
        "name": lambda row: line(row).child_name.casefold(),
        "total": total,
        "unit_mass": lambda row: worth(row).mass,
        "mass": lambda row: _times(total(row), worth(row).mass),
        "unit_cost": cost,
        "cost": lambda row: _times(total(row), cost(row)),
    }


def _tree_keys(shown: ShownStructure) -> Mapping[str, Callable[[Line], Any]]:
    keys: dict[str, Callable[[Line], Any]] = _keys(
        lambda line: line, lambda line: line.state.quantity, shown.worth
    )
    return keys | {"quantity": keys["total"], "position": lambda line: line.state.find_number}


def flat_page(shown: ShownStructure) -> Page[Branch]:
    """Make a page of the leaf parts, each with its total over the whole tree."""
    look = shown.look
    if look.sort:
        shown.read_worths(shown.found)
    rows = arranged(shown.found, look.sort, _flat_keys(shown))
    table = page_of(rows, len(shown.leaves), look.page, shown.page_rows)
    here = shown.dressed(
        [
            (StructureRow(row.line, 1, product(row.total, look.pieces), flat=True), row.doubts(look.pieces))
            for row in table.rows
        ]
    )
    return Page(here, table.total, table.found, table.number, table.size)


def _flat_keys(shown: ShownStructure) -> Mapping[str, Callable[[FlatRow], Any]]:
    def properties(row: FlatRow) -> Mapping[str, Any]:
        return shown.parts[row.line.child_id].properties

    keys: dict[str, Callable[[FlatRow], Any]] = _keys(
        lambda row: row.line, lambda row: row.total, shown.worth_of_part
    )
    return keys | {
        "type": lambda row: row.line.child_item_type,
        "supplier": lambda row: str(properties(row).get("supplier") or "").casefold(),
    }


router = APIRouter(route_class=NumberedRoute, include_in_schema=False)

MOST_USES = 200


AskedLook = Annotated[Look, Depends()]


@router.get("/items/{part_number}")
def item_page(
    call: Reader,
    part_number: str,
    look: AskedLook,
    used_from: Annotated[int, Query(ge=0, le=10_000_000)] = 0,
    revisions_before: Annotated[int, Query(ge=1, le=2**31 - 1)] = 2**31 - 1,
) -> Response:
    """Show an item and everything around it; ``view=flat`` shows the leaf parts with their totals.

    ``used_from`` pages through where it is used, ``revisions_before`` through its revisions.
    """
    with call.read() as tx:
        item = get_item(tx, part_number, include_archived=True)
        shown = structure_of(tx, item, look)
        history, revision_count = revisions.list_revisions(tx, item, before=revisions_before)
        used, uses = where_used(tx, item, indirect=True, limit=MOST_USES, offset=used_from)
        files = documents.shown(tx, documents_holding(tx, item))
        looked, now = last_look(tx, call.actor.own_id, item), tx.stamp
        release, following = state_of(tx, item), is_followed(tx, call.actor.own_id, item)
        beside = _beside(tx, look.beside)
        attached = attachments_of(tx, [item.id]).get(item.id, [])
    call.server.db.looks[call.actor.own_id, item.id] = now
    return page(
        call,
        "item.html",
        looked=looked,
        release=release,
        following=following,
        beside=beside,
        item=item,
        look=look,
        at=look.address(f"/items/{segment(item.part_number)}"),
        types=ITEM_TYPES,
        revisions=history,
        revision_count=revision_count,
        files=files,
        attachments=attached,
        kinds=kind_words(),
        used=used,
        uses=uses,
        used_from=used_from,
        most_uses=MOST_USES,
        properties=shown_properties(item),
        upload_key=secrets.token_urlsafe(16),  # a form that is sent twice makes one revision
        **shown,
    )


def _beside(tx: Tx, part_number: str) -> dict[str, Any] | None:
    """Read what is shown beside the table: the item of a chosen row; None if there is none."""
    try:
        item = get_item(tx, part_number, include_archived=True)
    except NotFoundError:
        return None
    used, uses = where_used(tx, item, limit=5)
    summary = at_once(tx, {item.id}).get(item.id)
    files = documents.shown(tx, documents_holding(tx, item))
    values = {"item": item, "properties": shown_properties(item), "summary": summary, "files": files}
    values |= {"attachments": attachments_of(tx, [item.id]).get(item.id, [])}
    return values | {"used": used, "uses": uses, "release": state_of(tx, item)}


@router.get("/documents/{uuid}")
def document_page(call: Reader, uuid: str) -> Response:
    """Show a file: the items in it, the files that it links to, those that use it, and its revisions."""
    with call.read() as tx:
        document_json = told_of(tx, uuid)
        history, _ = revisions.list_revisions(tx, get_document(tx, document_json["id"]), PAGE_SIZE)
    return page(call, "document.html", file=document_json, revisions=history)


def structure_of(tx: Tx, item: Item, look: Look, size: int = PAGE_ROWS) -> dict[str, Any]:
    """Collect what a BOM over all levels shows: table, totals, and what the last sync left out."""
    last = last_sync(tx, item)
    values: dict[str, Any] = {"last": last, "gaps": in_sentences(last.own_gaps), "problem": ""}
    values |= {"held_gaps": in_sentences(last.held_gaps)}
    values |= dict.fromkeys(("table", "totals", "of_all", "cost_of_one"))
    values |= dict.fromkeys(("levels", "depth"), 0)
    values |= {"above": ()} | dict.fromkeys(("has_mass", "has_cost", "has_supplier"), False)
    try:
        summary = summary_of(tx, item)
        cost = product_cost(tx, summary, look.pieces)
        of_one = cost if look.pieces == 1 else product_cost(tx, summary)
        values |= {"of_all": summary, "cost_of_one": of_one, "totals": Totals.of(summary, cost, look.pieces)}
        counts = summary.levels
        if not counts:
            return values
        depth = look.depth or (len(counts) if size > PAGE_ROWS else usual_depth(counts))
        look = replace(look, depth=depth)
        values |= {"levels": len(counts), "depth": depth}
        values |= {"has_mass": summary.worth.mass is not None, "has_cost": bool(cost.totals)}
        whole = look.is_flat or look.is_filtered
        if whole and summary.lines > MOST_READ:
            raise TooLargeError(
                _(
                    "this product has %(lines)s lines over all levels, and a page finds in, or adds up, "
                    "at most %(most)s; look at one of its sub-assemblies, or take an export",
                    lines=summary.lines,
                    most=MOST_READ,
                )
            )
        shown = ShownStructure(tx, load_graph(tx, item, None if whole else depth), look, cost.prices, size)
        if look.is_filtered:
            values |= {"totals": Totals.narrow(tx, shown)}
        if look.is_flat:
            flat = flat_page(shown)
            supplied = any(row.part.properties.get("supplier") for row in flat.rows)
            return values | {"table": flat, "has_supplier": supplied}
        table, above = tree_page(shown, sum(counts))
        return values | {"table": table, "above": above}
    except (BusyError, ConflictError, TooLargeError) as error:
        return {**values, "problem": str(error)}


@dataclass(frozen=True, slots=True)
class Totals:
    """What all pieces of the shown parts weigh [kg] and cost; how many state none, and the first of them."""

    mass: Decimal | float | None
    costs: Mapping[str, Decimal]
    no_mass: int
    no_cost: int
    mass_missing: Sequence[str]
    cost_missing: Sequence[str]

    @classmethod
    def of(cls, summary: Summary, cost: ProductCost, pieces: int) -> Totals:
        """Take the totals of a whole product from its summary and its cost."""
        mass = _times(pieces, summary.worth.mass)
        missing = summary.mass_missing, cost.missing
        return cls(mass, cost.totals, summary.no_mass, cost.unknown, *missing)

    @classmethod
    def narrow(cls, tx: Tx, shown: ShownStructure) -> Totals:
        """Add up the totals of what a filter has found, at the prices of the whole product."""
        graph, found, parts, pieces = shown.graph, shown.found, shown.parts, shown.look.pieces
        leaves = leaves_in(graph, found)
        alone = set() if leaves is found else standing_alone(tx, graph)
        cost = cost_of_found(shown, rates_of(tx))
        weighed = roll_up_mass(leaves_in(graph, found, alone) if alone else leaves, parts, alone)
        return cls(
            _times(pieces, as_decimal(weighed.total)) or None,
            cost.totals,
            len(weighed.missing),
            len(cost.missing),
            sorted(weighed.missing)[:MOST_NAMED],
            sorted(cost.missing)[:MOST_NAMED],
        )


def cost_of_found(shown: ShownStructure, rates: Mapping[str, Decimal]) -> CostRollup:
    """Add up what all pieces of the found parts cost, at the prices of the whole product."""
    graph, parts, pieces = shown.graph, shown.parts, shown.look.pieces
    costed = leaves_in(graph, shown.found, bought_whole(graph, parts))
    prices = prices_in(graph, parts, rates, pieces)
    lacking = {row.line.child_id for row in costed} - prices.keys()  # what is found in a bought assembly
    prices |= {part_id: part_cost(parts[part_id], Decimal(1), rates) for part_id in lacking}
    return roll_up_cost(costed, parts, prices, pieces)


PAGE_SIZE = 100


@router.get("/")
@router.get("/items")
def items_page(
    call: Reader,
    q: Annotated[str, Query(max_length=200)] = "",
    type: Annotated[str, Query(max_length=20)] = "",
    category: Annotated[str, Query(max_length=32)] = "",
    archived: bool = False,
    sort: Annotated[str, Query(max_length=20)] = "",
    number: Annotated[int, Query(ge=1, le=10**7, alias="page")] = 1,
) -> Response:
    """Show the items that match; the search runs while a user types or, without script, by its form."""
    query = ItemQuery(
        search=q,
        item_type=type or None,
        category=category or None,
        archived=archived,
        limit=PAGE_SIZE,
        offset=(number - 1) * PAGE_SIZE,
        sort=sort,
    )
    with call.read() as tx:
        items, total = list_items(tx, query)
        used = use_counts(tx, [item.id for item in items])
        marks = marks_of(tx, items)
        categories = scheme_of(tx).categories
    asked = {"q": q, "type": type, "category": category, "archived": "1" if archived else "", "sort": sort}
    return page(
        call,
        "items.html",
        at=Address("/items", {name: value for name, value in asked.items() if value}),
        table=Page(items, total, total, number, PAGE_SIZE),
        used=used,
        marks=marks,
        q=q,
        type=type,
        types=ITEM_TYPES,
        category=category,
        categories=categories,
        archived=archived,
        sort=sort,
    )
