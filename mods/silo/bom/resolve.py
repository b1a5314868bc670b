# SPDX-License-Identifier: LGPL-2.1-or-later
"""From Silo UUIDs to part numbers (spec bom-sync §2), in as few requests as the server allows.

What to call a component, and the name, type and category of a new item for it (spec bom-sync §2, §6).

Only a proposal: a person confirms it, or says ``--yes``. Part numbers are made by the server.

For the category the site's own rules come first. Then the words of the name are compared with those of the
categories. The last word says what a thing is: a motor frame is a frame, and a top plate is a plate.
"""

from __future__ import annotations

import os.path
import re
import unicodedata
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Protocol

from silo.bom.errors import InputError, counted, listed
from silo.bom.findings import Finding, FindingCode, Place, Severity
from silo.bom.model import BomEntry, walk_entries

# A class of a regular expression: control characters but tab and line ends, and Unicode's non-characters.
# XML, and so a workbook, has no place for them. No text may have one of them, nor half of a surrogate pair.
REFUSED_CHARACTERS = r"\u0000-\u0008\u000b\u000c\u000e-\u001f\u007f-\u009f\ufdd0-\ufdef" + "".join(
    chr(plane * 0x10000 + last) for plane in range(17) for last in (0xFFFE, 0xFFFF)
)
_REFUSED = re.compile(rf"[{REFUSED_CHARACTERS}\ud800-\udfff]")
_SIGNS = {0xD7: "x", 0x2300: "ø", 0x2205: "ø"}  # × ⌀ ∅
_TIMES = re.compile(r"(?<=\d)\s*x\s*(?=\d)")
_COMMA = re.compile(r"(?<=\d),(?=\d)")
_GLUE = re.compile(r"(?<=[^\W\d_])[\s_-]+(?=\d)")
_MOST_READ = 2000
_SUFFIX = re.compile(r"\.fcstd$", re.IGNORECASE)
# Labels that FreeCAD or an import gives by itself say nothing of the part.
_GENERIC = re.compile(
    r"(?:body|part(?:[_ ]+feature)?|assembly|model|unnamed|link|compound|solid|shell|shape|fusion|cut"
    r"|open cascade step translator.*)[ _]?\d*$|.*\.(?:stp|step|igs|iges|brp|brep)[ _]?\d*$",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class Proposal:
    """How a component would be registered.

    shares_file
        its file gives other components too.
    is_guess
        the category was found by little: a person has to look at it first.
    sourcing
        "manufactured" or "purchased"; "" while nobody has said.
    """

    entry: BomEntry
    name: str
    item_type: str
    category: str
    shares_file: bool = False
    is_guess: bool = False
    sourcing: str = ""
    supplier: str = ""
    supplier_part_number: str = ""

    @property
    def supply(self) -> dict[str, str]:
        """Return the properties of the new item that say where to buy it."""
        supply_facts = {"supplier": self.supplier, "supplier_part_number": self.supplier_part_number}
        return {name: text for name, text in supply_facts.items() if text}


def is_generic(label: str) -> bool:
    """Return True if FreeCAD gave the label by itself, or if it is empty."""
    return not label or _GENERIC.match(label) is not None


def character_problem(text: str) -> str | None:
    """Say what is wrong with the characters of a text; None if nothing is."""
    refused = _REFUSED.search(text)
    if refused is None:
        return None
    return (
        f"wanted text without control characters and non-characters, got U+{ord(refused[0]):04X} as its "
        f"character {refused.start() + 1}; type it again instead of pasting it"
    )


def with_allowed_characters(text: str, instead: str = "\ufffd") -> str:
    """Write ``instead`` for each character that :func:`character_problem` reports."""
    return _REFUSED.sub(instead, text)


def clean_name(text: str) -> str:
    """Make a name for people from a label: no file suffix, no control characters, single spaces."""
    # A label may be megabytes long, but only its beginning is used.
    text = _SUFFIX.sub("", unicodedata.normalize("NFC", with_allowed_characters(text[:_MOST_READ], " ")))
    printable = "".join(" " if unicodedata.category(c) in ("Cc", "Cf", "Cs", "Zl", "Zp") else c for c in text)
    return " ".join(printable.replace("_", " ").split())[:200]


@cache
def _unaccented(character: str) -> str:
    # Called once for each character: whole products are searched.
    return "" if unicodedata.combining(character) else character


def folded(text: str) -> str:
    """Return a text as searches compare it: without case and accents, and with one spelling of sizes.

    ``M3 × 6`` and ``M3x6``, ``2,5`` and ``2.5``, ``⌀`` and ``Ø`` are the same.
    """
    plain = text.casefold()
    if not plain.isascii():
        plain = "".join(map(_unaccented, unicodedata.normalize("NFKD", plain)))
        plain = plain.casefold().translate(_SIGNS)
    return _COMMA.sub(".", _TIMES.sub("x", plain))


def glued(text: str) -> str:
    """Join each number in a folded text to the word before it: ``iso4762`` for ``iso 4762``."""
    return _GLUE.sub("", text)


def name_key(text: str) -> str:
    """Return a text that is equal for two names that read as one: cleaned, folded, glued."""
    return glued(folded(clean_name(text)))


def crowded_files(entries: Iterable[BomEntry]) -> frozenset[str]:
    """Return the files that hold several components of this tree; standard parts do not count."""
    files = Counter(entry.doc_path for entry in walk_entries(entries) if not entry.is_standard)
    return frozenset(path for path, count in files.items() if count > 1)


def proposed_name(entry: BomEntry, *, shares_file: bool = False) -> str:
    """Return the document's label (spec §2), the object's if it says more, or the file's name.

    FreeCAD makes a document's label from its file's name; only a label that a person chose (it differs) comes
    before an object's own label. If a file gives several components, the object's label decides.
    """
    if entry.standard:
        return entry.standard
    of_document, of_object = clean_name(entry.document_label), clean_name(entry.label)
    stem = clean_name(os.path.splitext(os.path.basename(entry.doc_path))[0])
    of_document = stem if of_document and is_generic(of_document) else of_document
    chosen = of_document not in ("", stem)
    if of_object and not _GENERIC.match(of_object) and (shares_file or not chosen):
        return of_object
    return of_document or of_object or "Unnamed component"


def display_name(entry: BomEntry) -> str:
    """Return the name of a component for people: its own label, or its document's if that says nothing.

    A standard part has its designation as its name.
    """
    if entry.standard:
        return entry.standard
    label = clean_name(entry.label)
    return label if label and not _GENERIC.match(label) else clean_name(entry.document_label) or label


def propose(entry: BomEntry, categories: Mapping[str, str], *, shares_file: bool = False) -> Proposal:
    """Propose the type by the document, the name by the label, and the category by the schema."""
    name = proposed_name(entry, shares_file=shares_file)
    guess = proposed_category(entry, name, categories)
    return Proposal(
        entry=entry,
        name=name,
        item_type="assembly" if entry.is_assembly else "part",
        category=guess.code,
        shares_file=shares_file,
        is_guess=not guess.is_sure,
        sourcing="purchased" if entry.is_standard else "",
    )


def propose_all(
    entries: Iterable[BomEntry], tree: Iterable[BomEntry], categories: Mapping[str, str]
) -> list[Proposal]:
    """Make a proposal for each entry; ``tree`` is the whole assembly, and shows which files hold several
    components.
    """
    crowded = crowded_files(tree)
    return [propose(entry, categories, shares_file=entry.doc_path in crowded) for entry in entries]


SURE = 0.5
"""From this confidence on, a category is proposed without a question."""

_WORD = re.compile(r"[^\W\d_]{3,}")
# BasePlate is two words.
_HUMP = re.compile(r"(?<=[a-z])(?=[A-Z])")
# Categories for standard parts of any kind.
_STANDARD_WORDS = ("fastener", "hardware", "standard part", "purchased", "bought")
# The kind of a standard part by its standard; what is in no list has it in its designation, or is of no known
# kind. An ASME number stands for all that it begins ("B18.3.1A"). Source: the Fasteners workbench's groups.
_KINDS = {
    "nut": "ISO 4032 4033 4034 4035 4036 4161 7040 7041 7042 7043 7044 7719 7720 8673 8674 8675 10511 10512 "
    "10513 10663 12125 12126 21670 DIN 315 466 467 508 557 562 582 917 928 929 934 935 936 937 979 "
    "980 981 982 985 986 1480 1587 1624 6330 6331 6334 6915 6923 6924 6925 6926 6927 7967 EN 1661 "
    "1663 1664 1666 1667 14218 ASME B18.2.2 B18.2.4 B18.16 GOST 11860",
    "washer": "ISO 7089 7090 7091 7092 7093 7094 8738 10669 10673 DIN 125 126 127 128 137 433 434 435 436 "
    "440 988 1440 1441 2093 6319 6340 6796 6797 6798 6916 7349 7603 7989 9021 ASME B18.21 B18.22 SAE USS",
    "pin": "ISO 1234 2338 2339 2340 2341 8733 8734 8735 8736 8737 8739 8740 8741 8742 8743 8744 8745 8746 "
    "8747 8748 8749 8750 8751 8752 13337 DIN 1 7 94 1443 1444 1469 1470 1471 1472 1473 1474 1475 1481 "
    "6325 7343 7346 7977 7978 11024",
    "key": "DIN 6880 6885 6886 6887 6888",
    "rivet": "ISO 1051 15973 15974 15975 15977 15978 15979 15981 15983 DIN 660 661 662 6791 7331 7337 7340",
    "retaining ring": "DIN 471 472 983 984 6799 7993 703 705",
    "threaded rod": "DIN 975 976",
    "eyebolt": "ISO 3266 DIN 444 580",
    "screw": "ISO 1207 1479 1481 1482 1483 1580 2009 2010 2342 4014 4015 4016 4017 4018 4026 4027 4028 4029 "
    "4162 4762 4766 7045 7046 7047 7048 7049 7050 7051 7379 7380 7434 7435 7436 8676 8765 10642 12474 "
    "14579 14580 14581 14582 14583 14584 14585 14586 14587 15071 15072 15480 15481 15482 15483 15484 "
    "21269 DIN 84 85 95 96 97 316 404 464 465 478 479 480 561 564 571 603 605 607 608 653 912 913 914 "
    "915 916 920 921 923 924 925 927 931 933 960 961 963 964 965 966 967 6912 6914 6921 6922 7500 "
    "7504 7513 7516 7964 7968 7969 7971 7972 7973 7976 7981 7982 7983 7984 7985 7990 7991 7995 7996 "
    "7997 7999 EN 1662 1665 ASME B18.2.1 B18.3 B18.5 B18.6",
}
_KIND_OF = {
    f"{body} {number}": kind
    for kind, standards in _KINDS.items()
    for body, numbers in re.findall(r"([A-Z]+)((?: (?:B?[\d.]+|USS))+)", standards)
    for number in numbers.split()
}
_ALSO = {"screw": "bolt", "spacer": "standoff", "standoff": "spacer"}
# In the order of preference, for components whose name fits no category.
_PART_WORDS = ("part", "machin", "custom", "manufactur", "component", "mechanic")


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
            raise InputError(f"category rule: wanted a table with words and category, got {raw!r}")
        if unknown := sorted(set(raw) - {"category", "words", "without"}):
            raise InputError(f"category rule: unknown keys: {', '.join(map(str, unknown))}")
        category, words = raw.get("category"), _texts(raw, "words")
        if not isinstance(category, str) or not category or not words:
            raise InputError(f"category rule: wanted words and a category, got {dict(raw)!r}")
        return cls(category, words, _texts(raw, "without"))

    def fits(self, words: frozenset[str]) -> bool:
        """Return True if the rule applies to a name with these words."""
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


@dataclass(frozen=True)
class Guess:
    """A category, and how sure it is: 0 (any would do) to 1 (a rule says so)."""

    code: str
    confidence: float

    @property
    def is_sure(self) -> bool:
        return self.confidence >= SURE


def proposed_category(entry: BomEntry, name: str, categories: Mapping[str, str]) -> Guess:
    """Choose the category that fits best; its code is "" if there are no categories.

    categories
        code → description, in the schema's order; :class:`Categories` also has the rules.
    """
    assemblies = assembly_categories(categories)
    fitting = {code: text for code, text in categories.items() if (code in assemblies) == entry.is_assembly}
    if not fitting:
        return Guess(next(iter(categories), ""), 0.0)
    first = next(iter(fitting))
    if len(fitting) == 1:
        return Guess(first, 1.0)
    if entry.standard:
        return _standard_category(entry.standard, fitting, categories)
    words = stems(name)
    if guess := _by_rule(words, fitting, categories):
        return guess
    if entry.is_assembly:
        # The name of an assembly says what it is for, not which kind it is.
        return Guess(first, SURE)
    scores = {code: _score(words, stems(text)) for code, text in fitting.items()}
    best = max(scores.values())
    if best:
        codes = [code for code in fitting if scores[code] == best]
        return Guess(codes[0], best / len(codes))
    code = _first_with(_PART_WORDS, fitting)
    return Guess(code, 0.1) if code else Guess(first, 0.0)


def _by_rule(words: Iterable[str], fitting: Mapping[str, str], categories: Mapping[str, str]) -> Guess | None:
    """Guess by the first rule of the site that applies; None if none does."""
    for rule in getattr(categories, "rules", ()):
        if rule.category in fitting and rule.fits(frozenset(words)):
            return Guess(rule.category, 1.0)
    return None


def _first_with(words: Iterable[str], fitting: Mapping[str, str]) -> str:
    """Return the first category with the first of the words that any text has; "" if none has one."""
    return next((code for word in words for code, text in fitting.items() if word in text.casefold()), "")


def standard_kind(designation: str) -> str:
    """Return the kind of a standard part ("nut" for "ISO 4032 M4"); "" if it is not known."""
    match = re.match(r"([A-Z]+) ([A-Z]?\d+(?:\.\d+)*|USS)", designation)
    if match is not None:
        number = match[2]
        while number:
            if kind := _KIND_OF.get(f"{match[1]} {number}"):
                return kind
            number = number.rpartition(".")[0]
    words = stems(designation)
    kinds = (*_KINDS, "insert", *_ALSO)
    return next((kind for kind in kinds if set(stems(kind)) <= set(words)), "")


def _standard_category(designation: str, fitting: Mapping[str, str], categories: Mapping[str, str]) -> Guess:
    """Guess by the site's rules, else the one category of the kind, else one for standard parts of any
    kind.
    """
    kind = standard_kind(designation)
    for named in filter(None, (kind, _ALSO.get(kind))):
        if guess := _by_rule(stems(f"{designation} {named}"), fitting, categories):
            return guess
        codes = [code for code, text in fitting.items() if set(stems(named)) <= set(stems(text))]
        if codes:
            return Guess(codes[0], 1.0 if len(codes) == 1 else SURE / 2)
    if code := _first_with(_STANDARD_WORDS, fitting):
        return Guess(code, 1.0)
    return Guess(_first_with(["screw"], fitting) or next(iter(fitting)), 0)


def assembly_categories(categories: Mapping[str, str]) -> frozenset[str]:
    """Return the codes for assemblies: "assembl" is in their text, or in that of most of their group.

    The codes of a group begin with the same letter: "Top-level product" is among the assemblies.
    """
    named = {code for code, text in categories.items() if "assembl" in text.casefold()}
    groups: dict[str, list[str]] = {}
    for code in categories:
        groups.setdefault(code[:1], []).append(code)
    whole = (codes for codes in groups.values() if 2 * sum(code in named for code in codes) > len(codes))
    return frozenset(named.union(*whole))


def _score(name: list[str], category: list[str]) -> float:
    """Rate how well a name fits a category: its last word counts most, the others say what the part is
    for.
    """
    if not name:
        return 0.0
    common = len(set(name) & set(category)) / len(set(name))
    return 0.6 + 0.4 * common if name[-1] in category else 0.2 * common


def stems(text: str) -> list[str]:
    """Split a name into the words by which categories are found, without the plural's s."""
    return [_stem(word) for word in _WORD.findall(_HUMP.sub(" ", text))]


def _stem(word: str) -> str:
    word = word.casefold()
    return word[:-1] if word.endswith("s") and len(word) > 3 else word


class ItemLookup(Protocol):
    """What is needed of a client.

    ``get_items_by_uuid(uuids)`` is used where the client has it; it gives a mapping UUID → item (or None), or
    the items found, each naming its UUID as ``id``, ``uuid`` or ``silo_uuid``.
    """

    def get_item_by_uuid(self, uuid: str, /) -> Mapping[str, Any] | None: ...


Known = Mapping[str, Mapping[str, Any] | None]

_UUID_KEYS = ("id", "uuid", "silo_uuid")


def look_up(uuids: Iterable[str], api_client: ItemLookup) -> Known:
    """Look up the items of these UUIDs, each once; None (or absent) if the server has none."""
    wanted = list(dict.fromkeys(uuids))
    batch = getattr(api_client, "get_items_by_uuid", None)
    if callable(batch) and wanted:
        items = _by_uuid(batch(wanted))
        return {uuid: items.get(uuid) or items.get(uuid.lower()) for uuid in wanted}
    return {uuid: api_client.get_item_by_uuid(uuid) for uuid in wanted}


def _by_uuid(answer: Any) -> Known:
    if isinstance(answer, Mapping):
        return answer
    items = [item for item in answer or () if item is not None]
    return {str(item[key]): item for item in items for key in _UUID_KEYS if item.get(key)}


def resolve_part_numbers(
    entries: Sequence[BomEntry], api_client: ItemLookup
) -> tuple[list[BomEntry], list[BomEntry]]:
    """Give each entry its part number and name.

    Returns (resolved, unresolved): resolved entries in order, with resolved children, and one line for each
    part number; unresolved components of every level, each once. An unresolved sub-assembly keeps its
    (resolved) children. Missing components stay in place without a number: they cannot be looked up, and they
    are not there to be registered.
    """
    items = look_up((e.silo_uuid for e in walk_entries(entries) if e.silo_uuid), api_client)
    return resolve_with(entries, items)


def resolve_with(entries: Sequence[BomEntry], items: Known) -> tuple[list[BomEntry], list[BomEntry]]:
    """Do what :func:`resolve_part_numbers` does, with items that were fetched before; pure."""
    missing: dict[tuple[str, str], BomEntry] = {}
    done: dict[int, tuple[BomEntry, bool]] = {}

    def one(entry: BomEntry) -> tuple[BomEntry, bool]:
        # Nested assemblies share their values; each distinct value is resolved once.
        if (before := done.get(id(entry))) is not None:
            return before
        if entry.missing:
            return done.setdefault(id(entry), (entry, True))
        item = items.get(entry.silo_uuid) if entry.silo_uuid else None
        number = item.get("part_number") if item is not None else None
        name = (item.get("name") or item.get("description") or number) if item is not None else None
        if not number:
            missing.setdefault(entry.key, entry)
        bom_entry = replace(
            entry,
            part_number=number or None,
            name=name,
            children=tuple(merged(entry.children)),
            unregistered=tuple(
                child for child, children_resolved in map(one, entry.children) if not children_resolved
            ),
        )
        return done.setdefault(id(entry), (bom_entry, bool(number)))

    def merged(group: Iterable[BomEntry]) -> list[BomEntry]:
        return merge_lines(entry for entry, group_resolved in map(one, group) if group_resolved)

    resolved = merged(entries)
    unresolved = [one(entry)[0] for entry in missing.values()]
    return resolved, unresolved


def numbered_findings(findings: Iterable[Finding], items: Known) -> tuple[Finding, ...]:
    """Put part numbers into the findings about identities, since people know an item by its number."""
    numbers = {uuid.lower(): str(item.get("part_number") or uuid) for uuid, item in items.items() if item}
    codes = (FindingCode.COPIED_IDENTITY, FindingCode.SHARED_IDENTITY)

    def numbered(message: str) -> str:
        return re.sub(r"(?<=\()[^()]+(?=\): )", lambda uuid: numbers.get(uuid[0], uuid[0]), message)

    return tuple(
        replace(finding, message=numbered(finding.message)) if finding.code in codes else finding
        for finding in findings
    )


def merge_lines(entries: Iterable[BomEntry]) -> list[BomEntry]:
    """Merge the entries of one parent with the same part number into one line, and sum their quantities.

    Entries without a number stay apart.
    """
    lines: dict[str | tuple[str, str], BomEntry] = {}
    for entry in entries:
        name = entry.part_number or entry.key
        before = lines.get(name)
        if before is None:
            lines[name] = entry
            continue
        lines[name] = replace(
            before,
            also=(*before.also, entry.key, *entry.also),
            quantity=before.quantity + entry.quantity,
            is_assembly=before.is_assembly or entry.is_assembly,
            children=before.children or entry.children,
            consolidation_warning=before.consolidation_warning or entry.consolidation_warning,
            individual_links=before.individual_links + entry.individual_links,
            link_objects=before.link_objects + entry.link_objects,
            instances=before.instances + entry.instances,
        )
    return list(lines.values())


def consolidation_message(entry: BomEntry) -> str:
    """Write the spec's console warning (§6), with the count of individual links."""
    who = entry.part_number or display_name(entry) or entry.object_name or entry.doc_path
    count = entry.individual_links
    if count:
        what = counted(count, "individual link")
        what += " beside a link array" if count == 1 else ""
    else:
        what = f"{entry.link_objects} link arrays" if entry.link_objects > 1 else "several links"
    return f"{FindingCode.CONSOLIDATION.sentence.format(who=who, what=what)}{_ADVICE}"


_HINT = FindingCode.CONSOLIDATION.sentence.partition("{who}")[0]
_ADVICE = f". {FindingCode.CONSOLIDATION.tail}"


def one_hint_each(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Replace the consolidation warnings for the parts of a BOM by one warning for the BOM."""
    hints: dict[object, list[Finding]] = {}
    for finding in findings:
        hints.setdefault(
            finding.where[1:] if finding.code is FindingCode.CONSOLIDATION else id(finding), []
        ).append(finding)
    return tuple(of[0] if len(of) == 1 else _several_hints(of) for of in hints.values())


def _several_hints(hints: Sequence[Finding]) -> Finding:
    text = listed([hint.message.removeprefix(_HINT).removesuffix(_ADVICE) for hint in hints])
    return replace(hints[0], message=f"{_HINT}{text}{_ADVICE}")


def consolidation_findings(entries: Iterable[BomEntry]) -> tuple[Finding, ...]:
    """Make the consolidation warnings of a tree: once for each assembly, those of the top first.

    ``where`` names the component and, below the top, the assembly that links it several times.
    """
    direct = tuple(entries)
    levels = [((), direct), *(((assembly,), assembly.children) for assembly in walk_entries(direct))]
    return tuple(
        Finding(
            FindingCode.CONSOLIDATION,
            Severity.WARNING,
            consolidation_message(entry),
            tuple(Place(part.doc_path, part.object_name) for part in (entry, *above)),
        )
        for above, group in levels
        for entry in group
        if entry.consolidation_warning
    )


def unregistered_findings(unresolved: Iterable[BomEntry]) -> tuple[Finding, ...]:
    """Make a finding for each component without a Silo part number: the BOM leaves it out, but says so."""
    return tuple(
        Finding(
            FindingCode.UNREGISTERED,
            Severity.WARNING,
            f"{display_name(entry) or entry.object_name} has no Silo part number and is left out of the BOM "
            "until it is registered.",
            (Place(entry.doc_path, entry.object_name),),
        )
        for entry in unresolved
    )
