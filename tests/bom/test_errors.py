# SPDX-License-Identifier: LGPL-2.1-or-later
"""The error tree: as drawn, each with a status and a code, each saying whose fault it is."""

from __future__ import annotations

import inspect
import re

import pytest

from silo.bom import errors
from silo.bom.errors import CycleError, DocumentError, RejectedError, SiloError, counted, duration, listed

CLASSES = [cls for _, cls in inspect.getmembers(errors, inspect.isclass) if issubclass(cls, SiloError)]


def drawn() -> dict[str, str]:
    """Class → parent, as the module's docstring draws them."""
    tree, path = {}, {0: "SiloError"}
    for line in (errors.__doc__ or "").splitlines():
        if found := re.match(r"^    ([│ ]*)[├└]── (\w+)", line):
            depth = len(found[1]) // 4 + 1
            path[depth] = found[2]
            tree[found[2]] = path[depth - 1]
    return tree


def test_the_drawing_is_the_tree() -> None:
    """Every class stands in the drawing, below its parent."""
    assert drawn() == {cls.__name__: cls.__mro__[1].__name__ for cls in CLASSES if cls is not SiloError}


@pytest.mark.parametrize("cls", CLASSES)
def test_every_error_has_a_sentence_a_status_and_a_code(cls: type[SiloError]) -> None:
    """For the reader, for HTTP, and for machines."""
    assert cls.__doc__
    assert 400 <= cls.status_hint < 600
    assert re.fullmatch(r"[a-z_]+", cls.code)


def test_codes_are_kept_apart() -> None:
    """No two errors have one name; a class may go by its parent's."""
    codes = [cls.code for cls in CLASSES if "code" in vars(cls)]
    assert len(codes) == len(set(codes))


def test_errors_carry_what_they_know() -> None:
    """The path of a document, the ring of a cycle, all problems of a request at once."""
    assert (str(DocumentError("/v/a.FCStd", "no zip")), DocumentError("/v/a.FCStd", "no zip").path) == (
        "/v/a.FCStd: no zip",
        "/v/a.FCStd",
    )
    assert CycleError(["A", "B", "A"]).path == ("A", "B", "A")
    assert "A → B → A" in str(CycleError(["A", "B", "A"]))
    assert RejectedError("no", ["entry 0", "entry 3"]).problems == ("entry 0", "entry 3")
    assert RejectedError("no").problems == ()


@pytest.mark.parametrize(
    ("number", "text"), [(0, "0 links"), (1, "1 link"), (2, "2 links"), (1000, "1000 links")]
)
def test_counted(number: int, text: str) -> None:
    """Never "1 links"."""
    assert counted(number, "link") == text


def test_counted_with_another_plural() -> None:
    """Words that take no s."""
    assert (counted(1, "body", "bodies"), counted(2, "body", "bodies")) == ("1 body", "2 bodies")


def test_listed() -> None:
    """As many as fit, and how many more."""
    assert listed(["a", "b"]) == "a, b"
    assert listed(list("abcdef"), 4) == "a, b, c, d and 2 more"


def test_a_duration_has_the_largest_unit_of_which_there_are_two() -> None:
    hour, day = 3600, 86400
    spans = {0: "0 s", 119: "119 s", 120: "2 min", 2 * hour - 60: "119 min", 2 * hour: "2 hours"}
    spans |= {2 * day - hour: "47 hours", 2 * day: "2 days"}
    assert {seconds: duration(seconds) for seconds in spans} == spans
