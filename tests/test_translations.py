# SPDX-License-Identifier: LGPL-2.1-or-later
"""The texts for translators (``scripts/translations.py``)."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path
from types import ModuleType

import pytest

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
    """After a text has changed: make translations. Every text of the add-on can be collected."""
    assert len(script.collect(also=script.SHARED)) > 100
    for path, text in script.wanted().items():
        assert path.read_text(encoding="utf-8") == text, f"{path.name}: run make translations"


def test_a_file_for_a_new_language_has_every_text(script: ModuleType, sources: Path) -> None:
    """Ready for Qt Linguist; the next run keeps what was translated in it."""
    template, path = made = script.wanted(["", "de"], sources, sources, ())
    assert (template, path) == (sources / "silo.ts", sources / "silo_de.ts")
    text = made[path]
    path.write_text(
        text.replace('<translation type="unfinished" />', "<translation>Abgleichen</translation>", 1)
    )
    template.write_text(made[template], encoding="utf-8")
    assert script.wanted((), sources, sources, ()) == {path: path.read_text(), template: made[template]}
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


def test_writing_again_changes_nothing(script: ModuleType, sources: Path) -> None:
    """And the file is one that Qt's tools read: one context, one source per message."""
    texts = script.collect(sources)
    made = sources / "silo.ts"
    made.write_text(script.ts(texts, "", {}), encoding="utf-8")
    assert script.ts(texts, *script.read(made)) == made.read_text(encoding="utf-8")
    text = made.read_text(encoding="utf-8")
    assert re.findall("<name>(.*)</name>", text) == ["Silo", "Silo_BOM"]
    assert re.findall("<source>(.*)</source>", text) == ["Sync", "Show &amp; &lt;hide&gt;", "Sync"]


@pytest.mark.parametrize(
    "call",
    ['translate("Silo", name)', 'translate(where, "x")', 'translate("x")', 'QT_TRANSLATE_NOOP("Silo", "x")'],
)
def test_a_text_that_cannot_be_seen_is_a_mistake(script: ModuleType, sources: Path, call: str) -> None:
    """Qt's tools read the source, they do not run it."""
    (sources / "bad.py").write_text(f"\n{call}\n")
    with pytest.raises(script.NotLiteral, match=r"bad\.py:2: wanted (translate|QT_TRANSLATE_NOOP)"):
        script.collect(sources)
