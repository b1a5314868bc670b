# SPDX-License-Identifier: LGPL-2.1-or-later
"""Inside FreeCAD: the pane in a light and in a dark theme; how well each text in it can be read."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Any

from inside import QtCore, QtGui, QtWidgets, tell, wait

# As FreeCAD's dark themes do it: by a style sheet, the palette stays light.
DARK = """
QWidget { background-color: #333333; color: #f0f0f0; }
QPushButton { background-color: #1a1a1a; border: 1px solid #000000; min-width: 80px; padding: 4px; }
"""


def in_themes(one: Any) -> None:
    """Also while the theme changes, and in a banner that has a ground of its own."""
    one.dock.show_and_raise()
    one.dock.setFloating(True)
    one.dock.resize(420, 900)
    wait(one.dock.isVisible)
    one.session._show(connection="read-only")
    app = QtWidgets.QApplication.instance()
    before = app.styleSheet()
    for name, sheet in (("light", before), ("dark", DARK), ("light again", before)):
        app.setStyleSheet(sheet)
        # The boxes are made again, which takes its time on a busy machine.
        wait(lambda name=name: can_be_read(one.dock, name))
    one.session._show(connection="online")


def can_be_read(dock: Any, name: str) -> bool:
    """Each text, by what WCAG asks of normal text (AA); the figures stay for the message of a failed test."""
    found = contrasts(dock)
    tell(**{name: found})
    shown = (any(wanted in text for text in found) for wanted in ("BOM Updated", "read-only"))
    return all(shown) and min(found.values()) >= 4.5


def contrasts(dock: Any) -> dict[str, float]:
    """Text → how it stands out from its ground: 1 not at all, 21 black on white (WCAG)."""
    picture = dock.grab().toImage().convertToFormat(QtGui.QImage.Format.Format_RGB32)
    # FreeCAD 0.20 draws with as many pixels as the screen's resolution asks for.
    ratio = picture.width() / dock.width()
    return {
        widget.text(): round(contrast(picture.copy(scaled(area, ratio))), 2) for widget, area in whole(dock)
    }


def whole(dock: Any) -> Iterator[tuple[Any, Any]]:
    """Each text that is not scrolled out of sight, not even in part, and where in the dock it is."""
    for kind in (QtWidgets.QLabel, QtWidgets.QPushButton):
        for widget in dock.widget().findChildren(kind):
            area = QtCore.QRect(widget.mapTo(dock, QtCore.QPoint(0, 0)), widget.size())
            is_whole = widget.visibleRegion().boundingRect() == widget.rect()
            if widget.text() and is_whole and dock.rect().contains(area):
                yield widget, area


def scaled(area: Any, ratio: float) -> Any:
    x, y, width, height = (round(side * ratio) for side in area.getRect())
    return QtCore.QRect(x, y, width, height)


def contrast(picture: Any) -> float:
    colours = Counter(
        picture.pixel(x, y) & 0xFFFFFF for y in range(picture.height()) for x in range(picture.width())
    )
    ground = luminance(colours.most_common(1)[0][0])
    return max((max(ground, one) + 0.05) / (min(ground, one) + 0.05) for one in map(luminance, colours))


def luminance(colour: int) -> float:
    parts = [(colour >> shift & 255) / 255 for shift in (16, 8, 0)]
    linear = [p / 12.92 if p <= 0.03928 else ((p + 0.055) / 1.055) ** 2.4 for p in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
