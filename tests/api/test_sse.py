# SPDX-License-Identifier: LGPL-2.1-or-later
"""Server-sent events from bytes, wherever the stream is cut and however it ends its lines."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from silo.api.sse import ServerEvent, SseParser
from silo.bom.errors import ServerFaultError

MERGE = {
    "type": "bom_merge",
    "item": "ASM-001",
    "user": "joseph",
    "timestamp": "2026-02-08T22:15:00Z",
    "summary": "BOM updated: 1 added, 1 quantity changed, 1 unreferenced",
    "diff": {"added": [{"part_number": "PRT-300", "quantity": 1}], "removed": []},
    "resolve_url": "/items/ASM-001/bom",
}


def block(name: str | None, data: object, marker: str | None = None, end: str = "\n") -> bytes:
    lines = [f"id: {marker}"] if marker else []
    lines += [f"event: {name}"] if name else []
    lines += [f"data: {line}" for line in json.dumps(data, indent=1).split("\n")]
    return (end.join(lines) + end * 2).encode()


def parse(chunks: Iterable[bytes]) -> Iterator[ServerEvent]:
    parser = SseParser()
    for chunk in chunks:
        yield from parser.feed(chunk)


def one(raw: bytes) -> ServerEvent:
    (event,) = parse([raw])
    return event


def test_the_merge_of_the_spec() -> None:
    """Spec bom-sync §5, "SSE Event"."""
    event = one(block("bom_merge", MERGE, "17"))
    assert (event.id, event.type, event.item) == ("17", "bom_merge", "ASM-001")
    assert event.merge is not None
    assert event.merge.summary.startswith("BOM updated: 1 added")
    assert event.merge.diff.added[0].part_number == "PRT-300"


def test_the_merge_of_the_real_silo() -> None:
    """silo-contract §1.5: bom.merged, part_number, unchanged_count, no time stamp."""
    data = {"part_number": "A01-0002", "user": "joseph", "summary": "…", "diff": {"unchanged_count": 3}}
    event = one(block("bom.merged", data))
    assert (event.type, event.item) == ("bom_merge", "A01-0002")
    assert event.merge is not None
    assert event.merge.diff.unchanged_count == 3


def test_the_type_may_stand_in_the_data() -> None:
    """An event without a name is a "message"; the spec's JSON names itself."""
    assert one(block(None, MERGE)).type == "bom_merge"
    assert one(block(None, {"x": 1})).type == "message"


@pytest.mark.parametrize(
    ("name", "data", "item", "mode"),
    [
        ("item.created", {"part_number": "F01-0001", "description": "Bolt"}, "F01-0001", None),
        ("revision.created", {"part_number": "F01-0001", "revision_number": 2}, "F01-0001", None),
        ("server.state", {"mode": "read-only"}, None, "read-only"),
        ("heartbeat", {}, None, None),
        ("edit.session_acquired", {"item": 5}, None, None),
        ("jobs", [1, 2], None, None),
    ],
)
def test_other_events_keep_their_data(name: str, data: object, item: str | None, mode: str | None) -> None:
    """Read by key, the unknown is kept."""
    event = one(block(name, data))
    assert (event.type, event.data, event.item, event.mode) == (name, data, item, mode)


@pytest.mark.parametrize("data", [b"data: no json\n\n", b"data: " + b"[" * 100_000 + b"\n\n"])
def test_what_is_no_json_stays_text(data: bytes) -> None:
    """An event is not lost for its form."""
    event = one(data)
    assert isinstance(event.data, str)
    assert event.merge is None


def test_a_merge_that_cannot_be_read_is_still_an_event() -> None:
    """It says that something happened; `data` still has it."""
    event = one(block("bom_merge", {"diff": "odd"}))
    assert (event.type, event.merge, event.data) == ("bom_merge", None, {"diff": "odd"})


def test_half_an_event_at_the_end_is_dropped() -> None:
    """The server sends it again; a truncated one would move the mark past it."""
    parser = SseParser()
    whole, half = block("a", 1, "1"), block("b", {"long": "text"}, "2")[:-1]
    assert [event.type for event in parser.feed(whole + half)] == ["a"]
    assert parser.last_event_id == "1"


def test_a_bare_mark_moves_on_without_an_event() -> None:
    """A server may say from where to continue."""
    parser = SseParser()
    assert parser.feed(b": connected\nid: 41\nretry: 2000\n\n") == []
    assert parser.last_event_id == "41"
    assert parser.feed(b"id: 4\x002\ndata: 1\n\n")[0].id is None
    assert parser.last_event_id == "41"


def test_an_event_without_end_is_refused() -> None:
    """Memory is bounded."""
    parser = SseParser(max_bytes=10_000)
    for _ in range(10):
        parser.feed(b"data: " + b"x" * 900)
    with pytest.raises(ServerFaultError, match="refused"):
        parser.feed(b"data: " + b"x" * 1900)


names = st.sampled_from(["bom_merge", "bom.merged", "item.created", "heartbeat", None])
texts = st.text(st.characters(exclude_categories=["Cs"]), max_size=30)
events = st.lists(
    st.tuples(
        names,
        st.one_of(texts, st.dictionaries(texts, texts, max_size=3), st.just(MERGE)),
        st.one_of(st.none(), st.integers(0, 10**9).map(str)),
        st.sampled_from(["\n", "\r\n", "\r"]),
    ),
    max_size=6,
)


def wire_of(chosen: list[tuple[str | None, object, str | None, str]], mark: bool) -> bytes:
    raw = b"".join(block(name, data, marker, end) for name, data, marker, end in chosen)
    return (b"\xef\xbb\xbf" if mark else b"") + raw


@given(events, st.booleans(), st.data())
def test_the_cut_of_the_stream_does_not_matter(
    chosen: list[tuple[str | None, object, str | None, str]], mark: bool, data: st.DataObject
) -> None:
    """Whole, byte by byte, or cut anywhere: the same events, in any mix of line ends."""
    raw = wire_of(chosen, mark)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(raw)), max_size=8)))
    pieces = [raw[a:b] for a, b in zip([0, *cuts], [*cuts, len(raw)], strict=True)]
    whole = list(parse([raw]))
    assert [(e.id, e.data) for e in whole] == [(marker, content) for _, content, marker, _ in chosen]
    assert list(parse(pieces)) == whole
    assert list(parse(raw[i : i + 1] for i in range(len(raw)))) == whole


def test_an_empty_piece_between_cr_and_lf_ends_no_line() -> None:
    """CR LF is one end of line, however the network cuts it."""
    (event,) = parse([b"data: 1\r", b"", b"\ndata: 2\r\n\r", b"", b"\n"])
    assert event.data == "1\n2"


@given(events, st.binary(max_size=40))
def test_garbage_after_an_event_does_no_harm_to_it(
    chosen: list[tuple[str | None, object, str | None, str]], garbage: bytes
) -> None:
    """What is complete is complete."""
    found = list(parse([wire_of(chosen, mark=False), garbage]))
    assert [e.data for e in found[: len(chosen)]] == [content for _, content, _, _ in chosen]


@given(st.binary(max_size=400))
def test_no_bytes_break_the_parser(raw: bytes) -> None:
    """Whatever comes: events or nothing, never a crash."""
    assert list(parse([raw])) == list(parse(raw[i : i + 1] for i in range(len(raw))))
