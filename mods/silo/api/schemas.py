# SPDX-License-Identifier: LGPL-2.1-or-later
"""Reading a part-number schema, in the forms that servers give it; pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any

from silo.bom.categories import Rule
from silo.bom.errors import InputError


def categories_of(schema: Mapping[str, Any]) -> dict[str, str]:
    """The categories of a schema: ``{"F01": "Screws and Bolts"}``, in the schema's own order.

    Accepts ``categories`` or the ``category`` segment's ``values``, each as a mapping code → text or as a
    list of objects or bare codes. An unknown form gives an empty mapping.
    """
    direct = schema.get("categories")
    if direct:
        return dict(_read(direct))
    for segment in _segments(schema.get("segments")):
        if segment.get("name") == "category":
            return dict(_read(segment.get("values") or segment.get("options")))
    return {}


def schema_names(said: Any) -> list[str]:
    """The names in a list of schemas: objects or bare names, bare or under ``schemas``, or by name."""
    if isinstance(said, Mapping):
        said = said.get("schemas", said.get("items", said.get("data", said)))
    if isinstance(said, Mapping):
        return [str(name) for name, body in said.items() if isinstance(body, Mapping)]
    names = [body.get("name") if isinstance(body, Mapping) else body for body in said or ()]
    return list(dict.fromkeys(name for name in names if isinstance(name, str) and name))


def _segments(value: Any) -> Iterator[Mapping[str, Any]]:
    if isinstance(value, Mapping):
        yield from ({"name": name, **body} for name, body in value.items() if isinstance(body, Mapping))
    elif isinstance(value, list):
        yield from (body for body in value if isinstance(body, Mapping))


def _read(values: Any) -> Iterator[tuple[str, str]]:
    if isinstance(values, Mapping):
        pairs = [(code, body) for code, body in values.items()]
    elif isinstance(values, list):
        pairs = [(body, body) if isinstance(body, str) else (None, body) for body in values]
    else:
        return
    for code, body in pairs:
        if isinstance(body, Mapping):
            code = code or body.get("code") or body.get("value")
            body = body.get("description") or body.get("name") or body.get("label") or ""
        if code:
            yield str(code), str(body) if body != code else ""


def rules_of(schema: Mapping[str, Any]) -> tuple[Rule, ...]:
    """The site's rules for categories (``category_rules``); a rule that cannot be read is left out.

    They only propose, so that a server with other rules, or none, costs a question and no more.
    """
    found = []
    raw = schema.get("category_rules")
    for one in raw if isinstance(raw, list) else ():
        with suppress(InputError):
            found.append(Rule.read(one))
    return tuple(found)
