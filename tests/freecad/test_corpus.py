# SPDX-License-Identifier: LGPL-2.1-or-later
"""The FCStd reader and the walker against fixtures that real FreeCADs wrote; needs no FreeCAD itself."""

from __future__ import annotations

import pytest
from freecad_cases import answers, corpora
from freecad_cases.corpora import Corpus
from freecad_cases.machines import WANTED
from freecad_cases.truth import CONTROL, TRUTH

ARCHIVES = {version: corpora.ARCHIVES / f"corpus-{version}.zip" for version in WANTED}
KEYS = [(version, key) for version, archive in ARCHIVES.items() for key in corpora.packed_keys(archive)]
CONTROL_CASES = sorted(path.name for path in CONTROL.iterdir() if path.is_dir())


@pytest.fixture(scope="session")
def unpacked(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Corpus]:
    folder = tmp_path_factory.mktemp("corpora")
    return {version: corpora.unpack(archive, folder / version) for version, archive in ARCHIVES.items()}


@pytest.mark.parametrize(("version", "key"), KEYS, ids=[f"{version}-{key}" for version, key in KEYS])
def test_the_reader_gives_the_truth(unpacked: dict[str, Corpus], version: str, key: str) -> None:
    """BOM, findings with their places, consolidation and identities are as written in the truth table."""
    corpus = unpacked[version]
    found = answers.read(corpus.top(key))
    assert answers.differences(found, corpora.truth_of(key), corpus.base(key)) == []


@pytest.mark.parametrize("name", CONTROL_CASES)
def test_the_control_cases_are_counted_right(name: str) -> None:
    """The published golden set: every one of T1 to T11 as expected.json says."""
    found = answers.read(CONTROL / name / "top.FCStd")
    assert answers.differences(found, TRUTH[name], CONTROL / name) == []


def test_every_case_is_in_a_corpus_and_has_a_truth() -> None:
    """No case is written down and not built, or built and not judged."""
    built = {key.partition("/")[2] for _, key in KEYS}
    assert built == set(TRUTH)
    assert set(CONTROL_CASES) == {name for name in TRUTH if name[0] == "T"}
    assert len(CONTROL_CASES) == 11
