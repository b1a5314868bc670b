# SPDX-License-Identifier: LGPL-2.1-or-later
"""Making items and changing them: names, category, properties of the schema and others, files, the archive.

A form sends what it was made from beside what was typed, so that only what a user changed is changed. Where
somebody else changed the same field meanwhile, nothing is saved and the page shows both.
"""

from __future__ import annotations

import json
import secrets
import uuid
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from fastapi import APIRouter
from starlette.datastructures import FormData, UploadFile
from starlette.responses import Response

from silo.api.wire import FactSource, ItemTexts
from silo.bom.errors import NewerRevisionError, RejectedError, SiloError
from silo.bom.numbers import read_number
from silo.bom.quantities import plain
from silo.file_kind import MODEL
from silo_server.db.transaction import Tx
from silo_server.routes.call import Call
from silo_server.routes.items import numbered, store_file
from silo_server.routes.requests import NumberedRoute
from silo_server.schema import ITEM_TYPES, Category, find_schema, text_hints
from silo_server.services import items as service
from silo_server.services.bom.unit_change import change_item_and_lines
from silo_server.services.items import ItemChange, NewItem, get_item
from silo_server.services.product.where_used import where_used
from silo_server.services.releases import draft_of
from silo_server.services.revisions import RevisionOrigin
from silo_server.services.scheme import scheme_of
from silo_server.values import Document, Item, Revision
from silo_server.web.accounts import Writer
from silo_server.web.attachments import kind_words
from silo_server.web.forms import Form, back, compared, problems_of, same_text, text, whole
from silo_server.web.render import N_, _, isolate, page, segment
from silo_server.web.unsent_form import UnsentForm

router = APIRouter(route_class=NumberedRoute, include_in_schema=False)

# The item's own fields; those of its properties are called ``p.NAME``, and ``o.N.name``, ``o.N.value``.
TEXTS = ItemTexts.model_fields
OWN = ("part_number", "name", "description", "category", "item_type", *TEXTS)
LABELS = {
    "part_number": N_("Part number"),
    "name": N_("Name"),
    "description": N_("Description"),
    "category": N_("Category"),
    "item_type": N_("Type"),
    **{name: field.title or name for name, field in TEXTS.items()},
}
EMPTY_ROWS = 2
SHORT, LONGEST = 200, 10_000


@dataclass(frozen=True)
class FormState:
    """A form as it stands: what is typed, what it was made from, what is wrong, and what others changed."""

    typed: Mapping[str, str]
    was: Mapping[str, str] = field(default_factory=dict)
    problems: Sequence[str] = ()
    clashes: Mapping[str, str] = field(default_factory=dict)
    status: int = 200


@router.get("/items/new")
def new_page(call: Writer, category: str = "") -> Response:
    """Show an empty form for a new item."""
    typed = {"category": category, "id": str(uuid.uuid4())}
    typed |= {
        f"p.{property_field.name}": property_field.default
        for property_field in find_schema(None).fields
        if property_field.default
    }
    return _page(call, None, FormState(typed))


@router.post("/items/new")
def make(call: Writer, form: Form) -> Response:
    """Make an item; a form that is sent twice makes only one, as its ``id`` is the same."""
    typed = _typed(form) | {"id": text(form, "id")}
    try:
        properties, problems = _properties(typed, {}, {})
        # A currency alone says nothing.
        if "standard_cost" not in properties:
            properties.pop("currency", None)
        if not typed["name"]:
            problems.insert(0, _("Name: wanted a name, got nothing"))
        if not typed["category"] and not typed["part_number"]:
            problems.insert(0, _("Category: choose one, or give a part number of your own"))
        if problems:
            raise RejectedError("; ".join(problems), problems)
        new = NewItem(
            category=typed["category"] or None,
            part_number=typed["part_number"] or None,
            uuid=typed["id"] or None,
            name=typed["name"],
            description=typed["description"],
            item_type=typed["item_type"] or None,
            texts={name: typed[name] or None for name in TEXTS},
            properties=properties,
        )
        with call.write() as tx:
            item, made = service.create_item(tx, new)
    except SiloError as error:
        return _page(call, None, FormState(typed, {}, problems_of(error), {}, error.status_hint))
    notice = _(
        "%(number)s made." if made else "%(number)s was made already.", number=isolate(item.part_number)
    )
    return back(f"/items/{segment(item.part_number)}", notice)


@router.get("/items/{part_number}/edit")
def edit_page(call: Writer, part_number: str) -> Response:
    """Show the form with the present values of an item."""
    with call.read() as tx:
        item = get_item(tx, part_number)
        uses = where_used(tx, item, limit=1)[1]
    now = texts_of(item)
    return _page(call, item, FormState(now, now), uses)


@router.post("/items/{part_number}/edit")
def change(call: Writer, part_number: str, form: Form) -> Response:
    """Save what the person changed in the form."""
    typed, was = _typed(form), _typed(form, "was.")
    weighed = text(form, "weighed")
    try:
        with call.write() as tx:
            item = get_item(tx, part_number, lock=True)
            now = texts_of(item)
            empty = dict.fromkeys([*now, *was, *typed], "")
            edit = compared({**empty, **now}, {**empty, **was}, {**empty, **typed}, same=_same)
            clashes = {name: now.get(name, "") for name in edit.clashes}
            after = (
                item
                if clashes
                else _change(tx, item, {**typed, "weighed": weighed}, set(edit.mine), text(form, "comment"))
            )
    except SiloError as error:
        return _again(call, part_number, FormState(typed, was, problems_of(error), {}, error.status_hint))
    if clashes:
        # What others changed and this person did not is taken over; the rest is asked about.
        merged = {**now, **{name: typed.get(name, "") for name in [*edit.mine, *clashes]}}
        problem = _(
            "Meanwhile %(user)s changed this item, so nothing was saved yet.",
            user=isolate(item.updated_by),
        )
        return _again(call, part_number, FormState(merged, now, [problem], clashes, 412))
    notice = (
        _("%(number)s changed.", number=isolate(after.part_number))
        if after.version != item.version
        else _("Nothing differs, so nothing was saved.")
    )
    return back(f"/items/{segment(after.part_number)}", notice)


@router.post("/items/{part_number}/file")
def upload(call: Writer, part_number: str, form: Form) -> Response:
    """Store an uploaded file as a new revision of the item."""
    file = form.get("file")
    path = f"/items/{segment(part_number)}"
    if not isinstance(file, UploadFile) or not file.filename:
        raise RejectedError(_("no file was chosen, so nothing was uploaded"))

    def answer(tx: Tx, of: Item | Document, revision: Revision) -> Response:
        if revision.kind not in (None, MODEL):
            attached = _(
                "%(file)s lies beside the model: %(kind)s, revision %(number)s.",
                file=isolate(revision.file_name or ""),
                kind=kind_words()[revision.kind],
                number=revision.revision_number,
            )
            return back(f"{path}#attachments", attached)
        notice = _(
            "%(file)s is revision %(number)s.",
            file=isolate(revision.file_name or ""),
            number=revision.revision_number,
        )
        if isinstance(of, Item) and (draft := draft_of(tx, of)):
            notice += _(" It is part of draft %(label)s; revision %(released)s stays as it is.", **draft)
        return back(f"{path}#revisions", notice)

    comment, key = text(form, "comment", LONGEST), text(form, "key", 128) or None
    kind = text(form, "kind", 20)
    origin = RevisionOrigin(whole(form, "base_revision"))
    try:
        return store_file(
            call, numbered(part_number), file, comment, answer, key=key, origin=origin, kind=kind
        )
    except NewerRevisionError as error:
        # Who sends the form of that page has read of the newer revision: the file goes on top of it.
        newest = str(error.revision["revision_number"])
        fields = {"comment": comment, "key": secrets.token_urlsafe(16), "base_revision": newest}
        call.request.state.kept = UnsentForm(f"{path}/file", list(fields.items()), [("file", file.filename)])
        again = _(
            "%(user)s made revision %(newest)s after you opened this page. Look at that file first; to put "
            "yours on top of it, choose it again and send it",
            user=error.revision["created_by"],
            newest=newest,
        )
        raise NewerRevisionError(again, error.revision) from None


@router.post("/items/{part_number}/archive")
def archive(call: Writer, part_number: str, form: Form) -> Response:
    """Put an item into the archive."""
    with call.write() as tx:
        item = service.get_item(tx, part_number)
        used, uses = where_used(tx, item, limit=5)
        service.archive_item(tx, part_number, whole(form, "version"))
    notice = _("%(number)s is in the archive. Its number stays taken.", number=isolate(part_number))
    if uses:
        numbers = ", ".join(isolate(usage.parent.part_number) for usage in used)
        more = _(" and %(used)s more", used=uses - len(used)) if uses > len(used) else ""
        notice += _(" It stays in the BOM of %(numbers)s.", numbers=numbers + more)
    return back(f"/items/{segment(part_number)}", notice)


@router.post("/items/{part_number}/unarchive")
def unarchive(call: Writer, part_number: str, form: Form) -> Response:
    """Bring an item back from the archive."""
    with call.write() as tx:
        item = service.unarchive_item(tx, part_number)
    return back(
        f"/items/{segment(item.part_number)}", _("%(number)s is back.", number=isolate(item.part_number))
    )


def texts_of(item: Item) -> dict[str, str]:
    """Write an item as the texts of its form."""
    shown = {name: str((item.texts[name] if name in TEXTS else getattr(item, name)) or "") for name in OWN}
    names = {property_field.name for property_field in find_schema(None).fields}
    for name, value in item.properties.items():
        if name in names and not (isinstance(value, str) and len(value) > LONGEST):
            shown[f"p.{name}"] = property_text(value)
        elif _is_plain(value):
            shown[f"o.{name}"] = property_text(value)
    return shown


def property_text(value: Any) -> str:
    """Write a property as text: numbers as people read them, what is nested as JSON."""
    if isinstance(value, str):
        return value
    if isinstance(value, bool) or value is None or isinstance(value, list | dict):
        return json.dumps(value, ensure_ascii=False)
    return repr(plain(value)) if isinstance(value, float) else str(value)


def shown_properties(item: Item) -> list[tuple[str, str, str]]:
    """List (label, text, unit) of an item's texts and properties, those of the schema in its order."""
    fields = {column.name: column for column in find_schema(None).fields}
    order = [name for name in fields if name in item.properties]
    order += sorted(name for name in item.properties if name not in fields)
    if item.supplier_parts:  # they have a page of their own, which counts
        order = [name for name in order if name not in ("supplier", "supplier_part_number", "lead_time_days")]
    hinted = {name: text_hints(field) for name, field in TEXTS.items()}
    # The page has places of its own for choices and long texts.
    apart = [name for name, hints in hinted.items() if "options" in hints or hints.get("long")]
    plain_texts = [name for name in hinted if item.texts[name] and name not in apart]
    properties = [(_(LABELS[name]), item.texts[name] or "", "") for name in plain_texts]
    for name in order:
        property_field = fields.get(name)
        value = item.properties[name]
        label, text_, unit = name, property_text(value), ""
        if property_field:
            label, unit = _(property_field.label), property_field.unit
        elif name in _MEASURED and all(isinstance(column, int | float) for column in _listed(value)):
            label, factor, digits, unit = _MEASURED[name]
            label = _(label)
            text_ = " × ".join(f"{column * factor:.{digits}g}" for column in _listed(value))
        if from_where := item.origins.get(name):
            word = {"cad": _("from CAD"), "scale": _("weighed"), "hand": _("by hand")}[from_where["source"]]
            unit = f"{unit} ({word}, {from_where['at'][:10]})".strip()
        properties.append((label, text_, unit))
    return properties


# What files state besides the fields of the schema: label, factor, unit.
_MEASURED = {
    "size_m": (N_("Outer dimensions"), 1e3, 6, "mm"),
    "volume_m3": (N_("Volume"), 1e6, 6, "cm³"),
    "com_m": (N_("Centre of mass"), 1e3, 4, "mm"),
}


def _listed(value: Any) -> list[Any]:
    return value if isinstance(value, list) else [value]


def _change(tx: Tx, item: Item, typed: Mapping[str, str], mine: set[str], comment: str) -> Item:
    own = {name: typed.get(name, "") for name in OWN if name in mine}
    problems: list[str] = []
    if own.get("name") == "":
        problems.append(_("Name: wanted a name, got nothing"))
    changed = {name for name in mine if name.startswith(("p.", "o."))}
    properties: dict[str, Any] | None = None
    if changed:
        properties, wrong = _properties(typed, item.properties, changed)
        problems += wrong
    if problems:
        raise RejectedError("; ".join(problems), problems)
    texts = {name: own.pop(name) for name in TEXTS if name in own}
    source: FactSource = "scale" if typed.get("weighed") and mine >= {"p.mass_kg"} else "hand"
    given = ItemChange(**own, texts=texts, properties=properties, comment=comment, source=source)
    return change_item_and_lines(tx, item.part_number, given)


def _properties(
    typed: Mapping[str, str], before: Mapping[str, Any], changed: set[str] | Mapping[str, Any]
) -> tuple[dict[str, Any], list[str]]:
    """Read the properties of a form, and what is wrong with them; ``changed`` empty: all fields."""
    fields = {property_field.name: property_field for property_field in find_schema(None).fields}
    properties, problems = dict(before), []
    for key in changed or [key for key in typed if key.startswith(("p.", "o."))]:
        kind, _point, name = key.partition(".")
        written = typed.get(key, "")
        if not written:
            properties.pop(name, None)
        elif kind == "p" and name in fields:
            try:
                properties[name] = fields[name].read(written)
            except RejectedError as error:
                problems.append(str(error))
        elif name in fields:
            problems.append(
                _(
                    "%(name)s: the schema has a field for it, “%(label)s”; put it there",
                    name=name,
                    label=_(fields[name].label),
                )
            )
        else:
            properties[name] = _as_before(written, before.get(name))
    return properties, problems


def _as_before(written: str, before: Any) -> Any:
    """Read a property without a field: a number or a truth value stays one, if what was typed is one."""
    if isinstance(before, bool):
        return {"true": True, "false": False}.get(written.casefold(), written)
    if isinstance(before, int | float):
        value = read_number(written, points_are_decimal=True).value
        return written if value is None else plain(value)
    return written


def _typed(form: FormData, prefix: str = "") -> dict[str, str]:
    """Read the texts of a form by field; properties without a field come as pairs of name and value."""
    typed = {name: _text(form, prefix + name) for name in OWN if prefix + name in form}
    if not prefix:
        typed = dict.fromkeys(OWN, "") | typed
    for key in form:
        if key.startswith(f"{prefix}p.") or (prefix and key.startswith(f"{prefix}o.")):
            typed[key[len(prefix) :]] = _text(form, key)
        elif not prefix and key.startswith("o.") and key.endswith(".name"):
            name = text(form, key, 200)
            if name:
                typed[f"o.{name}"] = _text(form, f"{key[:-5]}.value")
    return typed


def _same(name: str, a: str, b: str) -> bool:
    return same_text(a, b, lines=name in TEXTS and bool(text_hints(TEXTS[name]).get("long")))


def _text(form: FormData, key: str) -> str:
    return text(form, key, SHORT if key == "name" else LONGEST)


def _is_plain(value: Any) -> bool:
    return isinstance(value, bool | int | float) or (isinstance(value, str) and len(value) <= LONGEST)


def _again(call: Call, part_number: str, shown: FormState) -> Response:
    with call.read() as tx:
        item = get_item(tx, part_number)
        uses = where_used(tx, item, limit=1)[1]
    return _page(call, item, shown, uses)


def _page(call: Call, item: Item | None, shown: FormState, uses: int = 0) -> Response:
    with call.read() as tx:
        schema = scheme_of(tx)
    fields = [
        (property_field, shown.typed.get(f"p.{property_field.name}", "")) for property_field in schema.fields
    ]
    others = {name[2:]: value for name, value in shown.typed.items() if name.startswith("o.")}
    nested = (
        {n: property_text(v) for n, v in item.properties.items() if not (_is_plain(v) or n in _MEASURED)}
        if item
        else {}
    )
    groups: dict[str, list[Category]] = {}
    for category in schema.categories.values():
        groups.setdefault(schema.domains[category.domain], []).append(category)
    labels = {name: _(label) for name, label in LABELS.items()}
    labels |= {f"p.{property_field.name}": _(property_field.title) for property_field in schema.fields}
    return page(
        call,
        "item_edit.html",
        status=shown.status,
        item=item,
        shown=shown,
        fields=fields,
        others=[*others.items(), *[("", "")] * EMPTY_ROWS],
        nested=nested,
        groups=groups,
        types=ITEM_TYPES,
        texts={name: text_hints(field) for name, field in TEXTS.items()},
        labels=labels,
        uses=uses,
    )
