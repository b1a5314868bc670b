# SPDX-License-Identifier: LGPL-2.1-or-later
"""The content of the Activity dock (spec bom-sync §6): it draws :mod:`silo.workbench.pane.activity`."""

from __future__ import annotations

import time
from typing import Any

from silo.workbench.gui import widgets
from silo.workbench.gui.qt import QtCore, QtWidgets
from silo.workbench.pane.activity import Entry, Tone, gathered
from silo.workbench.pane.banner import banner
from silo.workbench.pane.boxes import BannerWidget, Box, BusyWidget, OnAction, WaitingWidget
from silo.workbench.session.shown import Shown
from silo.workbench.words import translate

# More boxes than this are made only when somebody asks for them: widgets cost time, values do not.
FIRST, MORE = 40, 60


def _waits(shown: Shown) -> object:
    """What is drawn of what waits."""
    return shown.waiting, shown.server, shown.theirs, shown.reason


class Pane(QtWidgets.QWidget):  # type: ignore[misc]
    """The content of the dock: connection and work in progress; below them scrolls what waits, and the boxes,
    newest first."""

    def __init__(self, on_action: OnAction) -> None:
        super().__init__()
        self._on_action = on_action
        self._shown: Shown | None = None
        self._boxes: dict[str, tuple[Entry, Any]] = {}
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
                "Nothing has happened yet. Commit an assembly with File → Commit to Silo, and what becomes "
                "of it is shown here.",
            ),
            Tone.QUIET,
        )
        self._older = widgets.link_button(translate("Silo", "Show older…"), self._show_older)
        # In the list: in a low window it would leave the news no room, and its own lines neither.
        self._list.addWidget(self._waiting)
        self._list.addWidget(self._empty)
        self._list.addWidget(self._older)
        self._list.addStretch(1)
        area.setWidget(inside)
        return area

    def draw(self, shown: Shown) -> None:
        """Show a state; only what changed is made anew."""
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
        """Another theme: what is coloured is made anew."""
        super().changeEvent(event)
        if event.type() in (QtCore.QEvent.Type.StyleChange, QtCore.QEvent.Type.PaletteChange):
            shown, self._shown = self._shown, None
            if shown is not None:
                QtCore.QTimer.singleShot(0, lambda: self._draw_anew(shown))

    def _draw_anew(self, shown: Shown) -> None:
        if self._shown is None:
            self._banner.forget()
            self._drop(tuple(self._boxes))
            self.draw(shown)

    def _draw_entries(self, entries: tuple[Entry, ...]) -> None:
        wanted = entries[: self._most]
        keys = {entry.key for entry in wanted}
        changed = [e.key for e in wanted if e.key in self._boxes and self._boxes[e.key][0] != e]
        self._drop((*(key for key in self._boxes if key not in keys), *changed))
        for place, entry in enumerate(wanted):
            if entry.key not in self._boxes:
                box = Box(entry, self._on_action)
                self._boxes[entry.key] = (entry, box)
                # What waits and the empty text stand first.
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
