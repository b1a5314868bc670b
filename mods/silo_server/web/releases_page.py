# SPDX-License-Identifier: LGPL-2.1-or-later
"""The revisions of a product: its draft, what is in review, what was released, and each as it was frozen."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from itertools import islice
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Query
from starlette.responses import Response

from silo.bom.errors import ConflictError, SiloError
from silo_server.db.transaction import Tx
from silo_server.errors import TooLargeError
from silo_server.routes.call import Call
from silo_server.routes.releases import frozen_now
from silo_server.routes.requests import NumberedRoute
from silo_server.services import releases
from silo_server.services.access.users import get_user
from silo_server.services.items import get_item
from silo_server.services.product.cost import bought_whole, prices_in, with_costs
from silo_server.services.product.flat import flatten
from silo_server.services.product.frozen import ProductContent, frozen_files, frozen_product
from silo_server.services.product.graph import MAX_DEPTH
from silo_server.services.product.rollup import roll_up_cost
from silo_server.services.product.summary_read import summary_of
from silo_server.services.product.tree import expand
from silo_server.services.product.worth import in_unit_of
from silo_server.services.releases import Release
from silo_server.services.suppliers import rates_of
from silo_server.values import Item
from silo_server.web.accounts import Reader, Writer
from silo_server.web.attachments import kind_words
from silo_server.web.forms import Form, back, text
from silo_server.web.render import N_, Address, _, page, page_of, segment

router = APIRouter(route_class=NumberedRoute, include_in_schema=False)

# No reader pages through more rows of a frozen tree; an export has all of them.
MOST_ROWS = 20_000
# What stands in large letters on paper, by the state of a revision; what is released needs no such word.
STAMPS = {"": N_("DRAFT"), "review": N_("IN REVIEW"), "obsolete": N_("OBSOLETE"), "released": ""}
ENDS = (N_("rejected"), N_("withdrawn"), N_("obsolete"))


def _path(part_number: str) -> str:
    return f"/items/{segment(part_number)}/releases"


@router.get("/items/{part_number}/releases")
def releases_page(call: Reader, part_number: str) -> Response:
    """Show all revisions of a product, with the forms that submit, approve, reject and end them."""
    return _show(call, part_number)


def _show(
    call: Call, part_number: str, problem: str = "", status: int = 200, typed: Mapping[str, str] | None = None
) -> Response:
    with call.read() as tx:
        item = get_item(tx, part_number, include_archived=True)
        list_of_releases = releases.list_releases(tx, item)
        values: dict[str, Any] = {
            "rows": [(release, releases.approvals_of(tx, release)) for release in list_of_releases],
            "draft": releases.coming_label(tx, item),
            "state": state_of(tx, item, list_of_releases),
            "approver": get_user(tx, call.actor.username).approver,
            "wanted": tx.settings.release_approvals,
            "may_override": tx.settings.release_override,
        }
        waiting = _newest(list_of_releases, "review")
        values |= {"in_review": waiting, "blocks": releases.blocks_of(tx, waiting) if waiting else []}
    return page(call, "releases.html", status=status, item=item, problem=problem, typed=typed or {}, **values)


def state_of(tx: Tx, item: Item, list_of_releases: list[Release] | None = None) -> dict[str, Any]:
    """Find the revision that is released or in review, and whether the product changed since."""
    list_of_releases = releases.list_releases(tx, item) if list_of_releases is None else list_of_releases
    released, waiting = (_newest(list_of_releases, status) for status in ("released", "review"))
    newest = waiting or released
    changed = False
    if newest is not None:
        with suppress(ConflictError, TooLargeError):  # a ring of assemblies, which the page itself reports
            changed = summary_of(tx, item).changed.at > newest.frozen_at
    return {"released": released, "review": waiting, "changed": changed}


def _newest(list_of_releases: list[Release], status: str) -> Release | None:
    return next((release for release in list_of_releases if release.status == status), None)


@router.post("/items/{part_number}/releases")
def submit(call: Writer, part_number: str, form: Form) -> Response:
    """Freeze the product and put it up for review."""
    typed = {name: text(form, name, 2000) for name in ("comment", "label", "with_parts")}
    try:
        made = frozen_now(call, part_number)
        with call.write() as tx:
            parts = bool(typed["with_parts"])
            release = releases.submit(
                tx, part_number, made, typed["comment"], typed["label"], with_parts=parts
            )
    except SiloError as error:
        return _show(call, part_number, str(error), error.status_hint, typed)
    return back(_path(part_number), _("Revision %(label)s is in review.", label=release.label))


@router.post("/items/{part_number}/releases/{label}/approval")
def approve(call: Reader, part_number: str, label: str, form: Form) -> Response:
    """Approve a revision in review; with a reason, in spite of what blocks."""
    typed = {name: text(form, name, 2000) for name in ("approval", "override")}
    try:
        with call.write() as tx:
            done = releases.approve(tx, part_number, label, typed["approval"], typed["override"])
    except SiloError as error:
        return _show(call, part_number, str(error), error.status_hint, typed)
    released = N_("Revision %(label)s is released.")
    waits = N_("Revision %(label)s has your approval, and waits for another.")
    return back(_path(part_number), _(released if done.status == "released" else waits, label=label))


@router.post("/items/{part_number}/releases/{label}/end")
def end(call: Reader, part_number: str, label: str, form: Form) -> Response:
    """Reject or withdraw a revision in review, or call a released one obsolete."""
    status = text(form, "status")
    if status not in ENDS:
        return _show(call, part_number, _("Load the page again: the state has changed."), 400)
    try:
        with call.write() as tx:
            releases.end(tx, part_number, label, status, text(form, "note", 2000))
    except SiloError as error:
        return _show(call, part_number, str(error), error.status_hint)
    return back(_path(part_number), _("Revision %(label)s is %(status)s.", label=label, status=_(status)))


@router.get("/items/{part_number}/releases/{label}")
def release_page(
    call: Reader,
    part_number: str,
    label: str,
    view: Literal["tree", "flat"] = "tree",
    number: Annotated[int, Query(alias="page", ge=1, le=10**9)] = 1,
) -> Response:
    """Show one revision as it was frozen: its tree, or the flat list with totals, and its files."""
    with call.read() as tx:
        item = get_item(tx, part_number, include_archived=True)
        release = releases.get_release(tx, item, label)
        product = frozen_product(tx, item, release)
        graph, prices = product.graph, prices_in(product.graph, product.parts, rates_of(tx))
        product = product._replace(worths=with_costs(graph, product.parts, product.worths, prices))
        cost = roll_up_cost(flatten(graph, bought_whole(graph, product.parts)), product.parts, prices)
        models, beside = frozen_files(tx, release.record)
        approvals = releases.approvals_of(tx, release)
        numbered = [other for other in releases.list_releases(tx, item) if other.status in releases.NUMBERED]
    before = next((other for other in numbered if other.frozen_at < release.frozen_at), None)
    rows = list(islice(_rows(product, flat=view == "flat"), MOST_ROWS))
    table = page_of(rows, len(rows), number)
    at = Address(f"{_path(item.part_number)}/{segment(label)}", {"view": view} if view != "tree" else {})
    return page(
        call,
        "release.html",
        stamp=STAMPS[release.status],
        item=product.graph.root,
        release=release,
        approvals=approvals,
        before=before,
        table=table,
        at=at,
        flat=view == "flat",
        worth=product.worths[product.graph.root.id],
        cost=cost,
        files=sorted(models, key=lambda other: other["file_path"] or other["file_name"]),
        attachments=beside,
        kinds=kind_words(),
        cut=len(rows) == MOST_ROWS,
    )


def _rows(product: ProductContent, *, flat: bool) -> Any:
    """Yield the rows of the table: line, depth, total, the unit of that, what one unit is worth."""
    if flat:
        for row in flatten(product.graph):
            yield row.line, 1, row.total, row.unit, product.worths[row.line.child_id]
        return
    for occurrence in expand(product.graph, MAX_DEPTH, MOST_ROWS):
        yield (
            occurrence.line,
            occurrence.depth,
            occurrence.total,
            occurrence.line.unit,
            in_unit_of(occurrence.line, product.worths[occurrence.line.child_id]),
        )
