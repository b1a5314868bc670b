# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod serve``: the embedded server."""

from __future__ import annotations

import argparse
import importlib.util
import json
import signal
from contextlib import suppress
from dataclasses import asdict

from silo.bom.errors import ConfigError
from silo.cli import common
from silo.cli.common import Commands


def register(commands: Commands) -> None:
    """Add the command."""
    parser = common.add_command(
        commands,
        "serve",
        "run a Silo server here, on SQLite or PostgreSQL; prints its address and a token",
        "silo-mod serve --port 8080 --database postgresql://silo@localhost/silo",
    )
    parser.add_argument(
        "--host", default="127.0.0.1", help="address to listen on (default: this machine only)"
    )
    parser.add_argument("--port", type=int, default=8080, help="port; 0 takes a free one (default: 8080)")
    parser.add_argument(
        "--database", metavar="URL", help="sqlite:///FILE or postgresql://…; default: your data folder"
    )
    parser.add_argument("--workers", type=int, default=1, metavar="N", help="server processes (PostgreSQL)")
    parser.add_argument(
        "--reset-admin", metavar="NAME", help="make this user an active admin, and print a login link"
    )
    common.add_json_option(parser)
    parser.set_defaults(run=run)


def need_server_extra() -> None:
    """One plain sentence where the server's packages are not installed."""
    missing = [
        name for name in ("fastapi", "sqlalchemy", "alembic", "uvicorn") if not importlib.util.find_spec(name)
    ]
    if missing:
        raise ConfigError(
            f"the embedded server needs {', '.join(missing)}; install it with: pip install 'silo-mod[server]'"
        )


def run(args: argparse.Namespace) -> int:
    """Serve until stopped, which is how a server ends: 0 also after Ctrl-C or a TERM signal."""
    need_server_extra()
    from silo_server.run import Greeting, serve

    def tell(greeting: Greeting) -> None:
        text = json.dumps(asdict(greeting)) if args.json else "\n".join(greeting.lines())
        # Whoever reads the output of a pipe waits for the address, and the server never ends by itself.
        print(text, flush=True)

    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with suppress(KeyboardInterrupt):
        serve(
            args.host, args.port, args.database, workers=args.workers, reset_admin=args.reset_admin, tell=tell
        )
    return 0
