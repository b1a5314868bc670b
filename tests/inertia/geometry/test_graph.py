# SPDX-License-Identifier: LGPL-2.1-or-later
"""Unfolding products into instances, and the text of STEP files: pure parts, by laws where there are any."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from silo.bom.errors import InputError
from silo.inertia.geometry.graph import Child, Node, bottom_up, count_instances, unfold, unique_names
from silo.inertia.geometry.names import clean, is_generic, lost_characters
from silo.inertia.geometry.part21 import WANTED, EntityRef, Typed, decoded, scan


def moved(x: float) -> np.ndarray:
    """A placement along x."""
    result = np.eye(4)
    result[0, 3] = x
    return result


def chain(levels: int) -> dict[str, Node]:
    """A product in a product in a product …"""
    nodes = {str(n): Node(str(n), f"p{n}", (Child(f"c{n}", str(n + 1)),)) for n in range(levels)}
    return {**nodes, str(levels): Node(str(levels), "leaf", (), True)}


@given(st.integers(1, 6), st.integers(1, 4))
def test_unfolding_multiplies_uses(width: int, levels: int) -> None:
    """``width`` uses on each of ``levels`` levels are width**levels instances, each path once."""
    nodes = {
        str(n): Node(
            str(n), f"p{n}", tuple(Child(f"c{i}", str(n + 1), moved(i * 10.0**n)) for i in range(width))
        )
        for n in range(levels)
    }
    nodes[str(levels)] = Node(str(levels), "leaf", (), True)
    found = unfold(nodes, [Child("top", "0")], 10_000)
    assert len(found.instances) == width**levels == count_instances(nodes, bottom_up(nodes, "0"))
    assert len({i.path for i in found.instances}) == len(found.instances)
    positions = {round(float(i.transform[0, 3]), 9) for i in found.instances}
    assert len(positions) == width**levels


def test_the_top_assembly_takes_no_part_in_paths_but_several_roots_do() -> None:
    """One root with content is the top; two roots are both named."""
    nodes = {"a": Node("a", "A", (Child("x", "p"),)), "p": Node("p", "P", (), True)}
    assert [i.path for i in unfold(nodes, [Child("a", "a")], 9).instances] == [("x",)]
    found = unfold(nodes, [Child("a", "a"), Child("p", "p")], 9)
    assert [i.path for i in found.instances] == [("a", "x"), ("p",)]


def test_an_assembly_s_own_shape_stands_among_its_children() -> None:
    """It has the assembly's name, and its placement."""
    nodes = {
        "top": Node("top", "Top", (Child("sub", "sub", moved(5)),)),
        "sub": Node("sub", "Sub", (Child("x", "p", moved(1)),), True),
        "p": Node("p", "P", (), True),
    }
    found = unfold(nodes, [Child("top", "top")], 9).instances
    assert [(i.path, i.product_path) for i in found] == [
        (("sub", "Sub"), ("Sub",)),
        (("sub", "x"), ("Sub", "P")),
    ]
    assert [i.transform[0, 3] for i in found] == [5, 6]


def test_too_many_too_deep_and_rings_are_refused() -> None:
    """Counted before it is unfolded."""
    nodes = {"a": Node("a", "A", (Child("x", "p"), Child("y", "p"))), "p": Node("p", "P", (), True)}
    with pytest.raises(InputError, match="2 placed parts, more than the 1 allowed"):
        unfold(nodes, [Child("a", "a")], 1)
    with pytest.raises(InputError, match="more than 200 deep"):
        unfold(chain(3000), [Child("0", "0")], 10)
    with pytest.raises(InputError, match="'A' contains itself"):
        unfold({"a": Node("a", "A", (Child("x", "a"),))}, [Child("a", "a")], 10)


@given(st.lists(st.sampled_from(["bolt", "bolt<2>", "nut", "a/b", ""]), max_size=20))
def test_unique_names_are_unique_and_keep_the_first(names: list[str]) -> None:
    """All different, in order, none with a slash, the first use of a name unchanged."""
    found = unique_names(names)
    assert len(set(found)) == len(found) == len(names)
    assert not any("/" in name for name in found)
    if names:
        assert found[0] == names[0].replace("/", "|")


@pytest.mark.parametrize("name", ["SOLID", "COMPOUND", "SOLID_3", "=>[0:1:1:14]", "", "  ", "SHELL2"])
def test_names_that_the_kernel_makes_up_are_none(name: str) -> None:
    """Climbing to the product around them is the only way to a name."""
    assert is_generic(name)


@pytest.mark.parametrize("name", ["SOLIDWORKS part", "Compound", "Solid bracket", "=>"])
def test_names_that_people_give_are_names(name: str) -> None:
    """Even where they look alike."""
    assert not is_generic(name)


def test_lost_characters_and_control_characters() -> None:
    """Mojibake is kept and known; control characters are nobody's name."""
    assert lost_characters("Pe?a")
    assert lost_characters("Pe\ufffda")
    assert not lost_characters("Peça")
    assert clean(" a\x00b\x1b[31m\u200b ") == "ab[31m"


# --- Part 21 -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("raw", "text"),
    [
        (b"plain", "plain"),
        (b"it''s", "it's"),
        (rb"Pe\X\E7a", "Peça"),
        (rb"\X2\6F225B57\X0\!", "漢字!"),
        (rb"\X4\0001F600\X0\\", "😀\\"),
        (rb"a\S\g", "aç"),
        ("Größe".encode(), "Größe"),
        ("Größe".encode("cp1252"), "Größe"),
        (rb"\\server\\x", r"\server\x"),
        (rb"\X2\zz\X0\ ", "\\X2\\zz\\X0\\ "),
    ],
)
def test_strings_are_decoded(raw: bytes, text: str) -> None:
    """All escapes of the standard, and the two encodings that files have against it."""
    assert decoded(raw) == text


FILE = b"""ISO-10303-21;
DATA;
#1=PRODUCT('id;1','it''s #2=PRODUCT(',$,(#7,#8));
#3 = ( LENGTH_UNIT() NAMED_UNIT(*)
   SI_UNIT(.MILLI.,.METRE.) );
#4=IGNORED(1.,2.,3.);
#5=MEASURE_REPRESENTATION_ITEM('density',POSITIVE_RATIO_MEASURE(7.85E-6),#3);
#6=PRODUCT('broken,(#1);
ENDSEC;
END-ISO-10303-21;
"""


def test_wanted_entities_are_taken_apart() -> None:
    """Strings with brackets and semicolons, lists, references, typed values, complex entities, numbers."""
    found = scan(FILE, WANTED)
    assert found.complete
    assert found.keywords[1] == "PRODUCT"
    assert found.arguments(1)[:1] == ("id;1",)
    assert found.arguments(1)[3] == (EntityRef(7), EntityRef(8))
    assert found.arguments(3) == (
        Typed("LENGTH_UNIT", ()),
        Typed("NAMED_UNIT", (None,)),
        Typed("SI_UNIT", (".MILLI.", ".METRE.")),
    )
    assert found.arguments(5) == ("density", Typed("POSITIVE_RATIO_MEASURE", (7.85e-6,)), EntityRef(3))
    assert 4 not in found.keywords


@pytest.mark.parametrize("comment", ["/* #8=PRODUCT('c') */", "/* it's */", "/*/* '*/"])
def test_comments_hold_no_entities_and_strings_hold_no_comments(comment: str) -> None:
    """Also where the last mark of a comment in the file stands in a string."""
    names = ["a /* b */", "#9=PRODUCT(", "x*/", "/*"]
    rows = [f"#{number}=PRODUCT('{name}');\n" for number, name in enumerate(names, start=1)]
    found = scan((rows[0] + comment + "".join(rows[1:])).encode(), WANTED)
    assert {number: found.arguments(number) for number in (1, 2, 3, 4)} == {
        number: (name,) for number, name in enumerate(names, start=1)
    }
    assert 8 not in found.keywords


@given(st.binary(max_size=300))
def test_no_text_whatever_raises(noise: bytes) -> None:
    """Hostile text gives nothing, no exception."""
    found = scan(b"#1=PRODUCT(" + noise + b";\n#2=(" + noise, WANTED)
    for number in found.keywords:
        found.arguments(number)


def test_brackets_without_end_are_nothing() -> None:
    """A thousand opening brackets are no reason to recurse."""
    found = scan(b"#1=PRODUCT(" + b"(" * 1000 + b";", WANTED)
    assert found.arguments(1) == ()
