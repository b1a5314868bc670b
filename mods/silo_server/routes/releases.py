# SPDX-License-Identifier: LGPL-2.1-or-later
"""Released revisions over HTTP: submit a product, approve it, read what was frozen of it."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from fastapi import APIRouter
from pydantic import Field, StrictBool, WithJsonSchema
from starlette.responses import Response

from silo.api import wire
from silo_server.db.transaction import Tx
from silo_server.fields import to_wire
from silo_server.routes.answers import READ_ERRORS, WRITE_ERRORS, json_answer
from silo_server.routes.call import Call, Editor, Viewer
from silo_server.routes.models import RequestBody, Text
from silo_server.routes.requests import BoundedRoute
from silo_server.services import releases
from silo_server.services.items import get_item
from silo_server.services.product import frozen
from silo_server.services.releases import Release

router = APIRouter(
    route_class=BoundedRoute,
    prefix="/api/items/{part_number}/releases",
    tags=["releases"],
    responses=READ_ERRORS,
)


class SubmitBody(RequestBody):
    """``POST …/releases``: without a label the server takes the next one of the site's scheme."""

    comment: Text = ""
    label: Annotated[
        str, WithJsonSchema({"type": "string", "pattern": f"^({wire.RELEASE_LABEL})?$", "default": ""})
    ] = ""
    with_parts: StrictBool = False


class ApproveBody(RequestBody):
    """``POST …/releases/{label}/approval``; ``override``: why it is released in spite of what blocks."""

    comment: Text = ""
    override: Text = ""


class EndBody(RequestBody):
    """``POST …/releases/{label}/end``: ``rejected``, ``withdrawn`` end a review, ``obsolete`` a release."""

    status: Literal["rejected", "withdrawn", "obsolete"]
    note: Text = ""


class ReleasesOut(wire.Answer):
    """All revisions that were submitted, newest first, and the label of the draft."""

    draft: str
    releases: list[wire.Release] = Field(default_factory=list)


def release_to_wire(tx: Tx, release: Release, *, whole: bool = False) -> dict[str, Any]:
    """Return a revision as the API sends it; ``whole``: with the item's revision and the product's files.

    Raises TooLargeError.
    """
    release_json = {
        **to_wire(release, "id"),
        "blocks": releases.blocks_of(tx, release) if release.status == "review" else release.blocks,
        "approvals": [to_wire(approval) for approval in releases.approvals_of(tx, release)],
    }
    if whole:
        record = releases.read_record(tx, release.record)
        models, beside = frozen.frozen_files(tx, release.record)
        release_json |= {"revision": record["revision"], "files": models, "attachments": beside}
    return release_json


@router.get("", response_model=ReleasesOut)
def list_releases(call: Viewer, part_number: str) -> Response:
    """Return all revisions of a product: in review, released, obsolete, rejected or withdrawn."""
    with call.read() as tx:
        item = get_item(tx, part_number, include_archived=True)
        releases_json = [release_to_wire(tx, release) for release in releases.list_releases(tx, item)]
        content = {"draft": releases.coming_label(tx, item), "releases": releases_json}
    return json_answer(content)


@router.post("", status_code=201, response_model=wire.Release, responses=WRITE_ERRORS)
def submit(call: Editor, part_number: str, body: SubmitBody) -> Response:
    """Freeze a product as it is now and put it up for review."""
    made = frozen_now(call, part_number)
    with call.write() as tx:
        release = releases.submit(tx, part_number, made, body.comment, body.label, with_parts=body.with_parts)
        return json_answer(release_to_wire(tx, release, whole=True), 201)


def frozen_now(call: Call, part_number: str) -> releases.FrozenProduct:
    """Freeze a product as one snapshot of the database has it; nothing is stored."""
    with call.server.large_reads.enter(), call.read() as tx:
        return frozen.freeze(tx, get_item(tx, part_number))


@router.get("/{label}", response_model=wire.Release)
def get_release(call: Viewer, part_number: str, label: str) -> Response:
    """Return one revision, with all files of the product as they were frozen."""
    with call.read() as tx:
        release = releases.get_release(tx, get_item(tx, part_number, include_archived=True), label)
        release_json = release_to_wire(tx, release, whole=True)
    return json_answer(release_json)


@router.post("/{label}/approval", response_model=wire.Release, responses=WRITE_ERRORS)
def approve(call: Viewer, part_number: str, label: str, body: ApproveBody) -> Response:
    """Approve a revision in review; the last approval that the site requires releases it.

    This needs the right to approve, not a role.
    """
    with call.write() as tx:
        release = releases.approve(tx, part_number, label, body.comment, body.override)
        return json_answer(release_to_wire(tx, release))


@router.post("/{label}/end", response_model=wire.Release, responses=WRITE_ERRORS)
def end(call: Viewer, part_number: str, label: str, body: EndBody) -> Response:
    """Reject or withdraw a revision in review, or call a released one obsolete.

    An editor withdraws; rejecting and calling obsolete need the right to approve.
    """
    with call.write() as tx:
        release = releases.end(tx, part_number, label, body.status, body.note)
        return json_answer(release_to_wire(tx, release))
