# SPDX-License-Identifier: LGPL-2.1-or-later
"""``python -m silo_server``: the server without the rest of silo-mod (containers, systemd)."""

from __future__ import annotations

import argparse
import sys

from silo.bom.errors import SiloError
from silo_server.run import serve


def main(argv: list[str] | None = None) -> int:
    """Serve until stopped; 2 with one plain sentence where it cannot."""
    parser = argparse.ArgumentParser(prog="python -m silo_server", description=__doc__)
    parser.add_argument(
        "--host", default="127.0.0.1", help="address to listen on (default: this machine only)"
    )
    parser.add_argument("--port", type=int, default=8080, help="port; 0 takes a free one (default: 8080)")
    parser.add_argument("--database", metavar="URL", help="sqlite:///FILE or postgresql://…")
    parser.add_argument("--workers", type=int, default=1, metavar="N", help="server processes")
    parser.add_argument(
        "--reset-admin", metavar="NAME", help="make this user an active admin, and print a login link"
    )
    args = parser.parse_args(argv)
    try:
        serve(args.host, args.port, args.database, workers=args.workers, reset_admin=args.reset_admin)
    except SiloError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
