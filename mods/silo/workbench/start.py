# SPDX-License-Identifier: LGPL-2.1-or-later
"""What FreeCAD's start runs (``InitGui.py``): announce commands, dock, workbench and preference page.

Nothing here talks to a server or imports what talks to one; that begins when the window stands. The whole
add-on may cost FreeCAD's start 50 ms.

Commit where people save: in the File menu and the File toolbar of every workbench.

FreeCAD >= 0.21 has workbench manipulators for that. In 0.20 the entries are put in place by hand after each
change of the workbench, since FreeCAD rebuilds its menus then.

FreeCAD's commands of the add-on: name, menu text, tooltip, icon, and what they ask of the add-on.

FreeCAD translates a command's texts itself, in the context of the command's name, also when the user changes
the language: so they are only marked here.

The Python packages that the add-on needs inside FreeCAD, and what to say where one is missing.
"""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from silo import FREECAD_PACKAGES
from silo.workbench import words
from silo.workbench.documents.opened import Opened
from silo.workbench.freecad import host
from silo.workbench.gui import qt
from silo.workbench.gui.qt import QtGui, QtWidgets
from silo.workbench.words import QT_TRANSLATE_NOOP, translate

if TYPE_CHECKING:
    from silo.workbench.addon import AddOn

COMMIT = "Origin_Commit"
# If FreeCAD, or a fork of it, has its own Origin_Commit, it is left alone and hooked; ours for
# committing by hand then has this name.
OWN_COMMIT = "Silo_Commit"
# The real Silo's workbench has a Silo_BOM and a Silo_Settings too. If a name is taken, ours is this.
FALLBACK = "SiloMod_{}"
BOM = "Silo_BOM"
REGISTER = "Silo_RegisterParts"
MASS = "Silo_Mass"
HELP = "Silo_Help"
INSTALL = "Silo_InstallPackages"
ACTIVITY = "Silo_Activity"
SETTINGS = "Silo_Settings"
OPEN = "Silo_Open"
PROJECT = "Silo_Project"
HISTORY = "Silo_History"


class Command:
    """A command as FreeCAD wants it: an object with ``GetResources``, ``Activated`` and ``IsActive``."""

    # No dataclass: to make one costs FreeCAD's start a millisecond.
    def __init__(
        self,
        text: str,
        tip: str,
        icon: str,
        run: Callable[[], None],
        keys: str = "",
        help: str = "",
        active: Callable[[], bool] = lambda: True,
    ) -> None:
        self.text, self.tip, self.icon, self.run = text, tip, icon, run
        self.keys, self.help, self.active = keys, help, active

    def GetResources(self) -> dict[str, str]:
        """Return the texts, the icon and the keys of the command."""
        texts = {
            "MenuText": self.text,
            "ToolTip": self.tip,
            "WhatsThis": self.help or self.tip,
            "StatusTip": self.tip,
            "Pixmap": self.icon,
            "Accel": self.keys,
        }
        return {name: text for name, text in texts.items() if text}

    def Activated(self, _index: int = 0) -> None:
        """Run the command: chosen from a menu, a toolbar, or by ``Gui.runCommand``."""
        self.run()

    def IsActive(self) -> bool:
        """Return True if FreeCAD offers the command now."""
        return self.active()


def commands(addon: Any) -> dict[str, Command]:
    """Make all commands. ``addon`` does the work (:class:`silo.workbench.addon.AddOn`)."""
    return {
        COMMIT: Command(
            text=QT_TRANSLATE_NOOP("Origin_Commit", "Commit to Silo"),
            tip=QT_TRANSLATE_NOOP(
                "Origin_Commit",
                "Save this document and its changed sub-assemblies, upload them as new revisions, "
                "and bring the BOM to Silo",
            ),
            icon="silo-commit",
            keys="Ctrl+Alt+S",
            help=QT_TRANSLATE_NOOP(
                "Origin_Commit",
                "Saves this document and the edited ones below it, uploads each as a new revision with your "
                "comment, and brings the BOM to Silo. Nothing is ever deleted there.",
            ),
            run=addon.commit,
            active=addon.has_document,
        ),
        BOM: Command(
            text=QT_TRANSLATE_NOOP("Silo_BOM", "Compare BOM with Silo…"),
            tip=QT_TRANSLATE_NOOP(
                "Silo_BOM", "Show how the BOM of this assembly differs from the one in Silo"
            ),
            icon="silo-bom",
            keys="Ctrl+Alt+B",
            run=addon.preview,
            active=addon.has_document,
        ),
        REGISTER: Command(
            text=QT_TRANSLATE_NOOP("Silo_RegisterParts", "Register Parts…"),
            tip=QT_TRANSLATE_NOOP(
                "Silo_RegisterParts", "Give part numbers to the components of this assembly that have none"
            ),
            icon="silo-register",
            keys="Ctrl+Alt+R",
            run=addon.register,
            active=addon.has_document,
        ),
        MASS: Command(
            text=QT_TRANSLATE_NOOP("Silo_Mass", "Mass of the Assembly…"),
            tip=QT_TRANSLATE_NOOP(
                "Silo_Mass",
                "Mass and centre of mass from the parts' shapes and materials, with what is missing",
            ),
            icon="silo-mass",
            keys="Ctrl+Alt+M",
            run=addon.mass,
            active=addon.has_document,
        ),
        ACTIVITY: Command(
            text=QT_TRANSLATE_NOOP("Silo_Activity", "Database Activity"),
            tip=QT_TRANSLATE_NOOP("Silo_Activity", "Show events in Silo, and commits that wait to be sent"),
            icon="silo-activity",
            keys="Ctrl+Alt+A",
            run=addon.show_activity,
        ),
        OPEN: Command(
            text=QT_TRANSLATE_NOOP("Silo_Open", "Open from Silo…"),
            tip=QT_TRANSLATE_NOOP(
                "Silo_Open", "Find an item in Silo and open its file with all that it links to"
            ),
            icon="silo-open",
            run=addon.open_from_silo,
        ),
        PROJECT: Command(
            text=QT_TRANSLATE_NOOP("Silo_Project", "Project"),
            tip=QT_TRANSLATE_NOOP(
                "Silo_Project", "All files of the project, which of them Silo has, and Commit All"
            ),
            icon="silo-project",
            keys="Ctrl+Alt+P",
            run=addon.show_project,
        ),
        HISTORY: Command(
            text=QT_TRANSLATE_NOOP("Silo_History", "History…"),
            tip=QT_TRANSLATE_NOOP(
                "Silo_History", "The revisions of this document: who, when, and what changed in the BOM"
            ),
            icon="silo-history",
            run=addon.history,
            active=addon.has_document,
        ),
        SETTINGS: Command(
            text=QT_TRANSLATE_NOOP("Silo_Settings", "Silo Settings…"),
            tip=QT_TRANSLATE_NOOP("Silo_Settings", "Server, token, and what a commit does"),
            icon="silo-settings",
            run=addon.show_settings,
        ),
        HELP: Command(
            text=QT_TRANSLATE_NOOP("Silo_Help", "Help on Silo"),
            tip=QT_TRANSLATE_NOOP(
                "Silo_Help", "Open the page that explains the commands, the pane and the messages"
            ),
            icon="silo",
            run=addon.show_help,
        ),
    }


AFTER = "Std_Save"
PLACED = (COMMIT, BOM)


class Manipulator:
    """Asked by FreeCAD whenever it builds the menus and toolbars of a workbench."""

    def __init__(self, names: Callable[[], list[str]], wanted: Callable[[], bool]) -> None:
        self._names, self._wanted = names, wanted

    def modifyMenuBar(self) -> list[dict[str, str]]:
        """Insert after Save; the last one inserted is on top."""
        if not self._wanted():
            return []
        return [{"insert": name, "menuItem": AFTER, "after": ""} for name in reversed(self._names())]

    def modifyToolBars(self) -> list[dict[str, str]]:
        """Append the commit to the File toolbar."""
        return [{"append": name, "toolBar": "File"} for name in self._names()[:1]] if self._wanted() else []


class ByHand:
    """The same for FreeCAD 0.20, with actions of our own that run the commands."""

    def __init__(self, names: list[str], wanted: Callable[[], bool]) -> None:
        self._names, self._wanted = names, wanted
        self._actions: dict[str, Any] = {}

    def put(self, _workbench: str = "") -> None:
        """Put the entries into their places, if they are not there."""
        if not self._wanted():
            return
        window = host.main_window()
        for menu in window.menuBar().findChildren(QtWidgets.QMenu):
            actions = menu.actions()
            place = next((i for i, a in enumerate(actions) if a.data() == AFTER), None)
            if place is not None and not any(a in actions for a in self._actions.values()):
                before = actions[place + 1] if place + 1 < len(actions) else None
                for name in self._names:
                    menu.insertAction(before, self._action(name))
        bar = window.findChild(QtWidgets.QToolBar, "File")
        if bar is not None and self._names and self._action(self._names[0]) not in bar.actions():
            bar.addAction(self._action(self._names[0]))

    def _action(self, name: str) -> Any:
        if name not in self._actions:
            info = host.command_info(name)
            text, tip = (words.of_command(name, info.get(key, "")) for key in ("menuText", "toolTip"))
            action = QtGui.QAction(text or name, host.main_window())
            action.setObjectName(name)
            action.setToolTip(tip)
            icon = host.icon(info.get("pixmap", ""))
            if icon is not None:
                action.setIcon(icon)
            action.triggered.connect(lambda _checked=False, name=name: host.run_command(name))
            self._actions[name] = action
        return self._actions[name]


RESOURCES = Path(__file__).parent / "resources"
PREFERENCE_GROUP = "Silo"
LOADING_MS = 30

TOOLBAR = (COMMIT, BOM, REGISTER, ACTIVITY)
MENU = (COMMIT, PROJECT, OPEN, HISTORY, BOM, REGISTER, MASS, ACTIVITY, SETTINGS, HELP)

# Kept for FreeCAD's whole run: its C++ side holds no reference to what Python hands over.
_kept: list[Any] = []


def start() -> None:
    """Make the add-on known to FreeCAD, once. A problem here stops the add-on, but never FreeCAD."""
    if _kept:
        _report_copies()
        return
    _kept.append(start)
    words.use(host.translate)
    host.add_resources(RESOURCES)
    if missing := missing_packages():
        from silo.workbench.settings.page import InstallDock, stub_commands

        host.error(packages_hint(missing, host.packages_folder(), sys.version_info[:2]))
        host.gui().addWorkbench(silo_workbench(Names(stub_commands(missing)), [INSTALL], [INSTALL]))
        _kept.append(InstallDock(host.main_window(), missing))
        return
    late = Late()
    names = Names(commands(late))
    host.gui().addWorkbench(silo_workbench(names, TOOLBAR, MENU))
    host.gui().addPreferencePage(late.preference_page(), PREFERENCE_GROUP)
    _kept.append(late)
    # FreeCAD asks it first when the first workbench starts; all add-ons are loaded then.
    manipulator = Manipulator(lambda: names.of(PLACED), late.shown_everywhere)
    by_hand = not host.add_workbench_manipulator(manipulator)
    _kept.append(manipulator)
    qt.later(0, lambda: when_loaded(lambda: finish(late.addon, names, by_hand=by_hand)))


class Late:
    """The add-on, imported and made when FreeCAD has loaded all add-ons, or asks for it."""

    def __init__(self) -> None:
        self._addon: AddOn | None = None
        # From the start: what a document was made from is known only when it is opened.
        self._opened = Opened(lambda: self.addon.session.outbox)
        host.add_document_observer(self._opened)

    @property
    def addon(self) -> AddOn:
        """Return the add-on; it is made at the first use."""
        if self._addon is None:
            from silo.workbench.addon import AddOn

            self._addon = AddOn(self._opened)
        return self._addon

    def __getattr__(self, name: str) -> Callable[[], Any]:
        return lambda: getattr(self.addon, name)()

    def preference_page(self) -> type:
        """Make the class that FreeCAD calls for the preference page when the page opens."""
        late = self

        class Page:
            def __new__(cls, _parent: object = None) -> Any:
                return late.addon.preference_page()

        return Page


def _report_copies() -> None:
    """Report that FreeCAD starts the add-on from several folders; the first one works."""
    places = Path(host.user_data_folder(), "Mod").glob("*/mods/silo/workbench/start.py")
    folders = ", ".join(sorted(str(place.parents[3]) for place in places))
    text = words.translate(
        "Silo",
        "Silo is installed more than once: {folders}. Only {used} is used; remove the others.",
        folders=folders,
        used=Path(__file__).parents[3],
    )
    host.error(text)


class Names:
    """Our commands, and the names that they got.

    They are added once all add-ons are loaded: where another one has a command of the same name, both are
    there. FreeCAD 0.20 would replace the first of them, later ones would drop the second, both silently.
    """

    def __init__(self, known: dict[str, Command]) -> None:
        self._known = known
        self._got: dict[str, str] = {}
        self.foreign: list[str] = []

    def of(self, wanted: Sequence[str]) -> list[str]:
        """Return FreeCAD's names of these commands; adds all commands to FreeCAD the first time."""
        if not self._got:
            self._got = {name: self._add(name, command) for name, command in self._known.items()}
        return [self._got[name] for name in wanted]

    def _add(self, name: str, command: Command) -> str:
        own: tuple[str, ...] = (OWN_COMMIT,) if name == COMMIT else ()
        for candidate in (name, *own, FALLBACK.format(name.partition("_")[2])):
            if host.add_command(candidate, command):
                return candidate
            self.foreign.append(candidate)
            # FreeCAD looks for texts under the name that the command got.
            text, tip, more = (
                words.of_command(name, one) for one in (command.text, command.tip, command.help)
            )
            command = Command(text, tip, command.icon, command.run, command.keys, more, command.active)
        return name


def when_loaded(call: Callable[[], None]) -> None:
    """Call after all add-ons are loaded. A timer alone is not enough: the splash screen lets timers run."""
    if host.has_active_workbench():
        call()
    else:
        qt.later(LOADING_MS, lambda: when_loaded(call))


def finish(addon: AddOn, names: Names, *, by_hand: bool) -> None:
    """Finish the start once all add-ons are loaded: one of them may have its own ``Origin_Commit``."""
    placed = names.of(PLACED)
    for name in names.foreign:
        if name in (COMMIT, OWN_COMMIT):
            # FreeCAD, or a fork of it, commits by itself: its command stays, its end is hooked.
            addon.hook_commit(name)
    if by_hand:
        hand = ByHand(placed, addon.shown_everywhere)
        _kept.append(hand)
        host.main_window().workbenchActivated.connect(hand.put)
        # A reloaded workbench is not activated again, so it sends no signal.
        qt.later(0, hand.put)
    # Our own menus get the commands that are new; the toolbars of another workbench are not ours to reset.
    workbench = host.gui().activeWorkbench()
    if workbench.name() == "SiloModWorkbench":
        workbench.reloadActive()
    addon.begin()


def silo_workbench(names: Names, toolbar: Sequence[str], menu: Sequence[str]) -> Any:
    """Make the Silo workbench: a toolbar and a menu with all commands.

    FreeCAD knows a workbench by the name of its class; the real Silo's is called SiloWorkbench.
    """

    class SiloModWorkbench(host.gui().Workbench):  # type: ignore[misc]  # FreeCAD has no types
        MenuText = words.translate("Silo", "Silo")
        ToolTip = words.translate("Silo", "Keep the BOM of an assembly in step with Silo")
        Icon = str(RESOURCES / "icons/silo.svg")

        def Initialize(self) -> None:
            self.appendToolbar("Silo", names.of(toolbar))
            self.appendMenu("&Silo", names.of(menu))

        def GetClassName(self) -> str:
            return "Gui::PythonWorkbench"

    return SiloModWorkbench()


def _is_installed(name: str) -> bool:
    return importlib.util.find_spec(name) is not None


def missing_packages(is_there: Callable[[str], bool] = _is_installed) -> tuple[str, ...]:
    """Return the packages that are not installed; they are imported by their names on PyPI."""
    return tuple(name for name in FREECAD_PACKAGES if not is_there(name))


def packages_hint(packages: Sequence[str], folder: str, python: tuple[int, int]) -> str:
    """Write the hint for the user in one line, with a command to copy for this very FreeCAD.

    folder
        where this FreeCAD looks for additional packages; ``python``: its version of Python.
    """
    # FreeCAD's own Python has no pip in some systems; any other of the same version serves.
    command = 'python{}.{} -m pip install --target "{}" {}'.format(*python, folder, " ".join(packages))
    return translate(
        "Silo",
        "Silo needs the Python packages {names}. Install them with silo-mod install-addon, or with: "
        "{command} – then start FreeCAD again.",
        names=", ".join(packages),
        command=command,
    )
