# SPDX-License-Identifier: LGPL-2.1-or-later
"""What to call a component, and the name, type and category of a new item for it (spec bom-sync §2, §6).

Only a proposal: a person confirms it, or says ``--yes``. Part numbers are made by the server.

For the category the site's own rules come first. Then the words of the name are compared with those of the
categories. The last word says what a thing is: a motor frame is a frame, and a top plate is a plate.
"""

from __future__ import annotations

import os.path
import re
import unicodedata
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from silo.bom.errors import InputError
from silo.bom.identity import walk_entries
from silo.bom.model import BomEntry

_MOST_READ = 2000
_SUFFIX = re.compile(r"\.fcstd$", re.IGNORECASE)
# Labels that FreeCAD gives by itself say nothing of the part.
_GENERIC = re.compile(
    r"(?:body|part|assembly|model|unnamed|link|compound|solid|fusion|cut)[ _]?\d*$", re.IGNORECASE
)


@dataclass(frozen=True)
class Proposal:
    """How a component would be registered.

    shares_file
        its file gives other components too.
    is_guess
        the category was found by little: a person has to look at it first.
    """

    entry: BomEntry
    name: str
    item_type: str
    category: str
    shares_file: bool = False
    is_guess: bool = False


def is_generic(label: str) -> bool:
    """True for a label that FreeCAD gave by itself, and for none."""
    return not label or _GENERIC.match(label) is not None


def clean_name(text: str) -> str:
    """A label as a name for people: no file suffix, no control characters, single spaces."""
    # A label may be megabytes long, and no more than the beginning of it is used.
    text = _SUFFIX.sub("", unicodedata.normalize("NFC", text[:_MOST_READ]))
    printable = "".join(" " if unicodedata.category(c) in ("Cc", "Cf", "Cs", "Zl", "Zp") else c for c in text)
    return " ".join(printable.replace("_", " ").split())[:200]


def name_key(text: str) -> str:
    """What two names have in common that read as one: cleaned, in any case."""
    return clean_name(text).casefold()


def crowded_files(entries: Iterable[BomEntry]) -> frozenset[str]:
    """Files that give more than one component of this tree; standard parts need no place in a file."""
    files = Counter(entry.doc_path for entry in walk_entries(entries) if not entry.is_standard)
    return frozenset(path for path, count in files.items() if count > 1)


def proposed_name(entry: BomEntry, *, shares_file: bool = False) -> str:
    """The document's label (spec §2), or the object's where that says more.

    FreeCAD makes a document's label from its file's name; only one that a person chose (it differs) stands
    before an object's own label. Where a file gives several components, the object's label decides.
    """
    if entry.standard:
        return entry.standard
    of_document, of_object = clean_name(entry.document_label), clean_name(entry.label)
    stem = clean_name(os.path.splitext(os.path.basename(entry.doc_path))[0])
    chosen = of_document not in ("", stem)
    if of_object and not _GENERIC.match(of_object) and (shares_file or not chosen):
        return of_object
    return of_document or of_object or "Unnamed component"


def display_name(entry: BomEntry) -> str:
    """What to call a component before people: its own label, or its document's where that says nothing.

    A standard part is called by its designation.
    """
    if entry.standard:
        return entry.standard
    label = clean_name(entry.label)
    return label if label and not _GENERIC.match(label) else clean_name(entry.document_label) or label


def propose(entry: BomEntry, categories: Mapping[str, str], *, shares_file: bool = False) -> Proposal:
    """Type from the document, name from the label, category from the schema."""
    name = proposed_name(entry, shares_file=shares_file)
    guess = proposed_category(entry, name, categories)
    return Proposal(
        entry=entry,
        name=name,
        item_type="assembly" if entry.is_assembly else "part",
        category=guess.code,
        shares_file=shares_file,
        is_guess=not guess.is_sure,
    )


def propose_all(
    entries: Iterable[BomEntry], tree: Iterable[BomEntry], categories: Mapping[str, str]
) -> list[Proposal]:
    """A proposal for each; ``tree`` is all that the assembly holds, and says which files are shared."""
    crowded = crowded_files(tree)
    return [propose(entry, categories, shares_file=entry.doc_path in crowded) for entry in entries]


SURE = 0.5
"""From this confidence on, a category is proposed without a question."""

_WORD = re.compile(r"[^\W\d_]{3,}")
# BasePlate is two words.
_HUMP = re.compile(r"(?<=[a-z])(?=[A-Z])")
_STANDARD_WORDS = ("fastener", "screw", "hardware", "standard part", "purchased", "bought")
# In the order of preference, for components whose name fits no category.
_PART_WORDS = ("part", "machin", "custom", "manufactur", "component", "mechanic")


@dataclass(frozen=True)
class Rule:
    """A rule of the site: all of ``words`` in the name, none of ``without``, give the category."""

    category: str
    words: frozenset[str]
    without: frozenset[str] = frozenset()

    @classmethod
    def read(cls, raw: object) -> Rule:
        """From TOML or JSON: ``{words = ["motor", "frame"], category = "M06"}``. InputError."""
        if not isinstance(raw, Mapping):
            raise InputError(f"category rule: wanted a table with words and category, got {raw!r}")
        if unknown := sorted(set(raw) - {"category", "words", "without"}):
            raise InputError(f"category rule: unknown keys: {', '.join(map(str, unknown))}")
        category, words = raw.get("category"), _texts(raw, "words")
        if not isinstance(category, str) or not category or not words:
            raise InputError(f"category rule: wanted words and a category, got {dict(raw)!r}")
        return cls(category, words, _texts(raw, "without"))

    def fits(self, words: frozenset[str]) -> bool:
        """True for the words of a name."""
        return self.words <= words and not self.without & words


def _texts(raw: Mapping[str, object], key: str) -> frozenset[str]:
    value = raw.get(key, [])
    if not isinstance(value, list) or not all(isinstance(word, str) and word for word in value):
        raise InputError(f"category rule: {key} must be a list of words, got {value!r}")
    return frozenset(_stem(word) for word in value)


class Categories(dict[str, str]):
    """Code → description, in the schema's order, with the rules of the site.

    problem
        why the rules of the site are not used; "" where they are, or where there are none.
    """

    def __init__(self, known: Mapping[str, str], rules: Iterable[Rule] = (), problem: str = "") -> None:
        super().__init__(known)
        self.rules = tuple(rules)
        self.problem = problem


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
    for code, text in pairs:
        if isinstance(text, Mapping):
            code = code or text.get("code") or text.get("value")
            text = text.get("description") or text.get("name") or text.get("label") or ""
        if code:
            yield str(code), str(text) if text != code else ""


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


@dataclass(frozen=True)
class Guess:
    """A category, and how sure it is: 0 (any would do) to 1 (a rule says so)."""

    code: str
    confidence: float

    @property
    def is_sure(self) -> bool:
        return self.confidence >= SURE


def proposed_category(entry: BomEntry, name: str, categories: Mapping[str, str]) -> Guess:
    """The category that fits best; the code is "" where there is none to choose from.

    categories
        code → description, in the schema's order; :class:`Categories` brings rules along.
    """
    assemblies = assembly_categories(categories)
    fitting = [code for code in categories if (code in assemblies) == entry.is_assembly]
    if not fitting:
        return Guess(next(iter(categories), ""), 0.0)
    if len(fitting) == 1:
        return Guess(fitting[0], 1.0)
    if entry.standard:
        for wanted in _STANDARD_WORDS:
            for code in fitting:
                if wanted in categories[code].casefold():
                    return Guess(code, 1.0)
    words = _stems(name)
    for rule in getattr(categories, "rules", ()):
        if rule.category in fitting and rule.fits(frozenset(words)):
            return Guess(rule.category, 1.0)
    if entry.is_assembly:
        # The name of an assembly says what it is for, not which kind it is.
        return Guess(fitting[0], SURE)
    scores = {code: _score(words, _stems(categories[code])) for code in fitting}
    best = max(scores.values())
    if best:
        found = [code for code in fitting if scores[code] == best]
        return Guess(found[0], best / len(found))
    for wanted in _PART_WORDS:
        for code in fitting:
            if wanted in categories[code].casefold():
                return Guess(code, 0.1)
    return Guess(fitting[0], 0.0)


def assembly_categories(categories: Mapping[str, str]) -> frozenset[str]:
    """The codes that are for assemblies: by their names, or because most of their group are.

    A group is what begins with the same letter: "Top-level product" stands among the assemblies.
    """
    named = {code for code, text in categories.items() if "assembl" in text.casefold()}
    groups: dict[str, list[str]] = {}
    for code in categories:
        groups.setdefault(code[:1], []).append(code)
    whole = (codes for codes in groups.values() if 2 * sum(code in named for code in codes) > len(codes))
    return frozenset(named.union(*whole))


def _score(name: list[str], category: list[str]) -> float:
    """How well a name fits a category: its last word counts, the others say what it is for."""
    if not name:
        return 0.0
    common = len(set(name) & set(category)) / len(set(name))
    return 0.6 + 0.4 * common if name[-1] in category else 0.2 * common


def _stems(text: str) -> list[str]:
    return [_stem(word) for word in _WORD.findall(_HUMP.sub(" ", text))]


def _stem(word: str) -> str:
    word = word.casefold()
    return word[:-1] if word.endswith("s") and len(word) > 3 else word
