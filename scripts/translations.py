#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Collects the texts for translators: the add-on's in ``silo_<language>.ts``, others' in ``<domain>.po``.

    scripts/translations.py            bring the files up to date
    scripts/translations.py de         the same, and begin one for German
    scripts/translations.py --check    change nothing; exit code 1 where a file is out of date

A text is what stands in ``translate("Silo", "…")``, or in ``QT_TRANSLATE_NOOP("Name_OfCommand", "…")``, in
mods/silo/workbench or in another module of silo; both arguments must be literals. ``silo.ts`` is the
template, without translations.
What is translated already stays; a translation whose text is gone is marked as vanished, as Qt Linguist does.
FreeCAD loads compiled files, so each ``silo_de.ts`` has its ``silo_de.qm``, as ``lrelease`` would write it.

Each of ``DOMAINS`` has ``locale/<language>/LC_MESSAGES/<domain>.po`` in its package, for the standard
library's gettext, and the compiled ``.mo`` beside it. Their texts stand in ``_("…")``, in ``N_("…")``, which
is translated when it is shown, or in ``plural(n, "line", "lines")`` (without the last: with an s), in Python,
templates and scripts. The texts of templates are all that a person reads in them. Those of silo-mod are the
English sentences of silo and of the server with ``{name}`` for what is filled in (``silo.spoken``): each
literal of several words. Single words stand in ``_WORDS``.
"""

from __future__ import annotations

import argparse
import ast
import itertools
import os
import re
import struct
import sys
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from operator import itemgetter
from pathlib import Path

from silo_server.services.bom.line_edit import REL_TYPES

ROOT = Path(__file__).resolve().parents[1]
SOURCES = ROOT / "mods" / "silo" / "workbench"
# Words that the command line shows too.
SHARED = [
    path
    for path in sorted((ROOT / "mods" / "silo").rglob("*.py"))
    if SOURCES not in path.parents and 'translate("Silo"' in path.read_text("utf-8")
]
FOLDER = SOURCES / "resources" / "translations"
CONTEXT = "Silo"


class NotLiteral(Exception):
    """A text that Qt's tools, and this one, could not see."""


@dataclass(frozen=True)
class Translation:
    """What a translator wrote; ``state`` is "unfinished", "vanished" or "" (done)."""

    text: str = ""
    state: str = "unfinished"


Text = tuple[str, str]
"""Context and text."""


def texts_of(path: Path) -> list[Text]:
    """Return the texts of one Python file, in its order."""
    found = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"), str(path))):
        if isinstance(node, ast.Call):
            called = getattr(node.func, "attr", getattr(node.func, "id", ""))
            if called in ("translate", "QT_TRANSLATE_NOOP"):
                found.append((node.lineno, node.col_offset, _text(node, called, path)))
    return [text for _line, _column, text in sorted(found)]


def _text(call: ast.Call, called: str, path: Path) -> Text:
    values = [one.value if isinstance(one, ast.Constant) else None for one in call.args]
    match values:
        case [str(context), str(text)] if (context == CONTEXT) is (called == "translate"):
            return context, text
    context = CONTEXT if called == "translate" else "Name_OfCommand"
    raise NotLiteral(f'{path.name}:{call.lineno}: wanted {called}("{context}", "a text"), both as literals')


def collect(folder: Path = SOURCES, also: Iterable[Path] = ()) -> dict[Text, list[str]]:
    """Text → the files that use it, in the order of files and lines. All mistakes at once."""
    found: dict[Text, list[str]] = {}
    mistakes = []
    for path in (*sorted(folder.rglob("*.py")), *also):
        # It defines `translate`, and passes variables on.
        if path.name == "host.py":
            continue
        try:
            texts = texts_of(path)
        except NotLiteral as mistake:
            mistakes.append(str(mistake))
            continue
        for text in texts:
            files = found.setdefault(text, [])
            name = Path(os.path.relpath(path, folder)).as_posix()
            if name not in files:
                files.append(name)
    if mistakes:
        raise NotLiteral("\n".join(mistakes))
    return found


def read(path: Path) -> tuple[str, dict[Text, Translation]]:
    """Language and translations of a .ts file; ("", {}) where there is none."""
    if not path.exists():
        return "", {}
    root = ET.parse(path).getroot()  # noqa: S314  # our own files
    known = {}
    for context in root.iter("context"):
        for message in context.iter("message"):
            element = message.find("translation")
            if element is not None:
                text = context.findtext("name", ""), message.findtext("source", "")
                known[text] = Translation(element.text or "", element.get("type", ""))
    return root.get("language", ""), known


def ts(texts: Mapping[Text, Iterable[str]], language: str, known: Mapping[Text, Translation]) -> str:
    """A .ts file: all texts, with what is known of their translations."""
    attributes = {"version": "2.1", "sourcelanguage": "en"} | ({"language": language} if language else {})
    root = ET.Element("TS", attributes)
    contexts: dict[str, ET.Element] = {}
    gone = {text: () for text, old in known.items() if text not in texts and old.text}
    for text, files in {**texts, **gone}.items():
        if text[0] not in contexts:
            contexts[text[0]] = ET.SubElement(root, "context")
            ET.SubElement(contexts[text[0]], "name").text = text[0]
        old = known.get(text, Translation())
        state = "vanished" if text in gone else "unfinished" if old.state == "vanished" else old.state
        _add(contexts[text[0]], text[1], files, Translation(old.text, state))
    ET.indent(root, "    ")
    return f'<?xml version="1.0" encoding="utf-8"?>\n<!DOCTYPE TS>\n{ET.tostring(root, "unicode")}\n'


def _add(context: ET.Element, text: str, files: Iterable[str], known: Translation) -> None:
    message = ET.SubElement(context, "message")
    for file in files:
        # No line numbers: they would change with every edit.
        ET.SubElement(message, "location", filename=f"../../{file}")
    ET.SubElement(message, "source").text = text
    made = ET.SubElement(message, "translation", {"type": known.state} if known.state else {})
    made.text = known.text


def qm(known: Mapping[Text, Translation]) -> bytes:
    """Write the finished translations for QTranslator: offsets by the hash of the text, then the messages."""
    messages, offsets = b"", []
    for (context, text), translation in known.items():
        if translation.state:
            continue
        source = text.encode()
        offsets.append(_hash(source).to_bytes(4, "big") + len(messages).to_bytes(4, "big"))
        for tag, value in ((3, translation.text.encode("utf-16-be")), (6, source), (7, context.encode())):
            messages += bytes([tag]) + len(value).to_bytes(4, "big") + value
        messages += b"\x01"
    made = bytes.fromhex("3cb86418caef9c95cd211cbf60a1bddd")
    for section, content in ((0x42, b"".join(sorted(offsets))), (0x69, messages)):
        made += bytes([section]) + len(content).to_bytes(4, "big") + content
    return made


def _hash(text: bytes) -> int:
    """The hash of ELF files."""
    found = 0
    for byte in text:
        found = ((found << 4) + byte) & 0xFFFFFFFF
        high = found & 0xF0000000
        found = (found ^ high >> 24) & ~high
    return found or 1


def wanted(
    languages: Iterable[str] = (),
    folder: Path = FOLDER,
    sources: Path = SOURCES,
    also: Iterable[Path] = SHARED,
) -> dict[Path, bytes]:
    """What each file should hold: those that exist, and one for each of ``languages``."""
    texts = collect(sources, also)
    found = dict.fromkeys(sorted(folder.glob("silo*.ts")), "")
    found |= {folder / (f"silo_{language}.ts" if language else "silo.ts"): language for language in languages}
    files = {}
    for path, new in found.items():
        language, known = read(path)
        files[path] = ts(texts, language or new, known).encode()
        if language or new:
            files[path.with_suffix(".qm")] = qm({text: known.get(text, Translation()) for text in texts})
    return files


@dataclass(frozen=True)
class Message:
    """A text of a .po file; ``many`` is its plural, "" without. ``files`` use it, relative to mods."""

    text: str
    many: str = ""
    files: tuple[str, ...] = ()
    translations: tuple[str, ...] = ()


@dataclass(frozen=True)
class Domain:
    """A gettext domain: the texts that ``texts`` yields of a package, as (text, plural or "", file)."""

    name: str
    package: Path
    texts: Callable[[Path], Iterator[tuple[str, str, Path]]]

    def file(self, language: str) -> Path:
        """Return the path of a language's .po file."""
        return self.package / "locale" / language / "LC_MESSAGES" / f"{self.name}.po"


@cache
def messages_of(domain: Domain) -> dict[str, Message]:
    """Text → message, in the order of the files."""
    made: dict[str, Message] = {}
    for text, many, path in domain.texts(domain.package):
        before = made.get(text, Message(text))
        if before.many and many and before.many != many:
            raise NotLiteral(f"{path}: {text!r} has the plurals {before.many!r} and {many!r}")
        name = path.relative_to(ROOT / "mods").as_posix()
        files = before.files if name in before.files else (*before.files, name)
        made[text] = Message(text, before.many or many, files)
    return made


def texts_of_python(path: Path) -> Iterator[tuple[str, str, Path]]:
    """Yield the texts of a Python file that are translated with gettext."""
    calls = [
        node for node in ast.walk(ast.parse(path.read_text("utf-8"), str(path))) if isinstance(node, ast.Call)
    ]
    for call in sorted(calls, key=lambda call: (call.lineno, call.col_offset)):
        name = getattr(call.func, "attr", getattr(call.func, "id", ""))
        values = [one.value if isinstance(one, ast.Constant) else None for one in call.args]
        match name, values:
            case (("_" | "N_"), [str(text), *_]):
                yield text, "", path
            case (("_" | "N_"), [None, *_]):
                # One of two texts: _("…" if … else "…").
                pair = [getattr(call.args[0], side, None) for side in ("body", "orelse")]
                yield from ((one.value, "", path) for one in pair if isinstance(one, ast.Constant))
            case "plural", [_, str(one), *many]:
                yield one, many[0] if many and isinstance(many[0], str) else f"{one}s", path


def _texts_of_server(package: Path) -> Iterator[tuple[str, str, Path]]:
    # The server's own reading of a template, so that both agree.
    sys.path.insert(0, str(package.parent))
    from jinja2 import nodes

    from silo.api.wire import ItemTexts, LineTexts
    from silo.tables.bom_rows import BOM
    from silo.tables.price_rows import PRICES
    from silo_server import actors, schema
    from silo_server.services import releases, suppliers
    from silo_server.web import render
    from silo_server.web.import_page import DELIMITERS

    # Words that are stored, of columns and of the built-in schema; a site's own stay as they are.
    stored = [*actors.Role, *actors.Scope, *schema.ITEM_TYPES, *REL_TYPES, *releases.NUMBERED, "draft"]
    stored += [*suppliers.COLUMNS.values(), *DELIMITERS.values()]
    for field in (*ItemTexts.model_fields.values(), *LineTexts.model_fields.values()):
        stored += [field.title or "", *schema.text_hints(field).get("options", ())]
    built_in = schema.find_schema(None)
    for one in built_in.fields:
        stored += [one.label, one.title, one.description, *one.options]
    stored += [*built_in.domains.values(), *(category.name for category in built_in.categories.values())]
    stored += [role.replace("_", " ").capitalize() for table in (BOM, PRICES) for role in table.roles]
    yield from ((str(word), "", package / "schema" / "__init__.py") for word in stored if word)
    for path in sorted(package.rglob("*.py")):
        yield from texts_of_python(path)
    environment = render.environment("en")
    for path in sorted((package / "web" / "templates").glob("*.html")):
        source, texts = path.read_text("utf-8"), []

        def note(text: str, texts: list[str] = texts) -> str:
            texts.append(text)
            return text

        render.translated(source, note)
        yield from ((text, "", path) for text in texts)
        for call in environment.parse(source).find_all(nodes.Call):
            name = getattr(call.node, "name", "")
            values = [one.value if isinstance(one, nodes.Const) else None for one in call.args]
            match name, values:
                case (("_" | "N_"), [str(text), *_]):
                    yield text, "", path
                case "plural", [_, str(one), *many]:
                    yield one, many[0] if many and many[0] else f"{one}s", path
    for path in render.SCRIPTS:
        yield from ((text, "", path) for text in render.texts_of_script(path))


# Single words that are shown, what argparse says, and what several words are made of.
_WORDS = """
usage: |options|positional arguments|show this help message and exit|example:
the following arguments are required: {arguments}|unrecognized arguments: {arguments}
argument {argument}: invalid choice: {choice} (choose from {choices})
argument {argument}: invalid {type} value: {value}|argument {argument}: expected one argument
argument {argument}: expected at least one argument
argument {argument}: not allowed with argument {other}|one of the arguments {arguments} is required
reading|server|geometry|materials|BOM|results|links|working|calculating|reading {n} files
Part number|Name|Quantity|Unit|Commit|What|Since|State|Why|In|Before|After|By|missing|added|removed
quantity|line|data|file|updated|Errors|Warnings|Moved|Notes|Cancelled.|Stopped.|same|edited|waiting
add-on|network|old|new|nothing|paused|moved|configuration|cache|identities|address|token|mode|who|items|schema|modules|events
inertia|live|none|{n} merged|{n} unchanged|{n} dry run|{n} blocked|{n} unregistered|{n} failed
{n} missing|{n} min|{n} hours|{n} days|in {n} s|in {n} min|in {n} hours|in {n} days|BOM merged
BOM unchanged|BOM blocked|BOM unregistered|BOM failed|reading {n} s|server {n} s
it is missing|{n} removed|{n} added|{n} quantity changed|{n} unreferenced|{n} in conflict|{n} broken
{n} kept as intentional|{n} set to the assembly's quantity|{n} kept at Silo's quantity|{n} refused
{n} question open|{n} questions open|{n} unreferenced line|{n} unreferenced lines|{n} unregistered
changes|event streams|Link|Part|Qty|Matched|Material|Parts|Source|exact|normalised|wildcard|sub assembly
zero|parent|remaining|order|{n} warning|{n} warnings|summaries to be kept|Supplier|Needed|Ordered|Cost|bought
made|unsaid
{n} conflict|{n} conflicts|at least {low} and at most {high}|viewer|editor|admin|review|released|obsolete
draft|Draft|drawing|data sheet|picture|certificate
archived|changed|mass|size|volume|material|description|quantity {before} → {after}|notes|unit
source|reason|revision|hidden|unreferenced|metadata|rel type
reference designators|find number|child revision|override|cad quantity|unreferenced since
Field required|Input should be a valid integer, unable to parse string as an integer
Input should be greater than or equal to {n}|Input should be less than or equal to {n}
String should have at most {n} characters|String should have at least {n} characters
"""
# What no person reads as it stands, and what has a catalogue of its own.
_WITHOUT = re.compile(
    r"silo/(workbench/(activity|gui|pane|preview|register|revisions/dock|smoke|headless|settings/preferences)|"
    r"drawing/page|bom/units\.py|tables/heading_detail\.py|fcstd/values\.py|"
    r"testing\.py|cli/json_schemas\.py|bom/headers\.py|bom/walk/standard\.py|api/wire\.py|"
    r"fcstd/properties\.py)|silo_server/services/product/(frozen|export|export_files)\.py"
)
# No text for people.
_NO_TEXT = re.compile(
    "|".join(
        (
            # SQL
            r"\b(SELECT|INSERT|DELETE FROM|UPDATE|PRAGMA|CREATE|ALTER TABLE|REPLACE INTO|VALUES|PRIMARY)\b",
            r"\b(NOT NULL|NULL)\b",
            r"\b(INTEGER|REAL|ORDER BY|LISTEN|LOCK TABLE|SET LOCAL)\b|\{select\}|= \?|^[a-z_]+(, [a-z_]+)+$",
            r"^status (=|IN) |jit=|^number name$|^(merge|import) \{|^upload document$|^send \{force",
            r"sys\.path|^Server\(|^Silo: relink|^True: no part|^Identity of the item",
            # markup, JSON, style
            r"^</?\w+|</\w+>|=\"|\": |doctype|^:?\w+\{|:[\w-]+\(|[\w-]+:[\w#./-]+;|^(bold|dim) |\{task\.",
            # HTTP, logs
            r"Content-|^\w+/[\w+-]+;|Bearer|gzip|boundary|%s|-src '|=\(\)|^private, |max-age",
            r"Also if the form|^The file$|^Still what If|^a GLB of more|disk is full\|",
            r"^Method Not Allowed:|^Accept-|^GET, |^Value error",
            # patterns, names of classes, programs, types
            r"\(\?|\\(?! )|signal \(SIG|^(?=\w+[A-Z])[A-Z]\w+( [A-Z]\w+)*$|\w::\w|sys; print|\w \| \w",
            r"Mapping\[|UUIDs|^1 to 64 char|Client\(|module \{|^\{typeid\} \{name\} of|^\{meta_key\}",
            # tables of words in files, link maps, fields, values for programmers
            r"^(lfd nr|item no)|Link,Part,Part",
            r"(^|; )\w+; \w+;|^grs; |netto|pièce|einzeln|^(no value|not (set|specified)|nicht |kein )",
            r"^(aucune|sans|sin|nessun) |^name part_number|^(BomTable|MassProps|InertiaReport)\(|import main",
            r"Link map for|Each line is a part|^as your robot|anything within|silo-mod (links|inertia) FILE",
            r"Links of the URDF that|parts: \[\]|^STEP, FCStd|\}  #|^rule decided|material <|grs; ",
            # commands, and what only repeats a sentence
            r"^\s*silo-mod ([a-z-]+ |\[)|^silo-mod \w+$|^silo-mod \{version\}|^silo-mod: \{(?!text)\w+\}$",
            r"^silo-mod: \{(error\}\. |why\}: )",
            # standards, folders
            r"(\d+ ){2}|\b(ISO|DIN) \d|Application Support",
        )
    )
)


def texts_of_sentences(path: Path) -> Iterator[tuple[str, str, Path]]:
    """Yield the sentences of a Python file that are said in another language when they are shown.

    That is each literal of at least two words, and each with words and placeholders; lines are texts of their
    own. A placeholder is called as the last name of its expression. Keys of dictionaries are no texts.
    """
    found: list[tuple[int, int, str]] = []
    tree = ast.parse(path.read_text("utf-8"), str(path))
    without = {id(inner) for part in _other_texts(tree, path) for inner in ast.walk(part)}
    templates: list[tuple[int, int, str, str]] = []
    for text, many, literals in _templates(tree, path):
        templates.append((literals[0].lineno, literals[0].col_offset, text, many))
        without.update(map(id, literals))
    for node in ast.walk(tree):
        # Docstrings; what is compared; the parts of a literal, and its formats.
        if isinstance(node, ast.Expr | ast.Compare | ast.JoinedStr | ast.Subscript | ast.MatchValue):
            continue
        if id(node) in without:
            continue
        match node:
            case ast.Call(func=ast.Name("counted"), args=[_, ast.Constant(str(one)), *many]):
                plurals = [word.value for word in many if isinstance(word, ast.Constant)] or [f"{one}s"]
                found += [(node.lineno, 0, f"{{n}} {word}") for word in plurals]
        for child in ast.iter_child_nodes(node):
            if not isinstance(child, ast.Constant | ast.JoinedStr) or id(child) in without:
                continue
            lines = _pattern_of(child).split("\n")
            # Many lines are a program, a style or a schema; those of the command line are a help.
            is_text = len(lines) < 4 or "cli" in path.parts
            if is_text and not (isinstance(node, ast.Dict) and child in node.keys):
                found += [(child.lineno, child.col_offset, line) for line in lines]
    all_found: list[tuple[int, int, str, str | None]] = [*((*one, None) for one in found), *templates]
    for _line, _column, text, many in sorted(all_found, key=itemgetter(0, 1)):
        if many is not None:
            if re.search("[A-Za-z]", re.sub(r"\{\w+\}", "", text)):
                yield text, many, path
        elif not _NO_TEXT.search(text):
            core = _core(text)
            if re.search("[A-Za-z]{2}", re.sub(r"\{\w+\}", "", core)) and " " in core:
                yield core, "", path


def _templates(tree: ast.Module, path: Path) -> Iterator[tuple[str, str, list[ast.expr]]]:
    """Yield the templates of messages, and captions: text, plural or "", and the literals."""
    calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call)]
    for call in sorted(calls, key=lambda call: (call.lineno, call.col_offset)):
        match getattr(call.func, "attr", getattr(call.func, "id", "")), call.args:
            case (("message" | "template" | "caption"), [ast.Constant(str(text)) as literal, *_]):
                yield text, "", [literal]
            case (("message" | "caption"), [ast.IfExp(body=body, orelse=other), *_]):
                for literal in (body, other):
                    if isinstance(literal, ast.Constant) and isinstance(literal.value, str):
                        yield literal.value, "", [literal]
            case "counted", [_, ast.Constant(str(one)) as literal, *more] if "workbench" not in path.parts:
                many = next((word.value for word in more if isinstance(word, ast.Constant)), f"{one}s")
                yield f"{{n}} {one}", f"{{n}} {many}", [literal, *more]
            case "counted_message", [
                _,
                ast.Constant(str(one)) as literal,
                ast.Constant(str(many)) as other,
                *_,
            ]:
                yield one, many, [literal, other]


def _other_texts(tree: ast.Module, path: Path) -> Iterator[ast.AST]:
    """Yield what holds other texts: those of Qt, of gettext, of logs, of numbers for Prometheus, of the API's
    description; and the lines of a shell's script.
    """
    for node in ast.walk(tree):
        match node:
            case ast.FunctionDef("_bash" | "_zsh" | "_fish") if path.name == "completion.py":
                yield node
            case ast.FunctionDef() | ast.AsyncFunctionDef():
                yield from node.decorator_list
            case ast.Call(
                func=ast.Name("translate" | "QT_TRANSLATE_NOOP") | ast.Attribute(attr="translate")
            ) if "workbench" in path.parts:
                yield node
            case ast.Call(
                func=ast.Name("_" | "N_" | "plural" | "GaugeMetricFamily" | "Counter" | "Histogram")
            ):
                yield node
            case ast.Call(func=ast.Attribute(value=ast.Name("logger")) | ast.Attribute(attr="_gauge")):
                yield node
    if "routes" in path.parts:
        inside = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef
        yield from (node for node in tree.body if not isinstance(node, inside))
        yield from (node.args for node in ast.walk(tree) if isinstance(node, ast.FunctionDef))


def _core(text: str) -> str:
    """Return a text without the signs and spaces around it."""
    numbers = itertools.count()
    named = re.sub(r"\{(\w*)(?::\w+|!r)?\}", lambda place: f"{{{place[1] or next(numbers)}}}", text)
    core = re.sub(r"^[^\w{\[-]+|\s+$", "", named)
    return core.removesuffix(")") if core.count(")") > core.count("(") else core


def _pattern_of(literal: ast.Constant | ast.JoinedStr) -> str:
    if isinstance(literal, ast.Constant):
        return literal.value if isinstance(literal.value, str) else ""
    known: dict[str, str] = {}
    made = ""
    for part in literal.values:
        if isinstance(part, ast.Constant):
            made += part.value
            continue
        source = ast.unparse(part.value)
        names = re.findall(r"[A-Za-z]\w*", re.sub(r"'[^']*'", "", source.partition(" if ")[0]))
        name = wanted = names[-1].lower() if names else "value"
        while known.setdefault(name, source) != source:
            name = f"{wanted}{len(known)}"
        made += f"{{{name}}}"
    return made


def _texts_of_silo(package: Path) -> Iterator[tuple[str, str, Path]]:
    sys.path.insert(0, str(package.parent))
    from silo.bom.findings import FindingCode
    from silo.cli.command_table import THEMES

    # Lists of commands and of endings, in tables of options.
    lists = {command for commands in THEMES.values() for command in commands}
    lists |= {"{ask}", "{read}", "{servers}", "html", ".html", ".md", "md", ".json", ".xml", ".csv"}
    for word in (*THEMES, *re.split(r"[|\n]", _WORDS.strip())):
        yield word, "", package / "cli" / "command_table.py"
    yield from _labels_of_server()
    for path in sorted((*package.rglob("*.py"), *(package.parent / "silo_server").rglob("*.py"))):
        name = path.relative_to(package.parent).as_posix()
        if name == "silo/bom/findings.py":
            for code in FindingCode:
                yield from ((text, "", path) for text in (code.meaning, code.sentence, code.tail) if text)
        elif not _WITHOUT.match(name):
            for text, many, where in texts_of_sentences(path):
                if not lists.issuperset(text.split()):
                    yield text, many, where
        elif name.startswith("silo_server/"):
            tree = ast.parse(path.read_text("utf-8"), str(path))
            yield from ((text, many, path) for text, many, _literals in _templates(tree, path))


def _labels_of_server() -> Iterator[tuple[str, str, Path]]:
    """Yield the names of fields as its sentences have them."""
    from silo_server import schema
    from silo_server.services import suppliers

    path = Path(schema.__file__)
    labels = [text for field in schema.find_schema(None).fields for text in (field.label, field.title)]
    for label in dict.fromkeys(filter(None, (*suppliers.COLUMNS.values(), *labels))):
        yield f"{label}: {{problem}}", "", path
        yield label, "", path
    for column in suppliers.COLUMNS.values():
        yield f"{column.lower().replace(',', '')} {{before}} → {{after}}", "", Path(suppliers.__file__)


DOMAINS = [
    Domain("silo_server", ROOT / "mods" / "silo_server", _texts_of_server),
    Domain("silo-mod", ROOT / "mods" / "silo", _texts_of_silo),
]


def po(language: str, messages: Iterable[Message], plurals: str) -> str:
    """Write a .po file; what has no translation yet is "". A text that is gone goes with its translation."""
    head = {"Content-Type": "text/plain; charset=UTF-8", "Language": language, "Plural-Forms": plurals}
    written = 'msgid ""\nmsgstr ""\n' + "".join(
        f"{_quoted(f'{key}: {value}{chr(10)}')}\n" for key, value in head.items()
    )
    for one in messages:
        # No line numbers: they would change with every edit.
        written += f"\n#: {' '.join(one.files)}\nmsgid {_quoted(one.text)}\n"
        if one.many:
            written += f"msgid_plural {_quoted(one.many)}\n"
            forms = one.translations or ("", "")
            written += "".join(f"msgstr[{n}] {_quoted(form)}\n" for n, form in enumerate(forms))
        else:
            written += f"msgstr {_quoted(*one.translations[:1] or ('',))}\n"
    return written


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n").replace("\t", "\\t")
    return f'"{escaped}"'


def read_po(path: Path) -> tuple[str, dict[str, Message]]:
    """Plural-Forms and messages of a .po file; those of German, English and most others if there is none."""
    plurals, found = "nplurals=2; plural=(n != 1);", {}
    blocks = path.read_text("utf-8").split("\n\n") if path.exists() else []
    for block in blocks:
        fields: dict[str, str] = {}
        name = ""
        for line in block.splitlines():
            match = re.fullmatch(r'(?:(msgid|msgid_plural|msgstr(?:\[\d\])?) )?(".*")', line)
            if match:
                name = match[1] or name
                fields[name] = fields.get(name, "") + ast.literal_eval(match[2])
            elif not line.startswith("#"):
                raise ValueError(f"{path}: wanted msgid, msgstr or a text in quotes, got {line!r}")
        text = fields.pop("msgid", "")
        if text:
            forms = tuple(fields[name] for name in sorted(fields) if name.startswith("msgstr"))
            found[text] = Message(text, fields.get("msgid_plural", ""), (), forms)
        elif head := re.search(r"Plural-Forms: (.*)\n", fields.get("msgstr", "")):
            plurals = head[1]
    return plurals, found


def mo(language: str, messages: Iterable[Message], plurals: str) -> bytes:
    """Compile what is translated: a table of lengths and offsets each for texts and translations."""
    head = f"Content-Type: text/plain; charset=UTF-8\nLanguage: {language}\nPlural-Forms: {plurals}\n"
    pairs = {"": head}
    for one in messages:
        if one.translations and all(one.translations):
            # Old gettext (Python 3.11.2) finds a text that has a plural by its number only: it stands twice.
            pairs[one.text] = one.translations[0]
            if one.many:
                pairs[f"{one.text}\0{one.many}"] = "\0".join(one.translations)
    texts = sorted((text.encode(), translation.encode()) for text, translation in pairs.items())
    at = 28 + 16 * len(texts)
    tables, content = b"", b""
    for column in zip(*texts, strict=True):
        for value in column:
            tables += struct.pack("<II", len(value), at + len(content))
            content += value + b"\0"
    header = struct.pack("<7I", 0x950412DE, 0, len(texts), 28, 28 + 8 * len(texts), 0, 0)
    return header + tables + content


def wanted_po(domain: Domain, languages: Iterable[str] = ()) -> dict[Path, bytes]:
    """What each file of a domain should hold: those that exist, and one for each of ``languages``."""
    texts = messages_of(domain)
    there = [path.parents[1].name for path in domain.package.glob(f"locale/*/LC_MESSAGES/{domain.name}.po")]
    files = {}
    for language in sorted({*there, *languages}):
        path = domain.file(language)
        plurals, done = read_po(path)
        empty = Message("")
        messages = [
            Message(
                one.text, one.many, one.files, old.translations if bool(old.many) == bool(one.many) else ()
            )
            for one in texts.values()
            for old in [done.get(one.text, empty)]
        ]
        files[path] = po(language, messages, plurals).encode()
        files[path.with_suffix(".mo")] = mo(language, messages, plurals)
    return files


def main(arguments: list[str] | None = None) -> int:
    """Write, or check."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("languages", nargs="*", help="begin a file for this language: de, pt-BR")
    parser.add_argument("--check", action="store_true", help="change nothing, say what is out of date")
    args = parser.parse_args(arguments)
    try:
        files = wanted(["", *args.languages])
        for domain in DOMAINS:
            files |= wanted_po(domain, args.languages)
    except NotLiteral as mistakes:
        print(mistakes, file=sys.stderr)
        return 1
    old = [path for path, content in files.items() if not path.exists() or path.read_bytes() != content]
    for path in old:
        print(f"{path.relative_to(ROOT)} {'is out of date: make translations' if args.check else 'written'}")
        if not args.check:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(files[path])
    return 1 if old and args.check else 0


if __name__ == "__main__":
    sys.exit(main())
