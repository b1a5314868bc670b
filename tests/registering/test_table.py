# SPDX-License-Identifier: LGPL-2.1-or-later
"""The table of ``silo-mod register`` as spreadsheets and people send it back."""

from __future__ import annotations

import csv

import pytest
from hypothesis import given
from hypothesis import strategies as st

from silo.bom.entry import BomEntry
from silo.bom.errors import InputError
from silo.bom.items.proposal import Proposal
from silo.registering.candidate import Candidate, CandidateFiles, ComponentState
from silo.registering.offer import Offer
from silo.registering.table import read_table, write_table

CATEGORIES = {"M01": "Machined part"}


def candidate(name: str = "Bracket") -> Candidate:
    entry = BomEntry("/v/Bracket.FCStd", object_name="Body", label=name, document_label=name)
    return Candidate(Proposal(entry, name, "part", "M01"), ComponentState.READY)


@pytest.mark.parametrize(
    ("data", "word"),
    [
        (b"", "the file is empty"),
        (b"PK\x03\x04\0\0", "the workbook cannot be read"),
        (b"a,b\n1,2\n", "header line with Register"),
        (b"register,file\nyes,a\n", "there is no column object"),
    ],
)
def test_what_is_no_table_is_refused(data: bytes, word: str) -> None:
    with pytest.raises(InputError) as error:
        read_table(data, "plan.csv")
    assert word in " ".join((str(error.value), *error.value.problems))


HEADER = "register,file,object,standard,name,type,category,part_number,note,fingerprint"


def as_saved_by(how: str, rows: list[list[str]]) -> bytes:
    """A table as programs save it."""
    if how == "excel":  # western Europe: semicolons, an empty column that was once typed into
        lines = [";".join([*row, "", ""]) for row in rows]
        return b"\xef\xbb\xbf" + "\r\n".join([*lines, ";" * 11, ""]).encode()
    if how == "quoted":  # LibreOffice, "quote all text cells"
        return "".join(",".join(f'"{cell}"' for cell in row) + "\n" for row in rows).encode()
    if how == "reordered":
        order = [4, 9, 0, 2, 1, 3, 8, 7, 6, 5]
        return "".join("\t".join(row[i] for i in order) + "\n" for row in rows).encode()
    if how == "unicode text":
        return "".join("\t".join(row) + "\r\n" for row in rows).encode("utf-16")
    assert how == "old mac"
    return "".join(",".join(row) + "\r" for row in rows).encode()


@pytest.mark.parametrize("how", ["excel", "quoted", "reordered", "unicode text", "old mac"])
def test_a_table_is_read_however_a_program_saves_it(how: str) -> None:
    """Nothing of it is lost, and the lines are those of the file."""
    rows = [
        HEADER.split(","),
        *([f"yes,Größe {n}.FCStd,Body,,'00{n},part,M01,,,x1".split(",") for n in (1, 2)]),
    ]
    found = read_table(as_saved_by(how, rows), "plan.csv").rows
    assert [(row.line, row.cells["name"], row.cells["file"]) for row in found] == [
        (2, "001", "Größe 1.FCStd"),
        (3, "002", "Größe 2.FCStd"),
    ]


@pytest.mark.parametrize(
    ("data", "word"),
    [
        (HEADER + ",name\nyes,a,b,,N,part,M01,,,,M\n", "the column name is there more than once"),
        (HEADER + '\nyes,a,b,,N,part,M01,,,"x1\nyes,c,d,,N,part,M01,,,x2\n', "cannot be read as CSV"),
        (HEADER + '\nyes,a,b,,"N"4,part,M01,,,x1\n', "the row of line 2 cannot be read as CSV"),
        (HEADER + "\nyes,a,b,,N,part,M01,,,x1,left over\n", "line 2: wanted 10 cells"),
    ],
)
def test_a_table_that_lost_its_shape_is_refused(data: str, word: str) -> None:
    """A quote that is not closed would swallow all rows below it, a second column one of two answers."""
    with pytest.raises(InputError) as error:
        read_table(data.encode(), "plan.csv")
    assert word in " ".join((str(error.value), *error.value.problems))


NUMERIC = [
    "00123",
    "1E5",
    "1e+05",
    "3-4",
    "12/2024",
    "MAR1",
    "1.Mrz",
    "Sept 2",
    "10:30",
    "5%",
    "TRUE",
    "1,000",
]


@pytest.mark.parametrize("name", NUMERIC)
def test_names_that_a_spreadsheet_takes_for_numbers_are_written_as_text(name: str) -> None:
    """ "00123" would come back as 123, "MAR1" as a day; nobody would see it among a thousand rows."""
    one = candidate(name)
    table = write_table(Offer((one,), CATEGORIES), lambda _: True, "/v")
    (cells,) = list(csv.DictReader(table.decode("utf-8-sig").splitlines()))
    assert cells["name"] == f"'{name}"
    (row,) = read_table(table, "plan.csv").rows
    assert row.cells["name"] == name


@given(
    st.text(st.characters(exclude_categories=["Cs", "Cc"]), min_size=1)
    | st.sampled_from(NUMERIC).map("'{}".format)
)
def test_a_name_comes_back_as_it_was_written(name: str) -> None:
    """With apostrophes of its own, too."""
    one = candidate(name)
    (row,) = read_table(write_table(Offer((one,), CATEGORIES), lambda _: True, "/v"), "plan.csv").rows
    assert row.cells["name"] == name.strip()


@given(st.lists(st.tuples(st.sampled_from("abc"), st.sampled_from(["", "1", "2"])), max_size=8))
def test_the_twin_of_a_file_is_the_first_other_file_with_its_content(files: list[tuple[str, str]]) -> None:
    """Several candidates of one file are no twins; what has no content is like nothing."""
    found = [
        Candidate(
            Proposal(BomEntry(path, object_name=str(n)), str(n), "part", "M01"),
            ComponentState.READY,
            sha256=sha,
        )
        for n, (path, sha) in enumerate(files)
    ]
    contents = CandidateFiles()
    for one in found:
        contents.add(one)
    for one in found:
        others = [c for c in found if one.sha256 == c.sha256 != "" and c.entry.doc_path != one.entry.doc_path]
        assert contents.twin(one) is (others[0] if others else None)
