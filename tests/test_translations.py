# SPDX-License-Identifier: LGPL-2.1-or-later
"""The texts for translators (``scripts/translations.py``)."""

from __future__ import annotations

import ast
import gettext
import importlib.util
import re
import sys
from pathlib import Path
from types import ModuleType

import pytest
from jinja2 import nodes

from silo_server.web import render
from silo_server.web.render import environment

SYNC, HIDE = ("Silo", "Sync"), ("Silo", "Show & <hide>")
SCRIPT = Path(__file__).resolve().parents[1] / "scripts" / "translations.py"


@pytest.fixture(name="script", scope="module")
def _script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("silo_translations", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    # Data classes look their module up by its name.
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(name="sources")
def _sources(tmp_path: Path) -> Path:
    (tmp_path / "one.py").write_text('translate("Silo", "Sync")\ntranslate("Silo", "Show & <hide>")\n')
    (tmp_path / "two.py").write_text('f(translate("Silo", "Sync"), other("Silo", "not this"))\n')
    (tmp_path / "three.py").write_text('words.QT_TRANSLATE_NOOP("Silo_BOM", "Sync")\n')
    return tmp_path


def test_the_committed_files_are_up_to_date(script: ModuleType) -> None:
    """After a text has changed: make translations. Every text can be collected."""
    assert len(script.collect(also=script.SHARED)) > 100
    files = script.wanted()
    for domain in script.DOMAINS:
        assert len(script.messages_of(domain)) > 100
        files |= script.wanted_po(domain)
    for path, content in files.items():
        assert path.read_bytes() == content, f"{path.name}: run make translations"


def test_german_is_complete(script: ModuleType) -> None:
    """Each text is done, with its placeholders, and ends as the original does: the layout counts on both."""
    language, known = script.read(script.FOLDER / "silo_de.ts")
    assert (language, set(known)) == ("de", set(script.collect(also=script.SHARED)))

    def shape(text: str) -> tuple[list[str], str, str]:
        words = text.strip(" ")
        return (
            sorted(re.findall(r"{\w+}", text)),
            re.sub(r"\S.*\S", "", text),
            words[-1:] * (words[-1:] in ".…:?"),
        )

    wrong = {text for text, done in known.items() if done.state or shape(text[1]) != shape(done.text)}
    assert not wrong
    glossary = {"BOM": "Stückliste", "part number": "Teilenummer", "Commit ": "eincheck"}
    for (_, text), done in known.items():
        for word, german in glossary.items():
            assert word not in text or german.lower() in done.text.lower(), (text, done.text)


def test_german_pages_are_complete(script: ModuleType) -> None:
    """Each text of a gettext domain is done, with its placeholders and elements, and nothing is fuzzy."""

    def shape(text: str) -> tuple[list[str], list[str], str, set[str]]:
        places = re.findall(r"%\(\w+\)[a-z]|{\w+}", text)
        ends = re.sub(r"\S.*\S|\S", "", text)
        return sorted(places), sorted(re.findall(r"</?[a-z]+>", text)), ends, set(text) & set('"<>&')

    glossary = {"BOM": "Stückliste", "part number": "Teilenummer", "sub-assembl": "Unterbaugruppe"}
    for domain in script.DOMAINS:
        path = domain.file("de")
        assert "fuzzy" not in path.read_text("utf-8")
        _plurals, messages = script.read_po(path)
        assert set(messages) == set(script.messages_of(domain))
        for one in messages.values():
            forms = (one.text, one.many) if one.many else (one.text,)
            assert len(one.translations) == len(forms)
            for text, translation in zip(forms, one.translations, strict=True):
                assert translation
                assert shape(text) == shape(translation), (text, translation)
                for word, german in glossary.items():
                    assert word not in text or german.lower() in translation.lower(), (text, translation)


def test_gettext_reads_what_was_compiled(script: ModuleType) -> None:
    """The standard library's reader finds each text, and the plural by its number."""
    for domain in script.DOMAINS:
        path = domain.file("de")
        german = gettext.translation(domain.name, domain.package / "locale", ["de"])
        for one in script.read_po(path)[1].values():
            assert german.gettext(one.text) == one.translations[0]
            if one.many:
                assert [german.ngettext(one.text, one.many, n) for n in (1, 0, 2)] == [
                    one.translations[number != 1] for number in (1, 0, 2)
                ]


# Words of HTML and of addresses, and names of programs, that stand in the expressions of templates.
_NO_TEXT = {
    *("ascending", "descending", "true", "false", "yes", "no", "open", "incomplete", "changed", "required"),
    *("maxLength", "/items", "?since=look", "CSV 1,5", "Odoo", "InvenTree"),
}


def test_no_text_of_a_template_hides_in_an_expression() -> None:
    """The text around expressions is translated anyway; a literal that a person reads stands in a call."""
    found: list[str] = []

    def look(node: nodes.Node, path: Path, shown: bool) -> None:
        if isinstance(node, nodes.Call) and getattr(node.node, "name", "") in ("_", "N_", "plural"):
            return
        if isinstance(node, nodes.Compare | nodes.Getitem | nodes.Getattr | nodes.Extends | nodes.FromImport):
            return
        if isinstance(node, nodes.Const) and isinstance(node.value, str) and node.value not in _NO_TEXT:
            wanted = r"[A-Za-z]{2}" if shown else r"[A-Z][a-z]|\w \w"
            if re.search(wanted, node.value):
                found.append(f"{path.name}:{node.lineno}: {node.value!r}")
        for name, value in node.iter_fields():
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, nodes.Node):
                    chosen = isinstance(node, nodes.CondExpr | nodes.Or) and name != "test"
                    look(child, path, chosen or (isinstance(node, nodes.Pair) and name == "value"))

    made = environment("en")
    for path in sorted((Path(render.__file__).parent / "templates").glob("*.html")):
        look(made.parse(path.read_text("utf-8")), path, False)
    assert not found


def test_templates_say_sentences_of_the_server() -> None:
    """Errors, and what is open, are English until a filter says them."""
    shown = re.compile(
        r"\{\{ (?:\w+[.\[])*\"?(problem|message|gap|warning|summary)\b(?!.*(spoken|sentence|_\()).*?\}\}"
    )
    for path in sorted((Path(render.__file__).parent / "templates").glob("*.html")):
        found = re.findall(r"\{\{.*?\}\}", path.read_text("utf-8"))
        assert [text for text in found if shown.match(text) and "plural(" not in text] == [], path.name


SHOWN = re.compile(
    r"set(Text|WindowTitle|ToolTip|PlaceholderText|Title|StatusTip|HeaderLabels|HorizontalHeaderLabels|"
    r"SpecialValueText|Suffix|InformativeText|DetailedText)|add(Action|Button|Item|Items|Menu|Row|Tab)|"
    r"Q(Label|PushButton|CheckBox|RadioButton|GroupBox|Action|DockWidget|ToolButton)|information|warning|critical|question"
)


def test_no_text_is_shown_untranslated(script: ModuleType) -> None:
    """What the add-on hands to a widget went through a translation call."""
    found = []
    for path in sorted(script.SOURCES.rglob("*.py")):
        for call in ast.walk(ast.parse(path.read_text("utf-8"))):
            if not isinstance(call, ast.Call):
                continue
            called = getattr(call.func, "attr", getattr(call.func, "id", ""))
            if SHOWN.fullmatch(called):
                texts = [one for given in call.args for one in ast.walk(given) if not_translated(one, given)]
                found += [f"{path.name}:{one.lineno}: {one.value}" for one in texts]
    assert not found


def not_translated(one: ast.AST, given: ast.expr) -> bool:
    """Return whether it is a literal with two letters, and no part of a call in what is given."""
    inside = {id(part) for call in ast.walk(given) if isinstance(call, ast.Call) for part in ast.walk(call)}
    if not isinstance(one, ast.Constant) or not isinstance(one.value, str) or id(one) in inside:
        return False
    return bool(re.search("[A-Za-z]{2}", one.value)) and "://" not in one.value


def test_a_file_for_a_new_language_has_every_text(script: ModuleType, sources: Path) -> None:
    """Ready for Qt Linguist; the next run keeps what was translated in it."""
    template, path, compiled = made = script.wanted(["", "de"], sources, sources, ())
    assert (template, path, compiled) == tuple(sources / f"silo{end}" for end in (".ts", "_de.ts", "_de.qm"))
    text = made[path].decode()
    path.write_text(
        text.replace('<translation type="unfinished" />', "<translation>Abgleichen</translation>", 1)
    )
    template.write_bytes(made[template])
    again = script.wanted((), sources, sources, ())
    assert {path: path.read_bytes(), template: made[template]}.items() <= again.items()
    assert "Abgleichen".encode("utf-16-be") in again[compiled]
    language, known = script.read(path)
    assert (language, list(known)) == ("de", [SYNC, HIDE, ("Silo_BOM", "Sync")])
    assert known[SYNC] == script.Translation("Abgleichen", "")


def test_each_text_once_with_the_files_that_use_it(script: ModuleType, sources: Path) -> None:
    """In the order of the files."""
    assert script.collect(sources) == {
        SYNC: ["one.py", "two.py"],
        HIDE: ["one.py"],
        ("Silo_BOM", "Sync"): ["three.py"],
    }


def test_what_is_translated_stays_and_what_is_gone_is_marked(script: ModuleType, sources: Path) -> None:
    """Nobody's work is lost when a text changes."""
    known = {
        SYNC: script.Translation("Abgleichen", ""),
        ("Silo", "Gone"): script.Translation("Weg", ""),
        ("Silo", "Never done"): script.Translation("", "unfinished"),
    }
    made = sources / "silo_de.ts"
    made.write_text(script.ts(script.collect(sources), "de", known), encoding="utf-8")
    assert script.read(made) == (
        "de",
        {
            SYNC: script.Translation("Abgleichen", ""),
            HIDE: script.Translation("", "unfinished"),
            ("Silo", "Gone"): script.Translation("Weg", "vanished"),
            ("Silo_BOM", "Sync"): script.Translation("", "unfinished"),
        },
    )


@pytest.mark.parametrize(
    "call",
    ['translate("Silo", name)', 'translate(where, "x")', 'translate("x")', 'QT_TRANSLATE_NOOP("Silo", "x")'],
)
def test_a_text_that_cannot_be_seen_is_a_mistake(script: ModuleType, sources: Path, call: str) -> None:
    """Qt's tools read the source, they do not run it."""
    (sources / "bad.py").write_text(f"\n{call}\n")
    with pytest.raises(script.NotLiteral, match=r"bad\.py:2: wanted (translate|QT_TRANSLATE_NOOP)"):
        script.collect(sources)
