# SPDX-License-Identifier: LGPL-2.1-or-later
"""A law of registering a folder: it offers at least what its assemblies offer one by one."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from fcstd_writer import Doc, locals_, part
from hunting import examples
from hypothesis import given, settings
from hypothesis import strategies as st
from public_projects import ASSEMBLIES

from silo.bom.entry import Extraction, walk_entries
from silo.files import documents_in
from silo.registering.closed_files import whole_folder
from silo.vault.index import Index
from silo.vault.plan import make_plan
from silo.vault.questions import Question
from silo.vault.reading import VaultReader

# Per assembly what it links to: a part, a screw of the library, or an assembly after it.
LINKS = st.lists(
    st.lists(st.tuples(st.sampled_from(["part", "screw", "next"]), st.integers(0, 3)), max_size=4)
)


def lost(folder: Path) -> set[tuple[str, str]]:
    """What an assembly of the folder has, and the folder does not offer."""
    tops = documents_in([str(folder)])
    with Index(None) as index:
        reading = VaultReader(index, None)
        plan = make_plan(tops, reading)
        whole, unused = whole_folder(plan, reading, str(folder))
        offered = {entry.key for entry in whole.entries if entry.doc_path not in unused}
        found = [reading.ask(Question(node.top, below=True)).found for node in plan.nodes.values()]
    trees = [(one.assembly, *one.entries) for one in found if isinstance(one, Extraction)]
    return {entry.key for tree in trees for entry in walk_entries(tree) if not entry.missing} - offered


@given(LINKS)
@settings(max_examples=examples(15), deadline=None)
def test_a_folder_offers_at_least_the_union_of_its_assemblies(
    assemblies: list[list[tuple[str, int]]],
) -> None:
    with TemporaryDirectory() as scratch:
        folder = Path(scratch)
        library = Doc(label="library")
        for number in range(4):
            part(f"part{number}", "Box").save(folder / f"part{number}.FCStd")
            screw = {"Type": "ISO4762", "Diameter": f"M{number + 3}", "Length": "16", "Offset": 0.0}
            library.add("Part::FeaturePython", f"Screw{number}", MatchOuter=False, Invert=False, **screw)
        library.save(folder / "library.FCStd")
        for number, links in enumerate(assemblies):
            top = Doc(label=f"top{number}")
            for place, (kind, which) in enumerate(links):
                after = min(number + 1 + which, len(assemblies))
                target = {
                    "part": (f"part{which}.FCStd", "Box"),
                    "screw": ("library.FCStd", f"Screw{which}"),
                    "next": (f"top{after}.FCStd", "Top")
                    if after < len(assemblies)
                    else ("part0.FCStd", "Box"),
                }[kind]
                top.link(f"L{place}", *target)
            names = locals_(*(f"L{place}" for place in range(len(links))))
            top.add("App::Part", "Top", Label=f"Top {number}", Group=names, Type="Assembly")
            top.save(folder / f"top{number}.FCStd")
        assert lost(folder) == set()


@pytest.mark.parametrize("project", sorted(ASSEMBLIES.glob("*/")), ids=lambda path: path.name)
def test_real_projects_offer_what_their_assemblies_use(project: Path) -> None:
    """Standard parts of a library file were taken for a file that no assembly uses."""
    assert lost(project) == set()
