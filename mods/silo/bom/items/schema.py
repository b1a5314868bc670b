# SPDX-License-Identifier: LGPL-2.1-or-later
"""The categories of a site's schema, with the site's rules for choosing one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from silo.bom.errors import InputError
from silo.bom.items.stems import stem
from silo.bom.message import message


@dataclass(frozen=True)
class CategoryRule:
    """A rule of the site: all of ``words`` in the name, none of ``without``, give the category."""

    category: str
    words: frozenset[str]
    without: frozenset[str] = frozenset()

    @classmethod
    def read(cls, raw: object) -> CategoryRule:
        """Read a rule from TOML or JSON: ``{words = ["motor", "frame"], category = "M06"}``. InputError."""
        if not isinstance(raw, Mapping):
            raise InputError(
                message("category rule: wanted a table with words and category, got {raw}", raw=repr(raw))
            )
        if unknown := sorted(set(raw) - {"category", "words", "without"}):
            raise InputError(
                message("category rule: unknown keys: {unknown}", unknown=", ".join(map(str, unknown)))
            )
        category, words = raw.get("category"), _texts(raw, "words")
        if not isinstance(category, str) or not category or not words:
            raise InputError(
                message("category rule: wanted words and a category, got {raw}", raw=repr(dict(raw)))
            )
        return cls(category, words, _texts(raw, "without"))

    def fits(self, words: frozenset[str]) -> bool:
        """Return True if the rule applies to a name with these words."""
        return self.words <= words and not self.without & words


def _texts(raw: Mapping[str, object], key: str) -> frozenset[str]:
    value = raw.get(key, [])
    if not isinstance(value, list) or not all(isinstance(word, str) and word for word in value):
        raise InputError(
            message("category rule: {key} must be a list of words, got {value}", key=key, value=repr(value))
        )
    return frozenset(stem(word) for word in value)


class Categories(dict[str, str]):
    """Code → description, in the schema's order, with the rules of the site.

    problem
        why the rules of the site are not used; "" where they are, or where there are none.
    """

    def __init__(
        self, known: Mapping[str, str], rules: Iterable[CategoryRule] = (), problem: str = ""
    ) -> None:
        super().__init__(known)
        self.rules = tuple(rules)
        self.problem = problem


def categories_of(schema: Mapping[str, Any]) -> dict[str, str]:
    """Return the categories of a schema: ``{"F01": "Screws and Bolts"}``, in the schema's own order.

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


def schema_names(answer: Any) -> list[str]:
    """Read the names in a list of schemas: objects or bare names, bare or under ``schemas``, or by name."""
    if isinstance(answer, Mapping):
        answer = answer.get("schemas", answer.get("items", answer.get("data", answer)))
    if isinstance(answer, Mapping):
        return [str(name) for name, body in answer.items() if isinstance(body, Mapping)]
    names = [body.get("name") if isinstance(body, Mapping) else body for body in answer or ()]
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
    for code, text in pairs:
        if isinstance(text, Mapping):
            code = code or text.get("code") or text.get("value")
            text = text.get("description") or text.get("name") or text.get("label") or ""
        if code:
            yield str(code), str(text) if text != code else ""


def rules_of(schema: Mapping[str, Any]) -> tuple[CategoryRule, ...]:
    """Read the site's rules for categories (``category_rules``); a rule that cannot be read is left out.

    They only propose; a server with other rules, or none, only costs a question.
    """
    rules = []
    raw = schema.get("category_rules")
    for rule in raw if isinstance(raw, list) else ():
        with suppress(InputError):
            rules.append(CategoryRule.read(rule))
    return tuple(rules)
