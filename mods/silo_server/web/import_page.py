# SPDX-License-Identifier: LGPL-2.1-or-later
"""Import of a BOM from a table: first every row with what would become of it, then, on a click, all of it.

Between the two the file travels in the form, packed, so that nothing waits on the server and any of its
processes can continue.
"""

from __future__ import annotations

import base64
import binascii
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from fastapi import APIRouter
from starlette.datastructures import FormData, UploadFile
from starlette.responses import Response

from silo.bom.errors import RejectedError, SiloError, VersionConflictError
from silo.bom.headers import Heading
from silo.bom.numbers import Mark
from silo.tables.bom_rows import BOM, BomRows
from silo.tables.kind import TableKind
from silo.tables.limits import HEADER_WITHIN, MOST_COLUMNS
from silo.tables.sheet import Layout, first_lines, guess_layout
from silo_server.errors import TooLargeError
from silo_server.routes.call import Call
from silo_server.routes.requests import NumberedRoute
from silo_server.services.bom import imports
from silo_server.services.bom.import_plan import NOTHING, Allowed
from silo_server.services.file_store import clean_name
from silo_server.services.import_log import last_imports
from silo_server.services.items import get_item
from silo_server.services.scheme import scheme_of
from silo_server.services.table_layouts import remember_layout, remembered_layout
from silo_server.web.accounts import Writer
from silo_server.web.forms import Form, back, text, whole
from silo_server.web.line_form import changes
from silo_server.web.merge_page import bom_path
from silo_server.web.render import N_, _, isolate, page, plural

router = APIRouter(route_class=NumberedRoute, include_in_schema=False)

DELIMITERS = {",": "commas", ";": "semicolons", "\t": "tabs", "|": "bars"}
MOST_BYTES = 8 * 1024 * 1024
MOST_ROWS = 1000


@dataclass(frozen=True)
class Upload:
    """A table as it was chosen, and the name of its file."""

    name: str
    data: bytes

    @property
    def packed(self) -> str:
        return base64.b64encode(zlib.compress(self.data)).decode("ascii")


@router.get("/items/{part_number}/import")
def import_page(call: Writer, part_number: str) -> Response:
    """Show the form in which a user chooses a file."""
    return _show(call, part_number, None)


@router.post("/items/{part_number}/import/check")
def check(call: Writer, part_number: str, form: Form) -> Response:
    """Show what the file would do; write nothing. The same file may come again, with other columns."""
    allowed = _allowed(form)

    def show(upload: Upload | None, layout: Layout | None, problem: Problem) -> Response:
        return _show(call, part_number, upload, layout, problem, allowed)

    return checked(form, BOM, show)


def checked(
    form: FormData, of: TableKind, show: Callable[[Upload | None, Layout | None, Problem], Response]
) -> Response:
    """Show what a file would do, or why it cannot be read."""
    upload, layout = None, None
    try:
        upload = carried(form) if "packed" in form else uploaded(form)
        layout = layout_of(form, of)
        return show(upload, layout, Problem())
    except (RejectedError, TooLargeError) as error:
        return show(None, None, replace(Problem.of(error), upload=upload, layout=layout))


@router.post("/items/{part_number}/import")
def apply(call: Writer, part_number: str, form: Form) -> Response:
    """Import the file; if the BOM has changed since the check, check it again instead."""
    upload, layout, allowed = carried(form), layout_of(form, BOM), _allowed(form)
    try:
        records = imports.read_bom(upload.data, call.server.settings.max_merge_entries, layout)
        with call.write() as tx:
            plan, done, _version = imports.apply_import(
                tx, part_number, records, upload.name, whole(form, "version"), allowed
            )
            remember_layout(tx, "bom", upload.data, BOM, layout)
    except VersionConflictError:
        problem = Problem(
            _("The BOM was changed by somebody else since the file was checked; look again."), 412
        )
        return _show(call, part_number, upload, layout, problem, allowed)
    except SiloError as error:
        return _show(call, part_number, upload, layout, Problem.of(error), allowed)
    notice = _(
        "Imported %(file)s: %(added)s added, %(changed)s changed, %(parts)s made."
        if plan.new
        else "Imported %(file)s: %(added)s added, %(changed)s changed.",
        file=isolate(upload.name),
        added=plan.count("add"),
        changed=plan.count("change"),
        parts=plural(len(plan.new), "part"),
    )
    return back(bom_path(part_number), notice, undo=[change for _item, change in done.boms])


def _allowed(form: FormData) -> Allowed:
    return Allowed(
        text(form, "category", 32),
        *(bool(text(form, name)) for name in ("add_up", "quantities", "remove", "leave_out")),
    )


@dataclass(frozen=True)
class Problem:
    """Why a file was not taken; with the file, if the person can say how to read it."""

    words: str = ""
    status: int = 200
    upload: Upload | None = None
    layout: Layout | None = None

    @classmethod
    def of(cls, error: SiloError) -> Problem:
        return cls(str(error), error.status_hint)


def layout_of(form: FormData, of: TableKind = BOM) -> Layout | None:
    """Read how the person wants the file to be read; None if that was not chosen."""
    if "header" not in form:
        return None
    marks = {mark.value: mark for mark in Mark}
    columns = {role: whole(form, f"column_{role}") for role in of.roles}
    delimiter = form.get("delimiter")
    return Layout(
        delimiter if isinstance(delimiter, str) and delimiter in DELIMITERS else ",",
        min(whole(form, "header") or 0, HEADER_WITHIN - 1),
        {role: at for role, at in columns.items() if at is not None and at < MOST_COLUMNS},
        marks.get(text(form, "mark")),
    )


def _show(
    call: Call,
    part_number: str,
    upload: Upload | None,
    layout: Layout | None = None,
    problem: Problem = Problem(),
    allowed: Allowed = NOTHING,
) -> Response:
    file = upload or problem.upload
    layout = layout or problem.layout
    known: tuple[str, ...] = ()
    if file and layout is None:
        with call.read() as tx:
            layout, known = remembered_layout(tx, "bom", file.data, BOM)
    records = (
        imports.read_bom(upload.data, call.server.settings.max_merge_entries, layout)
        if upload
        else BomRows(())
    )
    with call.read() as tx:
        item = get_item(tx, part_number)
        plan = imports.plan_import(tx, part_number, records, allowed) if upload else None
        categories = scheme_of(tx).categories.values()
        last = last_imports(tx, ("bom",))
    rows = plan.rows if plan else ()
    line_changes = {row.row: changes(row.before, row.after) for row in rows if row.before and row.after}
    # What is wrong, and what would change, is worth reading; rows that are as they were are not.
    order = {"error": 0, "add": 1, "change": 1, "skip": 2, "same": 2}
    return page(
        call,
        "import.html",
        status=problem.status,
        item=item,
        upload=upload,
        plan=plan,
        allowed=allowed,
        categories=categories,
        rows=sorted(rows, key=lambda row: (order[row.status], row.row))[:MOST_ROWS],
        line_changes=line_changes,
        problem=problem.words,
        file=file,
        reading=reading(file, layout) if file else None,
        known=known,
        last=last,
    )


ROLE_WORDS: dict[str, str] = {
    Heading.TYPE: N_("Type"),
    Heading.REVISION: N_("Revision"),
    Heading.SUPPLIER_NUMBER: N_("Supplier’s part number"),
    Heading.PRICE: N_("Price"),
    Heading.PRICE_BASIS: N_("Price is for … pieces"),
    Heading.NOT_FITTED: N_("Not fitted (DNP)"),
    Heading.FITTED: N_("Fitted (Populate)"),
    Heading.ITEM: N_("Position"),
    Heading.FROM_QUANTITY: N_("Price from quantity"),
    Heading.LEAD_TIME: N_("Lead time [days]"),
}


def reading(file: Upload, layout: Layout | None, of: TableKind = BOM) -> dict[str, Any]:
    """Describe how the file is read, for the form in which a user changes that."""
    guessed = layout or guess_layout(file.data, "file", of)
    delimiter, lines = first_lines(file.data, "file", of, guessed.delimiter if guessed else None)
    layout_read = guessed or Layout(delimiter, 0)
    lines = lines[: layout_read.header + 6]
    header = lines[layout_read.header] if layout_read.header < len(lines) else []
    width = max(map(len, lines), default=0)
    samples = lines[layout_read.header + 1 :]
    return {
        "layout": layout_read,
        "chosen": layout is not None,
        "lines": [" | ".join(cells)[:60] for cells in lines],
        "delimiters": DELIMITERS if delimiter else {},
        "roles": [(role, _(ROLE_WORDS.get(role, role.replace("_", " ").capitalize()))) for role in of.roles],
        "needed": of.needed,
        "columns": [_name_of(index, header, samples) for index in range(width)],
    }


def _name_of(index: int, header: Sequence[str], samples: Sequence[Sequence[str]]) -> str:
    name = header[index].strip() if index < len(header) else ""
    example = next((row[index].strip() for row in samples if index < len(row) and row[index].strip()), "")
    return f"{index + 1}: {name[:40]}" + (
        _(" (such as %(example)s)", example=example[:20]) if example else ""
    )


def uploaded(form: FormData) -> Upload:
    file = form.get("file")
    if not isinstance(file, UploadFile) or not file.filename:
        raise RejectedError(_("No file was chosen."))
    data = file.file.read(MOST_BYTES + 1)
    if len(data) > MOST_BYTES:
        raise TooLargeError(
            _("The file is larger than %(size)s MiB; this cannot be a BOM.", size=MOST_BYTES // 2**20)
        )
    return Upload(clean_name(file.filename), data)


def carried(form: FormData) -> Upload:
    packed = text(form, "packed", MOST_BYTES * 2)
    unpacker = zlib.decompressobj()
    try:
        data = unpacker.decompress(base64.b64decode(packed, validate=True), MOST_BYTES)
    except (binascii.Error, ValueError, zlib.error):
        raise RejectedError(_("the file did not arrive completely; choose it again")) from None
    if not unpacker.eof:
        raise TooLargeError(
            _("The file is larger than %(size)s MiB; this cannot be a BOM.", size=MOST_BYTES // 2**20)
        )
    return Upload(text(form, "name", 200) or "file.csv", data)
