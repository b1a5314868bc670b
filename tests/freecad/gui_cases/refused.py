# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside FreeCAD: the server refuses one assembly's BOM, then it is read-only for a while."""

from __future__ import annotations

from typing import Any

from inside import (
    App,
    Gui,
    ask,
    assembly,
    boxes,
    button_texts,
    labels,
    link,
    part,
    press,
    ready,
    register,
    run,
    settled,
    tell,
    wait,
)


def commit(doc: Any) -> None:
    App.setActiveDocument(doc.Name)
    Gui.runCommand("Origin_Commit")


def waiting(one: Any) -> list[Any]:
    return [[w.part_number, w.file_left, w.bom_left, w.state.value] for w in one.session.shown.waiting]


def held(one: Any) -> bool:
    return any(w.state.value == "held" for w in one.session.shown.waiting)


def tries(one: Any) -> list[int]:
    """Grows with each run of sending: a refusal may be back before anybody saw one on its way."""
    told: list[int] = []
    original = one.session._sent_all

    def sent_all(result: Any) -> None:
        told.append(1)
        original(result)

    one.session._sent_all = sent_all
    return told


def refused(one: Any, gearbox: Any, other: Any) -> None:
    """The server knows the top below the gearbox, so the gearbox in the top would be a ring."""
    commit(gearbox.Document)
    wait(lambda: held(one) and settled())
    tell(rejected=waiting(one))
    wait(lambda: "Retry" in button_texts(one.dock))
    tell(rejected_text=labels(one.dock))

    # Another assembly is not held up.
    commit(other.Document)
    wait(lambda: boxes("BOM Updated: " + ask("number of other")) and settled())
    tell(still=waiting(one))

    # Tried again too early: it stays. Mended on the server: it goes.
    tried = tries(one)
    press_soon(one.dock, "Retry")
    wait(lambda: tried and held(one) and settled())
    ask("mend")
    press_soon(one.dock, "Retry")
    wait(lambda: settled() and not waiting(one))
    tell(after_retry=boxes("BOM Updated: " + ask("number of gearbox")))


def discarded(one: Any, frame: Any) -> None:
    """Another one is refused; this time the person gives it up."""
    commit(frame.Document)
    wait(lambda: held(one) and settled())
    press_soon(one.dock, "Discard")
    wait(lambda: settled() and not waiting(one))
    tell(discarded=True, instances=len(frame.Group))


def read_only(one: Any, other: Any, bolt: Any) -> None:
    """The banner says so, a commit waits, and goes by itself when the server takes changes again."""
    ask("read-only")
    wait(lambda: one.session.shown.connection == "read-only")
    wait(lambda: any("is read-only now" in text for text in labels(one.dock)))
    tell(read_only=labels(one.dock)[0])
    link(other, "B2", bolt)
    before = len(boxes("BOM Updated"))
    commit(other.Document)
    wait(lambda: waiting(one) and settled())
    tell(held=waiting(one))
    ask("normal")
    wait(lambda: one.session.shown.connection == "online")
    wait(lambda: settled() and not waiting(one) and len(boxes("BOM Updated")) > before)
    tell(released=boxes("BOM Updated")[0])


def press_soon(window: Any, text: str) -> None:
    """The pane is drawn a moment after the state has changed."""
    wait(lambda: text in button_texts(window))
    press(window, text)


def story() -> None:
    one = ready()
    one.dock.show_and_raise()
    bolt = part("Bolt")
    top = assembly("Top", ("B1", bolt, 0))
    gearbox = assembly("Gearbox", ("T1", top, 0))
    frame = assembly("Frame", ("T1", top, 0))
    other = assembly("Other", ("B1", bolt, 0))
    numbers = register(*(obj.Document for obj in (bolt, top, gearbox, frame, other)))
    tell(numbers=numbers)
    ask("break")
    refused(one, gearbox, other)
    discarded(one, frame)
    read_only(one, other, bolt)


run(story)
