# SPDX-License-Identifier: LGPL-2.1-or-later
"""Counting laws over random assemblies: the walker against a naive count, and against any order of a Group.

Links, arrays, containers, and standard parts in the assembly's own file, each in any of the others.

A plan says what a person built; from it come the fake documents that the walker sees, and, apart from that, a
count that does nothing but go from instance to instance and add one.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from fakes import Doc, ForwardingLink, edit
from hunting import examples
from hypothesis import given, settings
from hypothesis import strategies as st

from silo.bom import extract
from silo.bom.entry import BomEntry, Extraction
from silo.bom.findings import FindingCode
from silo.bom.view.flat_list import flat_counts
from silo.bom.walk.document import LinkProblem
from silo.bom.walk.standard import STANDARD_PARTS

Key = tuple[str, str]


# --- plans ------------------------------------------------------------------------------------------------


@dataclass
class Link:
    """``count`` 0 is a plain link; ``style`` is how FreeCAD would hold it; ``mark`` leaves it out."""

    target: str
    count: int = 0
    style: str = "link"
    mark: str = ""


@dataclass
class Screw:
    """``count`` standard parts in one array, or a single one; ``style`` is what shows them."""

    length: str
    count: int = 0
    style: str = "single"
    mark: str = ""


@dataclass
class Inside:
    """An inline container: a part, an assembly, a folder or a link group, shown ``repeats`` times more."""

    kind: str
    items: list[Any]
    repeats: int = 0
    mark: str = ""


@dataclass
class Plan:
    """Assemblies by name, each a list of items; what is named ``p…`` is a part. The last one is the top."""

    assemblies: dict[str, list[Any]] = field(default_factory=dict)

    @property
    def top(self) -> str:
        return list(self.assemblies)[-1]


STYLES = ("link", "live", "chain", "draft", "element")
MARKS = ("", "", "", "", "Suppressed", "SiloBomExclude")


def links(targets: list[str]) -> st.SearchStrategy[Link]:
    return st.builds(
        Link, st.sampled_from(targets), st.integers(0, 3), st.sampled_from(STYLES), st.sampled_from(MARKS)
    )


def screws() -> st.SearchStrategy[Screw]:
    styles = st.sampled_from(("single", "compound", "draft", "linked", "cut"))
    return st.builds(Screw, st.sampled_from(("8", "12")), st.integers(0, 3), styles, st.sampled_from(MARKS))


def items(targets: list[str], depth: int = 2) -> st.SearchStrategy[list[Any]]:
    one: st.SearchStrategy[Any] = links(targets) | screws()
    if depth:
        kinds = st.sampled_from(["part", "assembly", "folder", "link_group"])
        one = one | st.builds(
            Inside, kinds, items(targets, depth - 1), st.integers(0, 2), st.sampled_from(MARKS)
        )
    return st.lists(one, max_size=4)


@st.composite
def plans(draw: st.DrawFn) -> Plan:
    plan = Plan()
    targets = ["p0", "p1", "p2"]
    for number in range(draw(st.integers(1, 4))):
        name = f"a{number}"
        plan.assemblies[name] = draw(items(targets))
        targets = [*targets, name]
    return plan


# --- the naive count --------------------------------------------------------------------------------------


def instances(plan: Plan, name: str) -> Iterator[str]:
    """Every instance of every component in an assembly, one after the other."""
    for target in direct(plan.assemblies[name]):
        yield target
        if target in plan.assemblies:
            yield from instances(plan, target)


def direct(things: list[Any]) -> Iterator[str]:
    for thing in things:
        if thing.mark:
            continue
        if isinstance(thing, Screw):
            # Its own array shows the first one too; a link shows it once more; a cut consumes it.
            times = {"draft": max(1, thing.count), "linked": 1 + max(1, thing.count), "cut": 0}
            for _ in range(times.get(thing.style, 1)):
                yield f"ISO 4762 M4×{thing.length}"
        elif isinstance(thing, Link):
            # One element of an array is one; a chain through an array of two shows both each time.
            times = 1 if thing.style == "element" else max(1, thing.count)
            for _ in range(times * (2 if thing.style == "chain" else 1)):
                yield thing.target
        else:
            shown = 1 + (thing.repeats if thing.kind == "link_group" else 0)
            for _ in range(shown):
                yield from direct(thing.items)


# --- the documents ----------------------------------------------------------------------------------------


class Builder:
    """Makes the fake documents of a plan."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.targets: dict[str, Any] = {}
        self.serial = 0

    def name(self) -> str:
        self.serial += 1
        return f"N{self.serial}"

    def target(self, name: str) -> Any:
        if name not in self.targets:
            doc = Doc(f"/v/{name}.FCStd")
            self.targets[name] = (
                doc.assembly(*self.members(doc, self.plan.assemblies[name]))
                if name in self.plan.assemblies
                else doc.body()
            )
        return self.targets[name]

    def members(self, doc: Doc, things: list[Any]) -> list[Any]:
        return [obj for thing in things for obj in self.objects(doc, thing)]

    def objects(self, doc: Doc, thing: Any) -> list[Any]:
        mark = {thing.mark: True} if thing.mark else {}
        make: Any = {Link: self.link, Screw: self.screw}.get(type(thing), self.inside)
        found: list[Any] = make(doc, thing, mark)
        return found

    def screw(self, doc: Doc, thing: Screw, mark: dict[str, bool]) -> list[Any]:
        # What shows a screw carries the mark; where nothing does, or it stands beside its link, itself.
        inner = (
            mark
            if thing.style in ("single", "linked") or (thing.style == "draft" and not thing.count)
            else {}
        )
        one = doc.screw(self.name(), thing.length, **inner)
        if thing.style == "compound":
            return [doc.add("Part::Compound", self.name(), Links=[one], **mark), one]
        if thing.style == "draft" and thing.count:
            array = doc.add("Part::FeaturePython", self.name(), Base=one, Count=thing.count, **mark)
            return [array] if mark else [array, one]
        if thing.style == "linked":
            return [one, doc.array(self.name(), one, thing.count, **mark)]
        if thing.style == "cut":
            return [doc.add("Part::Cut", self.name(), Base=doc.body(self.name()), Tool=one), one]
        return [one]

    def link(self, doc: Doc, thing: Link, mark: dict[str, bool]) -> list[Any]:
        target, count = self.target(thing.target), thing.count
        if thing.style == "live":
            return [ForwardingLink(doc, self.name(), target, ElementCount=count, **mark)]
        if thing.style == "chain":
            hop = Doc(f"/v/hop-{self.name()}.FCStd").array(self.name(), target, 2)
            return [doc.link(self.name(), hop, ElementCount=count, **mark)]
        if thing.style == "element":
            return [doc.link(self.name(), (doc.array(self.name(), target, 5), "3."), **mark)]
        if thing.style == "draft" and count:
            base = doc.link(self.name(), target)
            array = doc.add("Part::FeaturePython", self.name(), Base=base, Count=count, **mark)
            return [array] if mark else [base, array]
        return [doc.array(self.name(), target, count, **mark)]

    def inside(self, doc: Doc, thing: Inside, mark: dict[str, bool]) -> list[Any]:
        inner = self.members(doc, thing.items)
        if thing.kind == "link_group":  # which does not list what lies in its folders
            inner = _without_what_lies_in_folders(inner)
        container = getattr(doc, thing.kind)(
            *([] if thing.kind == "assembly" else [self.name()]), *inner, **mark
        )
        if thing.kind == "assembly":
            edit(container)
            container.__dict__["Name"] = self.name()
        found = [container]
        if thing.kind == "folder":
            found += inner  # FreeCAD lists a folder's content in the assembly's Group as well
        if thing.kind == "link_group" and not mark:
            found += [doc.link(self.name(), container) for _ in range(thing.repeats)]
        return found


def _without_what_lies_in_folders(members: list[Any]) -> list[Any]:
    folders = [obj for obj in members if obj.TypeId == "App::DocumentObjectGroup"]
    inside = {id(obj) for folder in folders for obj in folder.Group}
    return [obj for obj in members if id(obj) not in inside]


def build(plan: Plan) -> Any:
    return Builder(plan).target(plan.top)


def key_of(plan: Plan, name: str) -> Key:
    if name.startswith("ISO"):
        return (STANDARD_PARTS, name)
    return (f"/v/{name}.FCStd", "Assembly" if name in plan.assemblies else "Body")


# --- laws -------------------------------------------------------------------------------------------------


@given(plans(), st.randoms(use_true_random=False))
def test_the_walk_is_the_naive_count_in_any_order(plan: Plan, random: Any) -> None:
    """Per one parent at each level, multiplied down the tree, and the same again after a walk.

    Plans have arrays, chains, live links, Draft arrays, inline containers, repeated groups, what is left out.
    """

    def check(entries: tuple[BomEntry, ...], name: str, level: int) -> None:
        wanted = Counter(key_of(plan, target) for target in direct(plan.assemblies[name]))
        assert {entry.key: entry.quantity for entry in entries} == wanted
        for entry in entries:
            assert entry.level == level
            below = entry.doc_path.removeprefix("/v/").removesuffix(".FCStd")
            if not entry.standard and below in plan.assemblies:
                check(entry.children, below, level + 1)

    asm = build(plan)
    found = extract(asm)
    check(found.entries, plan.top, 1)
    assert flat_counts(found.entries) == Counter(key_of(plan, name) for name in instances(plan, plan.top))
    assert extract(asm) == found
    is_order_free(asm, found, random)


def is_order_free(asm: Any, before: Extraction, random: Any) -> None:
    """Any order of any Group gives the same lines and the same findings."""
    shuffled(asm, random, set())
    after = extract(asm)
    assert normal(after.entries) == normal(before.entries)
    assert set(after.findings) == set(before.findings)


def shuffled(obj: Any, random: Any, seen: set[int]) -> None:
    """Mix every Group and ElementList below an assembly (elements of arrays have their order by name)."""
    if id(obj) in seen:
        return
    seen.add(id(obj))
    for name in ("Group", "ElementList"):
        members = list(obj.__dict__.get(name) or ())
        if obj.TypeId != "App::Link":
            random.shuffle(members)
            if members:
                edit(obj, **{name: members})
        for member in members:
            shuffled(member, random, seen)
    linked = obj.__dict__.get("LinkedObject")
    if linked is not None:
        shuffled(linked[0] if isinstance(linked, tuple) else linked, random, seen)


def normal(entries: tuple[BomEntry, ...]) -> Any:
    return sorted(
        (
            entry.key,
            entry.quantity,
            entry.level,
            entry.is_assembly,
            entry.consolidation_warning,
            entry.individual_links,
            sorted(entry.instances),
            normal(entry.children),
        )
        for entry in entries
    )


@st.composite
def tangles(draw: st.DrawFn) -> Any:
    """Assemblies that link each other in any way, rings included, with broken and odd links among them."""
    docs = [Doc(f"/v/t{number}.FCStd", meta={"SiloUUID": f"u{number % 2}"}) for number in range(4)]
    assemblies = [doc.assembly() for doc in docs]
    bolt = Doc("/v/bolt.FCStd", meta={"SiloUUID": "u1"}).body()
    problems = [LinkProblem(FindingCode.MISSING_FILE, "x.FCStd", "Box"), LinkProblem(FindingCode.UNSET_LINK)]
    for doc, asm in zip(docs, assemblies, strict=True):
        members = []
        for number, choice in enumerate(draw(st.lists(st.integers(0, 8), max_size=5))):
            name = f"L{number}"
            if choice < 4:
                members.append(doc.link(name, assemblies[choice]))
            elif choice < 6:
                members.append(doc.link(name, None, LinkProblem=problems[choice - 4]))
            elif choice == 6:
                members.append(doc.link(name, bolt, ScaleVector=(-1.0, 1.0, 1.0)))
            elif choice == 7:
                members.append(doc.link(name, (bolt, "Face1")))
            else:
                members.append(doc.body(name))
        edit(asm, Group=members)
    return assemblies[0]


@settings(max_examples=examples(60))
@given(tangles(), st.randoms(use_true_random=False))
def test_a_tangle_is_cut_at_the_same_place_in_any_order(asm: Any, random: Any) -> None:
    """However assemblies refer to each other, no component stands below itself, and the walk ends."""

    def check(entries: tuple[BomEntry, ...], above: tuple[Key, ...]) -> None:
        for entry in entries:
            assert entry.key not in above
            check(entry.children, (*above, entry.key))

    found = extract(asm)
    check(found.entries, (found.assembly.key,))
    is_order_free(asm, found, random)


@given(plans(), st.integers(0, 3), st.integers(1, 5))
def test_one_more_link_adds_what_it_shows_and_nothing_else(plan: Plan, which: int, count: int) -> None:
    """Additivity: an array of n more of a component changes exactly that component's quantity, by n."""
    name = [*(n for n in plan.assemblies if n != plan.top), "p0", "p1", "p2"][which % 3]
    asm = build(plan)
    before = {entry.key: entry.quantity for entry in extract(asm).entries}
    target = Builder(plan).target(name)
    edit(asm, Group=[*asm.Group, asm.Document.array("More", target, count)])
    after = {entry.key: entry.quantity for entry in extract(asm).entries}
    key = key_of(plan, name)
    assert after == {**before, key: before.get(key, 0) + count}
