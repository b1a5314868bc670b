# SPDX-License-Identifier: LGPL-2.1-or-later
"""Small widgets that the pane and the dialogs share. Text is always shown as text, never as markup."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from silo.workbench import words
from silo.workbench.freecad import host
from silo.workbench.gui.flow_layout import FlowLayout
from silo.workbench.gui.qt import QtCore, QtGui, QtWidgets, run_dialog
from silo.workbench.tone import Tone

# (on a light ground, on a dark ground)
_COLOURS = {
    Tone.GOOD: ("#1f7a33", "#6fcf85"),
    Tone.CHANGED: ("#8a5a00", "#f0bd59"),
    Tone.WARNING: ("#a34a00", "#ffa94d"),
    Tone.ERROR: ("#b3202c", "#ff7b85"),
}


def is_dark(widget: Any) -> bool:
    """Return True if the widget's ground is dark (FreeCAD's dark themes).

    It looks at the colour of the text, since a theme that is a style sheet does not change the palette's
    ground.
    """
    widget.ensurePolished()
    return bool(widget.palette().color(QtGui.QPalette.ColorRole.WindowText).lightness() > 128)


def colour(tone: Tone, widget: Any) -> str:
    """Return the colour of a tone that is readable on the widget's ground; "" for the theme's own."""
    if tone is Tone.QUIET:
        widget.ensurePolished()
        text = widget.palette().color(QtGui.QPalette.ColorRole.WindowText)
        ground = widget.palette().color(QtGui.QPalette.ColorRole.Window)
        parts = [
            round(0.62 * t + 0.38 * g) for t, g in zip(text.getRgb()[:3], ground.getRgb()[:3], strict=True)
        ]
        return "#{:02x}{:02x}{:02x}".format(*parts)
    light, dark = _COLOURS.get(tone, ("", ""))
    return dark if is_dark(widget) else light


def label(text: str, tone: Tone = Tone.PLAIN, *, bold: bool = False, wrap: bool = True) -> Any:
    """Make a label of plain text, which wraps, and can be selected and copied."""
    made = QtWidgets.QLabel()
    made.setTextFormat(QtCore.Qt.TextFormat.PlainText)
    made.setText(words.breakable(text) if wrap else text)
    made.setWordWrap(wrap)
    made.setTextInteractionFlags(QtCore.Qt.TextInteractionFlag.TextSelectableByMouse)
    if wrap:
        # One word without a blank, however long, must not widen the whole pane.
        policy = made.sizePolicy()
        policy.setHorizontalPolicy(QtWidgets.QSizePolicy.Policy.Ignored)
        made.setSizePolicy(policy)
        made.setMinimumWidth(20)
    paint(made, tone, bold=bold)
    return made


def paint(made: Any, tone: Tone, *, bold: bool = False) -> None:
    """Give a label the colour of a tone, even if it has that of another tone."""
    # Its own colour is in its palette, and would be taken for that of the theme.
    made.setStyleSheet("")
    rules = []
    if chosen := colour(tone, made):
        rules.append(f"color: {chosen};")
    if bold:
        rules.append("font-weight: bold;")
    made.setStyleSheet("QLabel { " + " ".join(rules) + " }" if rules else "")


def link_button(text: str, call: Callable[[], None], tip: str = "") -> Any:
    """Make a button that looks like a link: it is not loud, and the keyboard reaches it."""
    made = QtWidgets.QPushButton(text)
    made.setFlat(True)
    made.setCursor(QtCore.Qt.CursorShape.PointingHandCursor)
    # By a label: some themes give buttons a light text on grounds of their own, which ours does not have.
    made.setStyleSheet(link_style("#7cb7ff" if is_dark(QtWidgets.QLabel()) else "#0b5cad"))
    made.setSizePolicy(QtWidgets.QSizePolicy.Policy.Fixed, QtWidgets.QSizePolicy.Policy.Fixed)
    made.setToolTip(words.tip(tip))
    made.clicked.connect(lambda _checked=False: call())
    return made


def link_style(shade: str, more: str = "") -> str:
    """Write the style sheet of a link, which must undo what FreeCAD's themes do to buttons."""
    return (
        f"QPushButton {{ color: {shade}; background: transparent; border: none; min-width: 0; min-height: 0;"
        f" margin: 0; padding: 1px 2px; text-align: left; {more} }}"
        "QPushButton:hover, QPushButton:focus { text-decoration: underline; }"
    )


def brush(tone: Tone, widget: Any) -> Any:
    """Make a brush in the colour of a tone for a cell; in the theme's own colour if the tone has none."""
    shade = colour(tone, widget)
    return QtGui.QBrush(QtGui.QColor(shade)) if shade else QtGui.QBrush()


def button(text: str, name: str, call: Callable[[], object], tip: str = "", *, default: bool = False) -> Any:
    """Make a push button; the Return key presses only the default button of a window."""
    made = QtWidgets.QPushButton(text)
    made.setObjectName(name)
    made.setAutoDefault(default)
    made.setDefault(default)
    made.setToolTip(words.tip(tip))
    made.clicked.connect(lambda _checked=False: call())
    return made


def field(name: str, hint: str = "", *, clear: bool = False) -> Any:
    """Make a field for a line of text; ``clear``: with a button that empties it."""
    made = QtWidgets.QLineEdit()
    made.setObjectName(name)
    made.setPlaceholderText(hint)
    made.setClearButtonEnabled(clear)
    return made


def line(*parts: Any) -> Any:
    """Make a layout of widgets in one line; those after None are at the right."""
    layout = QtWidgets.QHBoxLayout()
    for part in parts:
        layout.addStretch(1) if part is None else layout.addWidget(part)
    return layout


def lay_out(window: Any, name: str, title: str, width: int, height: int, *, modal: bool = False) -> Any:
    """Give a window its name and size; returns the layout of its content.

    modal
        the caller waits for the window, and deletes it afterwards; other windows are deleted when they are
        closed.
    """
    window.setObjectName(name)
    window.setWindowTitle(title)
    window.setAttribute(QtCore.Qt.WidgetAttribute.WA_DeleteOnClose, not modal)
    screen = QtGui.QGuiApplication.primaryScreen().availableGeometry()
    window.resize(min(width, screen.width() - 20), min(height, screen.height() - 40))
    layout = QtWidgets.QVBoxLayout(window)
    layout.setSpacing(8)
    return layout


def tree(name: str, headings: Sequence[str], numbers: Sequence[int] = (), *, flat: bool = True) -> Any:
    """Make a table of lines, or of lines below lines; the columns ``numbers`` are flush right."""
    made = QtWidgets.QTreeWidget()
    made.setObjectName(name)
    made.setRootIsDecorated(not flat)
    made.setHeaderLabels(list(headings))
    for column in numbers:
        made.headerItem().setTextAlignment(column, QtCore.Qt.AlignmentFlag.AlignRight)
    return made


def embolden(item: Any) -> None:
    """Write the first cell of a line in bold letters."""
    # A line of a tree has a font for each column, a cell of a table its own.
    where = (0,) if isinstance(item, QtWidgets.QTreeWidgetItem) else ()
    font = item.font(*where)
    font.setBold(True)
    item.setFont(*where, font)


def row(*widgets: Any, gap: int = 10) -> Any:
    """Make a layout of widgets side by side, in several lines if they need more width."""
    layout = FlowLayout(gap)
    for widget in widgets:
        layout.addWidget(widget)
    return layout


def picture(name: str, size: int = 16) -> Any:
    """Make a label with one of the add-on's own icons."""
    made = QtWidgets.QLabel()
    icon = host.icon(name)
    if icon is not None:
        made.setPixmap(icon.pixmap(size, size))
    made.setFixedSize(size, size)
    return made


def broken(text: str, metrics: Any, width: int) -> str:
    """Break a text into lines of at most ``width`` pixels; a wider word has a line of its own."""
    lines = [""]
    for word in text.split():
        longer = f"{lines[-1]} {word}".strip()
        if lines[-1] and metrics.horizontalAdvance(longer) > width:
            lines.append(word)
        else:
            lines[-1] = longer
    return "\n".join(lines)


def clear(layout: Any) -> None:
    """Remove all widgets of a layout."""
    while layout.count():
        item = layout.takeAt(0)
        if item.widget() is not None:
            item.widget().hide()
            item.widget().deleteLater()
        elif item.layout() is not None:
            clear(item.layout())


def read(parent: Any, title: str, lines: Iterable[str]) -> None:
    """Show all lines of a long text in a window that scrolls, and wait until it is closed."""
    window = QtWidgets.QDialog(parent)
    layout = lay_out(window, "SiloRead", title, 620, 420, modal=True)
    text = QtWidgets.QPlainTextEdit("\n".join(words.plain(line, 1000) for line in lines))
    text.setReadOnly(True)
    layout.addWidget(text)
    layout.addLayout(
        line(None, button(words.translate("Silo", "Close"), "close", window.accept, default=True))
    )
    run_dialog(window)
    window.deleteLater()


def _message(parent: Any, title: str, text: str) -> Any:
    box = QtWidgets.QMessageBox(parent)
    box.setIcon(QtWidgets.QMessageBox.Icon.Warning)
    box.setWindowTitle(title)
    box.setTextFormat(QtCore.Qt.TextFormat.PlainText)
    box.setText(words.visible(words.spoken(text), 2000))
    return box


def warn(parent: Any, title: str, text: str) -> None:
    """Show a problem, and wait until the person closes it."""
    run_dialog(_message(parent, title, text))


def confirm(parent: Any, title: str, text: str, yes: str, no: str) -> bool:
    """Ask a question with two answers; ``no`` is the harmless answer, also of Return and Escape."""
    box = _message(parent, title, text)
    box.setObjectName("SiloConfirm")
    wanted = box.addButton(yes, QtWidgets.QMessageBox.ButtonRole.DestructiveRole)
    harmless = box.addButton(no, QtWidgets.QMessageBox.ButtonRole.RejectRole)
    box.setDefaultButton(harmless)
    box.setEscapeButton(harmless)
    run_dialog(box)
    return bool(box.clickedButton() == wanted)
