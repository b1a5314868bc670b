# SPDX-License-Identifier: LGPL-2.1-or-later
"""What argparse says becomes a message of ours: the values of each place, whatever the words are."""

from __future__ import annotations

import re

from hypothesis import given
from hypothesis import strategies as st

from silo.bom.message import Message
from silo.cli.parser import _ARGPARSE, _said_by_argparse, _values

# Words that look like the sentences themselves.
PIECES = ("a", "", "argument ", ": ", ": invalid choice: ", " (choose from ", ")", " value: ", "\n")
WORDS = st.lists(st.sampled_from(PIECES), max_size=8).map("".join)


@given(text=st.sampled_from(_ARGPARSE), words=st.lists(WORDS, min_size=3, max_size=3))
def test_values_are_those_of_the_shortest_match(text: str, words: list[str]) -> None:
    """The judge is a regular expression, which is slow for long words."""
    names = re.findall(r"\{(\w+)\}", text)
    sentence = re.sub(r"\{(\w+)\}", lambda place: words[names.index(place[1])], text)
    for one in _ARGPARSE:
        pattern = re.sub(r"\\\{(\w+)\\\}", r"(?P<\1>.+?)", re.escape(one))
        found = re.fullmatch(pattern, sentence, re.DOTALL)
        assert _values(one, sentence) == (found.groupdict() if found else None)


def test_a_long_word_is_read_in_linear_time() -> None:
    """A regular expression with three places would not come to its end."""
    sentence = "argument " + ": invalid choice:  (choose from " * 50_000
    read = _said_by_argparse(sentence)
    assert isinstance(read, Message)
    assert read == sentence
