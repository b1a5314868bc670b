#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Collects the add-on's texts for translators, in one ``silo_<language>.ts`` for each language.

    scripts/translations.py            bring the files up to date
    scripts/translations.py de         the same, and begin one for German
    scripts/translations.py --check    change nothing; exit code 1 where a file is out of date

A text is what stands in ``translate("Silo", "…")``, or in ``QT_TRANSLATE_NOOP("Name_OfCommand", "…")``, in
mods/silo/workbench or in a module of SHARED; both arguments must be literals. ``silo.ts`` is the template,
without translations.
What is translated already stays; a translation whose text is gone is marked as vanished, as Qt Linguist does.
FreeCAD loads compiled files: ``lrelease silo_de.ts`` makes ``silo_de.qm``.
"""

from __future__ import annotations

import argparse
import ast
import os
import sys
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SOURCES = ROOT / "mods" / "silo" / "workbench"
# Words that the command line shows too.
SHARED = (ROOT / "mods" / "silo" / "activity.py",)
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
        # They define `translate`; their own calls pass variables on.
        if path.name in ("words.py", "host.py"):
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


def wanted(
    languages: Iterable[str] = (),
    folder: Path = FOLDER,
    sources: Path = SOURCES,
    also: Iterable[Path] = SHARED,
) -> dict[Path, str]:
    """What each .ts file should hold: those that exist, and one for each of ``languages``."""
    texts = collect(sources, also)
    found = dict.fromkeys(sorted(folder.glob("silo*.ts")), "")
    found |= {folder / (f"silo_{language}.ts" if language else "silo.ts"): language for language in languages}
    return {path: ts(texts, read(path)[0] or new, read(path)[1]) for path, new in found.items()}


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
    except NotLiteral as mistakes:
        print(mistakes, file=sys.stderr)
        return 1
    old = [p for p, text in files.items() if not p.exists() or p.read_text(encoding="utf-8") != text]
    for path in old:
        print(f"{path.relative_to(ROOT)} {'is out of date: make translations' if args.check else 'written'}")
        if not args.check:
            path.write_text(files[path], encoding="utf-8")
    return 1 if old and args.check else 0


if __name__ == "__main__":
    sys.exit(main())
