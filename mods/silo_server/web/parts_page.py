# SPDX-License-Identifier: LGPL-2.1-or-later
"""The list of items as a table in and out, the site's categories, and the last imports with their *Undo*.

As with the import of a BOM the file travels in the form between the check and the click.
"""

from __future__ import annotations

from collections import Counter
from functools import partial

from fastapi import APIRouter
from starlette.datastructures import FormData
from starlette.responses import Response

from silo.bom.errors import SiloError
from silo.tables.category_rows import CATEGORIES, CategoryRows
from silo.tables.part_rows import PARTS, PartRows
from silo.tables.sheet import Layout
from silo_server.routes.call import Call
from silo_server.routes.requests import NumberedRoute
from silo_server.services import import_undo, part_import, scheme
from silo_server.services.import_log import last_imports
from silo_server.services.item_cells import COLUMNS
from silo_server.services.part_import import PARTS_AS_THEY_ARE, PartsAllowed
from silo_server.services.table_layouts import remember_layout, remembered_layout
from silo_server.web.accounts import Administrator, Reader, Writer
from silo_server.web.forms import Form, back, back_to, text
from silo_server.web.import_page import MOST_ROWS, Problem, Upload, carried, checked, layout_of, reading
from silo_server.web.render import _, isolate, page

router = APIRouter(route_class=NumberedRoute, include_in_schema=False)
_NO_PROBLEM = Problem()
_ORDER = {"error": 0, "add": 1, "change": 1, "skip": 2, "same": 3}


@router.get("/items/import")
def parts_page(call: Writer) -> Response:
    """Show the form in which a user chooses a list of parts, and the last imports."""
    return _parts(call, PARTS_AS_THEY_ARE)


@router.post("/items/import/check")
def check_parts(call: Writer, form: Form) -> Response:
    """Show what the file would do; write nothing."""
    return checked(form, PARTS, partial(_parts, call, _allowed(form)))


@router.post("/items/import")
def apply_parts(call: Writer, form: Form) -> Response:
    """Import a list of parts that was checked."""
    upload, layout, allowed = carried(form), layout_of(form, PARTS), _allowed(form)
    most = call.server.settings.max_merge_entries
    try:
        with call.read() as tx:
            read = part_import.read_parts_table(tx, upload.data, most, layout)
        with call.write() as tx:
            plan, _done = part_import.apply_parts(tx, read, allowed, upload.name)
            remember_layout(tx, "parts", upload.data, PARTS, layout)
    except SiloError as error:
        return _parts(call, allowed, upload, layout, Problem.of(error))
    counts = Counter(row.status for row in plan)
    notice = _(
        "Imported %(file)s: %(added)s added, %(changed)s changed, %(same)s the same.",
        file=isolate(upload.name),
        added=counts["add"],
        changed=counts["change"],
        same=counts["same"],
    )
    return back("/items/import", notice)


def _allowed(form: FormData) -> PartsAllowed:
    duplicates = text(form, "duplicates", 10)
    return PartsAllowed(
        text(form, "category", 32),
        duplicates if duplicates in part_import.DUPLICATES else "",
        bool(text(form, "leave_out")),
    )


def _parts(
    call: Call,
    allowed: PartsAllowed,
    upload: Upload | None = None,
    layout: Layout | None = None,
    problem: Problem = _NO_PROBLEM,
) -> Response:
    file = upload or problem.upload
    layout = layout or problem.layout
    rows, read = [], PartRows(())
    with call.read() as tx:
        categories = scheme.scheme_of(tx).categories.values()
        last = last_imports(tx, ("parts", "bom", "prices"))
        if file and layout is None:
            layout = remembered_layout(tx, "parts", file.data, PARTS)[0]
        if upload:
            read = part_import.read_parts_table(
                tx, upload.data, call.server.settings.max_merge_entries, layout
            )
            rows = part_import.plan_parts(tx, read, allowed)
    return page(
        call,
        "parts_import.html",
        status=problem.status,
        upload=upload,
        rows=sorted(rows, key=lambda row: (_ORDER[row.status], row.row))[:MOST_ROWS],
        total=len(rows),
        counts=Counter(row.status for row in rows),
        could=Counter(row.could for row in rows if row.status == "error"),
        read=read,
        allowed=allowed,
        categories=categories,
        titles={**COLUMNS, "archived": "archived"},
        problem=problem.words,
        file=file,
        reading=reading(file, layout, PARTS) if file else None,
        last=last,
    )


@router.post("/imports/undo")
def undo(call: Writer, form: Form) -> Response:
    """Take an import back."""
    number = text(form, "import", 20)
    with call.write() as tx:
        undone = import_undo.undo_import(tx, int(number) if number.isascii() and number.isdigit() else 0)
    notice = _("The import of %(file)s is undone.", file=isolate(undone.file_name or undone.kind))
    return back(back_to(form, "/suppliers" if undone.kind == "prices" else "/items/import"), notice)


@router.get("/categories")
def categories_page(call: Reader) -> Response:
    """Show the site's categories, and how part numbers of each are written."""
    return _categories(call)


def _categories(
    call: Call,
    upload: Upload | None = None,
    layout: Layout | None = None,
    problem: Problem = _NO_PROBLEM,
) -> Response:
    file, plan, read = upload or problem.upload, None, CategoryRows(())
    layout = layout or problem.layout
    with call.read() as tx:
        now = scheme.scheme_of(tx)
        if upload:
            read = scheme.read_categories(upload.data, layout)
            plan = scheme.plan_scheme(tx, read)
    return page(
        call,
        "categories.html",
        status=problem.status,
        upload=upload,
        plan=plan,
        rows=sorted(plan.rows, key=lambda row: (_ORDER[row.status], row.row)) if plan else (),
        read=read,
        scheme=now,
        example={code: now.number(code, 1) for code in now.categories},
        problem=problem.words,
        file=file,
        reading=reading(file, layout, CATEGORIES) if file else None,
    )


@router.post("/categories/check")
def check_categories(call: Administrator, form: Form) -> Response:
    """Show what a list of categories would change; write nothing."""
    return checked(form, CATEGORIES, partial(_categories, call))


@router.post("/categories")
def apply_categories(call: Administrator, form: Form) -> Response:
    """Let a list that was checked be the site's scheme."""
    upload, layout = carried(form), layout_of(form, CATEGORIES)
    try:
        read = scheme.read_categories(upload.data, layout)
        with call.write() as tx:
            plan = scheme.apply_scheme(tx, read)
    except SiloError as error:
        return _categories(call, upload, layout, Problem.of(error))
    notice = _("The categories are those of %(file)s.", file=isolate(upload.name))
    return back("/categories", notice if plan.changed else _("Nothing differs, so nothing was saved."))
