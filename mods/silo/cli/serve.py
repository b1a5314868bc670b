# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod serve``: the embedded server."""

from __future__ import annotations

import argparse
import importlib.util

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
    """Serve until told to stop."""
    need_server_extra()
    from silo_server.run import serve

    serve(host=args.host, port=args.port, database_url=args.database, workers=args.workers)
    return 0
