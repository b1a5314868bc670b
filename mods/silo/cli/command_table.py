# SPDX-License-Identifier: LGPL-2.1-or-later
"""The commands by theme: each with its module, its help and an example.

A module is imported if its command is chosen; ``add_NAME`` in it adds the command's own options, ``run_NAME``
runs it.
"""

from __future__ import annotations

from silo.bom.message import message

# By theme, each command's module, help and example. A module is imported if its command is chosen; `add_NAME`
# in it adds the command's own options, `run_NAME` runs it.
THEMES = {
    "Look at files": {
        "bom": (
            "files.bom",
            message("show the BOM of a FreeCAD assembly, read from its files without FreeCAD"),
            "silo-mod bom examples/gearbox/TopAssembly.FCStd --flat",
        ),
        "bom-diff": (
            "files.bom_diff",
            message("show what changed in parts between two folders, or two git revisions; needs no server"),
            "silo-mod bom-diff --git main...HEAD",
        ),
        "where-used": (
            "files.where_used",
            message("show which files of a vault link to a file, and which tops a change of it touches"),
            "silo-mod where-used vault/parts/Bracket.FCStd --root vault/",
        ),
        "diff": (
            "files.diff",
            message("compare an assembly's BOM with the server's; changes nothing"),
            "silo-mod diff TopAssembly.FCStd --check",
        ),
    },
    "Bring them to Silo": {
        "register": (
            "register.command",
            message(
                "create items for components without a part number and write their identity into the files"
            ),
            "silo-mod register vault/ --plan parts.csv      (edit the table, then)\n  "
            "silo-mod register vault/ --apply parts.csv",
        ),
        "commit": (
            "exchange.project",
            message(
                "send the files of a project and its BOMs: what differs from Silo, with all that it links to"
            ),
            'silo-mod commit TopAssembly.FCStd --comment "longer arm"',
        ),
        "status": (
            "exchange.project",
            message(
                "compare a project with Silo: edited here, newer there, both, not in Silo; changes nothing"
            ),
            "silo-mod status robot/",
        ),
        "sync": (
            "exchange.sync",
            message("merge BOMs into the server; nothing is ever deleted, manual lines are never touched"),
            "silo-mod sync vault/ --report night.md --report night.xml",
        ),
        "import": (
            "items.import_table",
            message(
                "bring a BOM, a list of parts or a price list from a table (CSV, XLSX, ODS, XLS) into Silo"
            ),
            "silo-mod import bom bom.xlsx --product A01-0001 --check",
        ),
        "relink": (
            "files.relink",
            message("let the links of an assembly and its sub-assemblies lead to a file that has moved"),
            "silo-mod relink TopAssembly.FCStd --from parts/Bolt.FCStd --to hardware/Bolt.FCStd --dry-run",
        ),
    },
    "What is not in Silo yet": {
        "queue": (
            "exchange.queue",
            message("list the commits that wait, send them again, save their files or discard them"),
            "silo-mod queue retry",
        ),
    },
    "Look at Silo": {
        "search": (
            "items.search",
            message("find items by words of their name or by part number"),
            "silo-mod search base plate",
        ),
        "show": ("items.search", message("show an item with its BOM lines"), "silo-mod show A01-0001"),
        "order": (
            "items.order",
            message(
                "show what to order for so many pieces of a product, with prices, or write it as a table"
            ),
            "silo-mod order A01-0001 --quantity 50 --spares 5 --xlsx order.xlsx",
        ),
        "log": (
            "items.log",
            message(
                "show the revisions of a file's item, and which one the file is; or what changed in a product"
            ),
            "silo-mod log TopAssembly.FCStd --changes",
        ),
        "watch": (
            "items.watch",
            message("show the server's events as they happen (Ctrl-C ends)"),
            "silo-mod watch --item A01-0001",
        ),
    },
    "Get files back": {
        "pull": (
            "exchange.pull",
            message("fetch the file of an item with all that it links to; edited files stay as they are"),
            "silo-mod pull A01-0001 --into robot",
        ),
    },
    "Mass and inertia": {
        "inertia": (
            "masses.inertia",
            message(
                "mass, centre of mass and inertia of each link of a STEP assembly, with masses from a BOM"
            ),
            "silo-mod inertia arm.step --bom bom.csv --urdf arm.urdf --urdf-out robot.urdf",
        ),
        "mass": (
            "masses.mass",
            message(
                "mass, centre of mass and inertia of a FreeCAD assembly, from its parts' shapes and materials"
            ),
            "silo-mod mass TopAssembly.FCStd --push",
        ),
        "links": (
            "masses.links",
            message("a link map to start from: which part of an assembly belongs to which link of the robot"),
            "silo-mod links examples/arm/arm.step --urdf examples/arm/arm.urdf > map.yaml",
        ),
    },
    "The connection": {
        "login": (
            "setup.login",
            message("try a server's address and a token, and remember both for this user"),
            "silo-mod login https://silo.example.com",
        ),
        "logout": (
            "setup.login",
            message("forget the server and the token that login remembered"),
            "silo-mod logout",
        ),
        "whoami": ("setup.login", message("show which server is meant, and as whom"), "silo-mod whoami"),
        "doctor": (
            "setup.doctor",
            message("show what is where on this machine, which server is meant, and what fails"),
            "silo-mod doctor",
        ),
    },
    "A server": {
        "serve": (
            "setup.server",
            message("run a Silo server here, on SQLite or PostgreSQL; prints its address and a token"),
            "silo-mod serve --port 8080 --database postgresql://silo@localhost/silo",
        ),
        "backup": (
            "setup.server",
            message("save a server's database and files to a new folder, while it serves"),
            "silo-mod backup /backups/silo-2026-02-08 --database postgresql://silo@localhost/silo",
        ),
        "restore": (
            "setup.server",
            message("bring a server's database and files back from a backup, to SQLite or PostgreSQL"),
            "silo-mod restore /backups/silo-2026-02-08 --database sqlite:///silo.db",
        ),
        "summaries": (
            "setup.server",
            message("sum all products of a server up again, while it serves"),
            "silo-mod summaries --database postgresql://silo@localhost/silo",
        ),
        "demo": (
            "setup.demo",
            message("sync a real assembly with a temporary server and show what happens"),
            "silo-mod demo --keep",
        ),
    },
    "FreeCAD and shell": {
        "install-addon": (
            "setup.install_addon",
            message("put the add-on and its Python packages into a FreeCAD found on this machine"),
            "silo-mod install-addon --freecadcmd /usr/bin/freecadcmd",
        ),
        "completion": (
            "setup.completion",
            message("print what completes commands and options in a shell"),
            "silo-mod completion bash > ~/.local/share/bash-completion/completions/silo-mod",
        ),
        "help": ("setup.help", message("show the commands, or the options of one"), "silo-mod help sync"),
        "schema": (
            "setup.schema",
            message("print the JSON Schema of what a command prints with --json"),
            "silo-mod schema bom > bom.schema.json",
        ),
    },
}
