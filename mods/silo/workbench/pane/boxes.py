# SPDX-License-Identifier: LGPL-2.1-or-later
"""The parts of the Database Activity pane: a box per entry, the banner, work in progress, what waits.

The content of the Activity dock (spec bom-sync §6): it draws what :mod:`silo.workbench.session.state` holds.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from typing import Any

from silo.outbox.status_text import host_of, pause_text
from silo.workbench.activity.box import Action, Do, EntryLine, PaneEntry
from silo.workbench.activity.feed import gathered
from silo.workbench.gui import widgets
from silo.workbench.gui.qt import QtCore, QtWidgets
from silo.workbench.pane.banner import Banner, banner
from silo.workbench.pane.waiting import (
    WaitingRow,
    can_send,
    heading,
    held_heading,
    held_rows,
    meant_for_another,
    rows,
)
from silo.workbench.session.state import PaneState
from silo.workbench.tone import Tone
from silo.workbench.words import plain, spoken, translate

# More boxes than this are made only when somebody asks for them: widgets cost time, values do not.
FIRST, MORE = 40, 60


def _waits(shown: PaneState) -> object:
    """Return the values from which the waiting entries are drawn."""
    return shown.waiting, shown.held, shown.server, shown.theirs, shown.reason


class Pane(QtWidgets.QWidget):  # type: ignore[misc]
    """The content of the dock: connection and work in progress; below them scrolls what waits, and the boxes,
    newest first."""

    def __init__(self, on_action: OnAction) -> None:
        super().__init__()
        self._on_action = on_action
        self._shown: PaneState | None = None
        self._boxes: dict[str, tuple[PaneEntry, Any]] = {}
        self._most = FIRST
        self._day = ""
        self.setMinimumWidth(240)
        layout = QtWidgets.QVBoxLayout(self)
        layout.setContentsMargins(6, 6, 6, 6)
        layout.setSpacing(6)
        self._banner = BannerWidget(on_action)
        self._busy = BusyWidget(on_action)
        self._waiting = WaitingWidget(on_action)
        for part in (self._banner, self._busy):
            layout.addWidget(part)
        layout.addWidget(self._make_list(), 1)

    def _make_list(self) -> Any:
        area = QtWidgets.QScrollArea()
        area.setWidgetResizable(True)
        area.setFrameShape(QtWidgets.QFrame.Shape.NoFrame)
        area.setHorizontalScrollBarPolicy(QtCore.Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        inside = QtWidgets.QWidget()
        self._list = QtWidgets.QVBoxLayout(inside)
        self._list.setContentsMargins(0, 0, 2, 0)
        self._list.setSpacing(6)
        self._empty = widgets.label(
            translate(
                "Silo",
                "Nothing has happened yet. Commit an assembly with File → Commit to Silo, and follow "
                "it here.",
            ),
            Tone.QUIET,
        )
        self._older = widgets.link_button(translate("Silo", "Show older…"), self._show_older)
        # It is in the list: in a low window it would otherwise leave no room for the news.
        self._list.addWidget(self._waiting)
        self._list.addWidget(self._empty)
        self._list.addWidget(self._older)
        self._list.addStretch(1)
        area.setWidget(inside)
        return area

    def draw(self, shown: PaneState) -> None:
        """Show a state; only what changed is drawn again."""
        before, self._shown = self._shown, shown
        self._banner.draw(banner(shown))
        self._busy.draw(shown)
        if before is None or _waits(before) != _waits(shown):
            self._waiting.draw(shown)
        today = time.strftime("%Y-%m-%d")
        if before is None or before.activity is not shown.activity or today != self._day:
            # At midnight "14:03" becomes a date.
            if today != self._day:
                self._drop(tuple(self._boxes))
            self._day = today
            self._draw_entries(gathered(shown.activity.entries))

    def changeEvent(self, event: Any) -> None:
        """Draw the colours again for another theme."""
        super().changeEvent(event)
        if event.type() in (QtCore.QEvent.Type.StyleChange, QtCore.QEvent.Type.PaletteChange):
            shown, self._shown = self._shown, None
            if shown is not None:
                QtCore.QTimer.singleShot(0, lambda: self._draw_anew(shown))

    def _draw_anew(self, shown: PaneState) -> None:
        if self._shown is None:
            self._banner.forget()
            self._drop(tuple(self._boxes))
            self.draw(shown)

    def _draw_entries(self, entries: tuple[PaneEntry, ...]) -> None:
        wanted = entries[: self._most]
        keys = {entry.key for entry in wanted}
        changed = [e.key for e in wanted if e.key in self._boxes and self._boxes[e.key][0] != e]
        self._drop((*(key for key in self._boxes if key not in keys), *changed))
        for place, entry in enumerate(wanted):
            if entry.key not in self._boxes:
                box = Box(entry, self._on_action)
                self._boxes[entry.key] = (entry, box)
                # What waits and the empty text are on top.
                self._list.insertWidget(place + 2, box)
        self._empty.setVisible(not entries)
        self._older.setVisible(len(entries) > len(wanted))

    def _drop(self, keys: tuple[str, ...]) -> None:
        for key in keys:
            _entry, box = self._boxes.pop(key)
            self._list.removeWidget(box)
            box.hide()
            box.deleteLater()

    def _show_older(self) -> None:
        self._most += MORE
        if self._shown is not None:
            self._draw_entries(gathered(self._shown.activity.entries))


OnAction = Callable[[Action], None]


def buttons(actions: Iterable[Action], on_action: OnAction) -> Any:
    """Make a row of link buttons."""
    made = []
    for action in actions:
        address = action.target if action.do is Do.VIEW else ""
        made.append(widgets.link_button(action.text, partial(on_action, action), address))
    return widgets.row(*made)


class Box(QtWidgets.QFrame):  # type: ignore[misc]
    """One entry."""

    def __init__(self, entry: PaneEntry, on_action: OnAction) -> None:
        super().__init__()
        self._on_action = on_action
        self.setObjectName("siloBox")
        edge = widgets.colour(entry.tone, self) or "palette(mid)"
        self.setStyleSheet(
            "QFrame#siloBox { border: 1px solid palette(mid); border-radius: 4px;"
            f" background: {_ground(self)}; border-left: 4px solid {edge}; }}"
        )
        layout = QtWidgets.QVBoxLayout(self)
        layout.setContentsMargins(9, 6, 8, 6)
        layout.setSpacing(3)
        layout.addLayout(self._head(entry))
        if entry.badges:
            badges = [widgets.label(badge.text, badge.tone, bold=True, wrap=False) for badge in entry.badges]
            layout.addLayout(widgets.row(*badges, gap=12))
        for line in entry.lines:
            self._line(layout, line)
        if entry.actions:
            layout.addLayout(buttons(entry.actions, self._on_action))

    def _head(self, entry: PaneEntry) -> Any:
        layout = QtWidgets.QHBoxLayout()
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(6)
        if entry.icon:
            layout.addWidget(widgets.picture(entry.icon), 0, QtCore.Qt.AlignmentFlag.AlignTop)
        title = widgets.label(entry.title, bold=True)
        if entry.who:
            # It is below the title, since a long name would leave it no room.
            column = QtWidgets.QVBoxLayout()
            column.setSpacing(0)
            column.addWidget(title)
            column.addWidget(widgets.label(entry.who, Tone.QUIET))
            layout.addLayout(column, 1)
        else:
            layout.addWidget(title, 1)
        when = widgets.label(_clock(entry.when), Tone.QUIET, wrap=False)
        when.setToolTip(time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(entry.when)))
        layout.addWidget(when, 0, QtCore.Qt.AlignmentFlag.AlignTop)
        return layout

    def _line(self, layout: Any, line: EntryLine) -> None:
        sign = {Tone.WARNING: "⚠ ", Tone.ERROR: "✗ "}.get(line.tone, "")
        layout.addWidget(widgets.label(sign + spoken(line.text) if sign else line.text, line.tone))
        if line.actions:
            layout.addLayout(buttons(line.actions, self._on_action))


def _ground(widget: Any) -> str:
    """Return the background of a box. In a dark theme the palette may still be the light one."""
    return "rgba(255, 255, 255, 13)" if widgets.is_dark(widget) else "palette(base)"


def _clock(when: float) -> str:
    moment = time.localtime(when)
    today = time.strftime("%Y-%m-%d")
    return time.strftime("%H:%M" if time.strftime("%Y-%m-%d", moment) == today else "%Y-%m-%d %H:%M", moment)


class BannerWidget(QtWidgets.QFrame):  # type: ignore[misc]
    """How the connection is, and what to do about it."""

    def __init__(self, on_action: OnAction) -> None:
        super().__init__()
        self._on_action = on_action
        self._drawn: Banner | None = None
        self.setObjectName("siloBanner")
        self._layout = QtWidgets.QVBoxLayout(self)
        self._layout.setContentsMargins(8, 5, 8, 5)
        self._layout.setSpacing(2)

    def forget(self) -> None:
        """Forget what was drawn, so that the next state is drawn completely."""
        self._drawn = None

    def draw(self, shown_banner: Banner) -> None:
        """Show the state of the connection."""
        if shown_banner == self._drawn:
            return
        self._drawn = shown_banner
        widgets.clear(self._layout)
        # Else the ground of the boxes, to which the colours fit; a theme's own may have any shade.
        ground = shown_banner.ground or _ground(self)
        self.setStyleSheet(f"QFrame#siloBanner {{ background: {ground}; border-radius: 4px; }}")
        text = widgets.label(shown_banner.text)
        self._layout.addWidget(text)
        if shown_banner.ground:
            # A theme gives labels a ground of their own.
            text.setStyleSheet(f"QLabel {{ color: {shown_banner.ink}; background: transparent; }}")
        else:
            widgets.paint(text, shown_banner.tone)
        if not shown_banner.actions:
            return
        made = [widgets.link_button(a.text, partial(self._on_action, a)) for a in shown_banner.actions]
        for button in made if shown_banner.ground else ():
            button.setStyleSheet(widgets.link_style(shown_banner.ink, "text-decoration: underline;"))
        self._layout.addLayout(widgets.row(*made))


class BusyWidget(QtWidgets.QWidget):  # type: ignore[misc]
    """What a worker is doing, with a way to stop it."""

    def __init__(self, on_action: OnAction) -> None:
        super().__init__()
        layout = QtWidgets.QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        self._text = widgets.label("", Tone.QUIET)
        self._bar = QtWidgets.QProgressBar()
        self._bar.setTextVisible(False)
        self._bar.setMaximumHeight(8)
        self._bar.setMaximumWidth(110)
        layout.addWidget(self._text, 1)
        layout.addWidget(self._bar)
        stop = Action(Do.STOP, translate("Silo", "Stop"))
        layout.addWidget(widgets.link_button(stop.text, partial(on_action, stop)))
        self.hide()

    def draw(self, shown: PaneState) -> None:
        """Show the work in progress, if there is any."""
        busy = shown.busy
        self.setVisible(busy is not None)
        if busy is None:
            return
        self._text.setText(plain(": ".join(filter(None, (busy.title, busy.detail))), 120))
        self._bar.setRange(0, 0 if busy.fraction is None else 1000)
        if busy.fraction is not None:
            self._bar.setValue(round(1000 * busy.fraction))


class WaitingWidget(QtWidgets.QFrame):  # type: ignore[misc]
    """What is not sent yet, and why, with what can be done about it."""

    # More of them would push the news out of sight; a button shows all, and all are sent.
    MOST = 4

    def __init__(self, on_action: OnAction) -> None:
        super().__init__()
        self._on_action = on_action
        self._most: int | None = self.MOST
        self.setObjectName("siloWaiting")
        self.setStyleSheet("QFrame#siloWaiting { border: 1px solid palette(mid); border-radius: 4px; }")
        self._layout = QtWidgets.QVBoxLayout(self)
        self._layout.setContentsMargins(9, 6, 8, 6)
        self._layout.setSpacing(3)
        self.hide()

    def draw(self, shown: PaneState) -> None:
        """Show the entries that wait."""
        widgets.clear(self._layout)
        self.setVisible(bool(shown.waiting or shown.held))
        self._held(shown)
        if not shown.waiting:
            self._most = self.MOST
            return
        self._layout.addWidget(widgets.label(heading(shown.waiting, shown.server.url), bold=True))
        if shown.pause is not None:
            pause = replace(shown.pause, reason=spoken(shown.pause.reason))
            pause_sentence = pause_text(pause, shown.server.url, time.time(), translate)
            self._layout.addWidget(widgets.label(plain(pause_sentence, 400), wrap=True))
        ordered = rows(shown.waiting, shown.server.url, shown.theirs, shown.reason, shown.pause)
        first = ordered[: self._most]
        for row in first:
            self._row(row)
        if left := len(ordered) - len(first):
            text = translate("Silo", "… and {n} more", n=left)
            self._layout.addWidget(widgets.link_button(text, partial(self._show_all, shown)))
        send = []
        if can_send(shown.waiting, shown.server.url):
            again = shown.pause is not None or any(entry.reason for entry in shown.waiting)
            text = translate("Silo", "Retry all") if again else translate("Silo", "Send now")
            send.append(Action(Do.RETRY, text))
        if len(away := meant_for_another(shown.waiting, shown.server.url)) > 1:
            host = host_of(shown.server.url)
            text = translate(
                "Silo", "Send all {n} commits for another address to {host}", n=len(away), host=host
            )
            send.append(Action(Do.SEND_HERE, text, target=",".join(map(str, away))))
        if send:
            self._layout.addLayout(buttons(send, self._on_action))

    def _held(self, shown: PaneState) -> None:
        """Show the BOMs that are held."""
        if not shown.held:
            return
        self._layout.addWidget(widgets.label(held_heading(len(shown.held)), bold=True))
        for row in held_rows(shown.held[: self._most]):
            self._row(row)
        if left := len(shown.held[self._most :] if self._most is not None else ()):
            text = translate("Silo", "… and {n} more", n=left)
            self._layout.addWidget(widgets.link_button(text, partial(self._show_all, shown)))

    def _show_all(self, shown: PaneState) -> None:
        self._most = None
        self.draw(shown)

    def _row(self, row: WaitingRow) -> None:
        what = f"{row.title} · {row.what} · {row.state} · {_clock(row.since)}"
        self._layout.addWidget(widgets.label(what, Tone.ERROR if row.urgent else Tone.PLAIN))
        if row.reason:
            self._layout.addWidget(widgets.label(row.reason, Tone.QUIET))
        for text in row.details:
            self._layout.addWidget(widgets.label(text, Tone.WARNING))
        if row.more:
            self._layout.addLayout(buttons(row.more, self._on_action))
        if row.actions:
            self._layout.addLayout(buttons(row.actions, self._on_action))
