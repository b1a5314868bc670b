# SPDX-License-Identifier: LGPL-2.1-or-later
"""Making items and changing them: names, category, properties of the schema and others, files, the archive.

A form sends what it was made from beside what was typed, so that only what a person changed is changed. Where
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

from silo.api.wire import ItemTexts
from silo.bom.errors import NewerRevisionError, RejectedError, SiloError
from silo.bom.numbers import plain, read_number
from silo_server.db.engine import Tx
from silo_server.routes.context import Call
from silo_server.routes.items import numbered, store_file
from silo_server.schema.catalog import ITEM_TYPES, Category, find_schema, text_hints
from silo_server.services import items as service
from silo_server.services.bom.tree import where_used
from silo_server.services.items import ItemChange, NewItem, get_item
from silo_server.services.revisions import Origin
from silo_server.values import Item, Revision
from silo_server.web.accounts import Writer
from silo_server.web.forms import Form, Kept, back, compared, same_text, text, whole
from silo_server.web.render import isolate, page, segment

router = APIRouter(include_in_schema=False)

# The item's own fields; those of its properties are called ``p.NAME``, and ``o.N.name``, ``o.N.value``.
TEXTS = ItemTexts.model_fields
OWN = ("part_number", "name", "description", "category", "item_type", *TEXTS)
LABELS = {
    "part_number": "Part number",
    "name": "Name",
    "description": "Description",
    "category": "Category",
    "item_type": "Type",
    **{name: field.title or name for name, field in TEXTS.items()},
}
EMPTY_ROWS = 2
SHORT, LONGEST = 200, 10_000


@dataclass(frozen=True)
class Shown:
    """A form as it stands: what is typed, what it was made from, what is wrong, and what others changed."""

    typed: Mapping[str, str]
    was: Mapping[str, str] = field(default_factory=dict)
    problems: Sequence[str] = ()
    clashes: Mapping[str, str] = field(default_factory=dict)
    status: int = 200


@router.get("/items/new")
def new_page(call: Writer, category: str = "") -> Response:
    """An empty form."""
    typed = {"category": category, "id": str(uuid.uuid4())}
    typed |= {f"p.{one.name}": one.default for one in find_schema(None).fields if one.default}
    return _page(call, None, Shown(typed))


@router.post("/items/new")
def make(call: Writer, form: Form) -> Response:
    """Make an item; the form's ``id`` makes a form that is sent twice one item."""
    typed = _typed(form) | {"id": text(form, "id")}
    try:
        properties, problems = _properties(typed, {}, {})
        # A currency alone says nothing.
        if "standard_cost" not in properties:
            properties.pop("currency", None)
        if not typed["name"]:
            problems.insert(0, "Name: wanted a name, got nothing")
        if not typed["category"] and not typed["part_number"]:
            problems.insert(0, "Category: choose one, or give a part number of your own")
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
        return _page(call, None, Shown(typed, {}, _problems(error), {}, error.status_hint))
    said = f"{isolate(item.part_number)} made." if made else f"{isolate(item.part_number)} was made already."
    return back(f"/items/{segment(item.part_number)}", said)


@router.get("/items/{part_number}/edit")
def edit_page(call: Writer, part_number: str) -> Response:
    """The form with what the item is."""
    with call.read() as tx:
        item = get_item(tx, part_number)
        uses = where_used(tx, item, limit=1)[1]
    now = texts_of(item)
    return _page(call, item, Shown(now, now), uses)


@router.post("/items/{part_number}/edit")
def change(call: Writer, part_number: str, form: Form) -> Response:
    """Change what the person changed in the form."""
    typed, was = _typed(form), _typed(form, "was.")
    try:
        with call.write() as tx:
            item = get_item(tx, part_number, lock=True)
            now = texts_of(item)
            empty = dict.fromkeys([*now, *was, *typed], "")
            edit = compared({**empty, **now}, {**empty, **was}, {**empty, **typed}, same=_same)
            clashes = {name: now.get(name, "") for name in edit.clashes}
            after = item if clashes else _change(tx, item, typed, set(edit.mine), text(form, "comment"))
    except SiloError as error:
        return _again(call, part_number, Shown(typed, was, _problems(error), {}, error.status_hint))
    if clashes:
        # What others changed and this person did not is taken over; the rest is asked about.
        merged = {**now, **{name: typed.get(name, "") for name in [*edit.mine, *clashes]}}
        problem = (
            f"{isolate(item.updated_by)} changed this item while you were editing, so nothing was saved yet."
        )
        return _again(call, part_number, Shown(merged, now, [problem], clashes, 412))
    said = (
        f"{isolate(after.part_number)} changed."
        if after.version != item.version
        else "Nothing was different."
    )
    return back(f"/items/{segment(after.part_number)}", said)


@router.post("/items/{part_number}/file")
def upload(call: Writer, part_number: str, form: Form) -> Response:
    """A file as a new revision."""
    file = form.get("file")
    path = f"/items/{segment(part_number)}"
    if not isinstance(file, UploadFile) or not file.filename:
        raise RejectedError("no file was chosen, so nothing was uploaded")

    def answer(_of: object, revision: Revision) -> Response:
        said = f"{isolate(revision.file_name or '')} is revision {revision.revision_number}."
        return back(f"{path}#revisions", said)

    comment, key = text(form, "comment", LONGEST), text(form, "key", 128) or None
    origin = Origin(whole(form, "base_revision"))
    try:
        return store_file(call, numbered(part_number), file, comment, answer, key=key, origin=origin)
    except NewerRevisionError as error:
        # Who sends the form of that page has read of the newer revision: the file goes on top of it.
        newest = str(error.revision["revision_number"])
        fields = {"comment": comment, "key": secrets.token_urlsafe(16), "base_revision": newest}
        call.request.state.kept = Kept(f"{path}/file", list(fields.items()), [("file", file.filename)])
        again = (
            f"{error.revision['created_by']} made revision {newest} after you opened this page. Look at that "
            "file first; to put yours on top of it, choose it again and send it"
        )
        raise NewerRevisionError(again, error.revision) from None


@router.post("/items/{part_number}/archive")
def archive(call: Writer, part_number: str, form: Form) -> Response:
    """Put an item into the archive."""
    with call.write() as tx:
        item = service.get_item(tx, part_number)
        used, uses = where_used(tx, item, limit=5)
        service.archive_item(tx, part_number, whole(form, "version"))
    said = f"{isolate(part_number)} is in the archive. Its number stays taken"
    if uses:
        more = f" and {uses - len(used)} more" if uses > len(used) else ""
        said += f"; it stays in the BOM of {', '.join(isolate(one.parent.part_number) for one in used)}{more}"
    return back(f"/items/{segment(part_number)}", f"{said}.")


@router.post("/items/{part_number}/unarchive")
def unarchive(call: Writer, part_number: str, form: Form) -> Response:
    """Bring an item back."""
    with call.write() as tx:
        item = service.unarchive_item(tx, part_number)
    return back(f"/items/{segment(item.part_number)}", f"{isolate(item.part_number)} is back.")


def texts_of(item: Item) -> dict[str, str]:
    """An item as the texts of its form."""
    shown = {name: str((item.texts[name] if name in TEXTS else getattr(item, name)) or "") for name in OWN}
    known = {one.name for one in find_schema(item.schema).fields}
    for name, value in item.properties.items():
        if name in known and not (isinstance(value, str) and len(value) > LONGEST):
            shown[f"p.{name}"] = property_text(value)
        elif _is_plain(value):
            shown[f"o.{name}"] = property_text(value)
    return shown


def property_text(value: Any) -> str:
    """A property as text: numbers as people read them, what is nested as JSON."""
    if isinstance(value, str):
        return value
    if isinstance(value, bool) or value is None or isinstance(value, list | dict):
        return json.dumps(value, ensure_ascii=False)
    return repr(plain(value)) if isinstance(value, float) else str(value)


def shown_properties(item: Item) -> list[tuple[str, str, str]]:
    """(label, text, unit) of an item's properties: those of the schema first, in its order."""
    fields = {one.name: one for one in find_schema(item.schema).fields}
    order = [name for name in fields if name in item.properties]
    order += sorted(name for name in item.properties if name not in fields)
    hinted = {name: text_hints(field) for name, field in TEXTS.items()}
    # The page has places of its own for choices and long texts.
    plain_texts = [name for name, hints in hinted.items() if item.texts[name] and not hints]
    found = [(LABELS[name], item.texts[name] or "", "") for name in plain_texts]
    for name in order:
        known = fields.get(name)
        text_ = property_text(item.properties[name])
        found.append((known.label if known else name, text_, known.unit if known else ""))
    return found


def _change(tx: Tx, item: Item, typed: Mapping[str, str], mine: set[str], comment: str) -> Item:
    own = {name: typed.get(name, "") for name in OWN if name in mine}
    problems: list[str] = []
    if own.get("name") == "":
        problems.append("Name: wanted a name, got nothing")
    changed = {name for name in mine if name.startswith(("p.", "o."))}
    properties: dict[str, Any] | None = None
    if changed:
        properties, wrong = _properties(typed, item.properties, changed)
        problems += wrong
    if problems:
        raise RejectedError("; ".join(problems), problems)
    texts = {name: own.pop(name) for name in TEXTS if name in own}
    given = ItemChange(**own, texts=texts, properties=properties, comment=comment)
    return service.change_item(tx, item.part_number, given)


def _properties(
    typed: Mapping[str, str], before: Mapping[str, Any], changed: set[str] | Mapping[str, Any]
) -> tuple[dict[str, Any], list[str]]:
    """The properties behind a form, and what is wrong with it; ``changed`` empty: all that is typed."""
    fields = {one.name: one for one in find_schema(None).fields}
    found, problems = dict(before), []
    for key in changed or [key for key in typed if key.startswith(("p.", "o."))]:
        kind, _, name = key.partition(".")
        written = typed.get(key, "")
        if not written:
            found.pop(name, None)
        elif kind == "p" and name in fields:
            try:
                found[name] = fields[name].read(written)
            except RejectedError as error:
                problems.append(str(error))
        elif name in fields:
            problems.append(f"{name}: the schema has a field for it, “{fields[name].label}”; put it there")
        else:
            found[name] = _as_before(written, before.get(name))
    return found, problems


def _as_before(written: str, before: Any) -> Any:
    """A property without a field: a number or a truth value stays one, where what was typed is one."""
    if isinstance(before, bool):
        return {"true": True, "false": False}.get(written.casefold(), written)
    if isinstance(before, int | float):
        value = read_number(written, points_are_decimal=True).value
        return written if value is None else plain(value)
    return written


def _typed(form: FormData, prefix: str = "") -> dict[str, str]:
    """The texts of a form by field; properties without a field come as pairs of name and value."""
    found = {name: _text(form, prefix + name) for name in OWN if prefix + name in form}
    if not prefix:
        found = dict.fromkeys(OWN, "") | found
    for key in form:
        if key.startswith(f"{prefix}p.") or (prefix and key.startswith(f"{prefix}o.")):
            found[key[len(prefix) :]] = _text(form, key)
        elif not prefix and key.startswith("o.") and key.endswith(".name"):
            name = text(form, key, 200)
            if name:
                found[f"o.{name}"] = _text(form, f"{key[:-5]}.value")
    return found


def _same(name: str, a: str, b: str) -> bool:
    return same_text(a, b, lines=name in TEXTS and bool(text_hints(TEXTS[name]).get("long")))


def _text(form: FormData, key: str) -> str:
    return text(form, key, SHORT if key == "name" else LONGEST)


def _is_plain(value: Any) -> bool:
    return isinstance(value, bool | int | float) or (isinstance(value, str) and len(value) <= LONGEST)


def _again(call: Call, part_number: str, shown: Shown) -> Response:
    with call.read() as tx:
        item = get_item(tx, part_number)
        uses = where_used(tx, item, limit=1)[1]
    return _page(call, item, shown, uses)


def _page(call: Call, item: Item | None, shown: Shown, uses: int = 0) -> Response:
    schema = find_schema(item.schema if item else None)
    fields = [(one, shown.typed.get(f"p.{one.name}", "")) for one in schema.fields]
    others = {name[2:]: value for name, value in shown.typed.items() if name.startswith("o.")}
    nested = {n: property_text(v) for n, v in item.properties.items() if not _is_plain(v)} if item else {}
    groups: dict[str, list[Category]] = {}
    for one in schema.categories.values():
        groups.setdefault(schema.domains[one.domain], []).append(one)
    labels = LABELS | {f"p.{one.name}": one.title for one in schema.fields}
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


def _problems(error: SiloError) -> list[str]:
    problems = error.problems if isinstance(error, RejectedError) and error.problems else [str(error)]
    return [f"{problem[:1].upper()}{problem[1:]}" for problem in problems]
