# SPDX-License-Identifier: LGPL-2.1-or-later
"""The matrix: every fixture and public assembly, in every FreeCAD, three ways that must agree.

Each FreeCAD builds the fixtures. Then each FreeCAD opens what it and all others built and the walker
walks the live objects; the FCStd reader reads the same files; the truth is written by hand. One process per
FreeCAD reads everything.
"""

from __future__ import annotations

import difflib
import json
import os
from pathlib import Path

import pytest
from freecad_cases import answers, corpora, machines
from freecad_cases.corpora import Corpus
from freecad_cases.machines import WANTED, FreeCAD
from freecad_cases.public import FOLDER, PublicAssembly, public_assemblies

from silo.bom.entry import Extraction
from silo.bom.errors import SiloError
from silo.bom.findings import FindingCode
from silo.bom.view.flat_list import flat_lines
from silo.fcstd import Library
from silo.freecads.run import run_freecad

pytestmark = pytest.mark.freecad

Answers = dict[Path, Extraction | SiloError]
PUBLIC = public_assemblies()


class Matrix:
    """Builds and reads on demand, each FreeCAD once."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._corpora: dict[str, Corpus] = {}
        self._live: dict[str, Answers] = {}
        self._files: Answers = {}

    def corpus(self, version: str) -> Corpus:
        if version not in self._corpora:
            self._corpora[version] = corpora.build(machines.need(version), self.folder / version)
        return self._corpora[version]

    def live(self, version: str) -> Answers:
        """What one FreeCAD says of every file, in one process."""
        if version not in self._live:
            freecad = machines.need(version)
            built = [self.corpus(one) for one in WANTED if one in machines.freecads()]
            tops = [corpus.top(key) for corpus in built for key in corpus.built]
            tops += [assembly.top for assembly in PUBLIC]
            self._live[version] = _walk_live(freecad, tops, self.folder / f"reader-{version}")
        return self._live[version]

    def file(self, top: Path) -> Extraction | SiloError:
        """What the FCStd reader says of a file."""
        if top not in self._files:
            self._files[top] = answers.read(top)
        return self._files[top]


def _walk_live(freecad: FreeCAD, tops: list[Path], profile: Path) -> Answers:
    env = freecad.profile(profile)
    results = run_freecad([str(top) for top in tops], command=freecad.command, timeout_s=120, env=env)
    return {Path(top): found for top, found in results}


@pytest.fixture(scope="session")
def matrix(tmp_path_factory: pytest.TempPathFactory) -> Matrix:
    return Matrix(tmp_path_factory.mktemp("matrix").resolve())


def disagreement(live: Extraction | SiloError, file: Extraction | SiloError, base: Path) -> list[str]:
    """Where live objects and the file reader differ in anything that an extraction holds."""
    if isinstance(live, SiloError) or isinstance(file, SiloError):
        return [] if str(live) == str(file) else [f"live: {live}; file: {file}"]
    one, two = (
        json.dumps(answers.whole(found, str(base)), indent=1, ensure_ascii=False).splitlines()
        for found in (file, live)
    )
    return list(difflib.unified_diff(one, two, "file", "live", lineterm="", n=1))


PAIRS = [(reader, builder) for reader in WANTED for builder in WANTED]


@pytest.mark.parametrize(("reader", "builder"), PAIRS, ids=[f"{r}-reads-{b}" for r, b in PAIRS])
def test_live_objects_give_the_truth(matrix: Matrix, reader: str, builder: str) -> None:
    """Every fixture of one FreeCAD, opened in another (or the same), counts as written in the truth table."""
    freecad, corpus = machines.need(reader), matrix.corpus(builder)
    answered = matrix.live(reader)
    wrong = []
    for key in corpus.built:
        if is_lost(key, freecad):
            continue
        found, truth = answered[corpus.top(key)], corpora.truth_of(key).for_live(freecad.version)
        wrong += [f"{key}: {text}" for text in answers.differences(found, truth, corpus.base(key))]
    assert wrong == []


@pytest.mark.parametrize(("reader", "builder"), PAIRS, ids=[f"{r}-reads-{b}" for r, b in PAIRS])
def test_live_objects_and_files_agree_in_everything(matrix: Matrix, reader: str, builder: str) -> None:
    """Entries, labels, identities, instances, findings with their words: the same from both."""
    freecad, corpus = machines.need(reader), matrix.corpus(builder)
    answered = matrix.live(reader)
    wrong = {}
    for key in corpus.built:
        truth = corpora.truth_of(key)
        if is_lost(key, freecad) or truth.for_live(freecad.version) is not truth:
            continue
        top = corpus.top(key)
        if lines := disagreement(answered[top], matrix.file(top), corpus.base(key)):
            wrong[key] = lines
    assert wrong == {}


def is_lost(key: str, freecad: FreeCAD) -> bool:
    """FreeCAD 0.20 cannot load assemblies of 1.0; another test says what is made of them."""
    return key.startswith("assembly/") and freecad.version < (1, 0)


@pytest.mark.parametrize("builder", ["1.0", "1.1"])
def test_an_old_freecad_never_reads_a_new_assembly_as_empty(matrix: Matrix, builder: str) -> None:
    """FreeCAD 0.20 drops the assemblies of newer files in silence; for us that is an error that blocks."""
    corpus, answered = matrix.corpus(builder), matrix.live("0.20")
    keys = [key for key in corpus.built if key.startswith("assembly/")]
    assert len(keys) > 50
    for key in keys:
        found = answered[corpus.top(key)]
        assert isinstance(found, Extraction), f"{key}: {found}"
        assert found.blocked, key
        assert [finding.code for finding in found.findings] == [FindingCode.LOST_ASSEMBLY], key
        assert "Do not save it here" in found.findings[0].message


# --- public assemblies ------------------------------------------------------------------------------------


@pytest.fixture
def public() -> list[PublicAssembly]:
    if not PUBLIC:
        pytest.skip(f"the public assemblies are not there ({FOLDER})")
    return PUBLIC


@pytest.mark.parametrize("reader", WANTED)
def test_public_assemblies_give_the_truth(matrix: Matrix, public: list[PublicAssembly], reader: str) -> None:
    """Instance counts per (file, object) of live objects equal the ground truth of every public assembly."""
    freecad, answered = machines.need(reader), matrix.live(reader)
    wrong = []
    for assembly in public:
        found = answered[assembly.top]
        if needs_newer(assembly.top, freecad):
            continue
        if isinstance(found, SiloError):
            wrong.append(f"{assembly.name}: {found}")
            continue
        counts = {
            (os.path.relpath(entry.doc_path, assembly.project), entry.object_name): count
            for entry, count in flat_lines(found.entries)
            if not entry.standard
            or (os.path.relpath(entry.doc_path, assembly.project), entry.object_name) in assembly.counts
        }
        if counts != assembly.counts:
            wrong.append(f"{assembly.name}: {set(counts.items()) ^ set(assembly.counts.items())}")
        told = {finding.code for finding in found.findings}
        if bool(assembly.missing) != (FindingCode.MISSING_FILE in told):
            wrong.append(f"{assembly.name}: missing files {set(assembly.missing)}, told {told}")
    assert wrong == []


@pytest.mark.parametrize("reader", WANTED)
def test_public_assemblies_read_the_same_from_files(
    matrix: Matrix, public: list[PublicAssembly], reader: str
) -> None:
    """Live objects and the file reader agree in everything on every public assembly."""
    freecad, answered = machines.need(reader), matrix.live(reader)
    wrong = {}
    for assembly in public:
        if not needs_newer(assembly.top, freecad) and (
            lines := disagreement(answered[assembly.top], matrix.file(assembly.top), assembly.project)
        ):
            wrong[assembly.name] = lines
    assert wrong == {}


def needs_newer(top: Path, freecad: FreeCAD) -> bool:
    with Library() as library:
        types = {obj.TypeId for obj in library.open(top).Objects}
    return freecad.version < (1, 0) and any(kind.startswith("Assembly::") for kind in types)
