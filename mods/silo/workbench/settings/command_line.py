# SPDX-License-Identifier: LGPL-2.1-or-later
"""The server in the configuration file of the command line, for the add-on on the same machine."""

from __future__ import annotations

import os

from silo.api.config import resolve_server
from silo.bom.errors import ConfigError


def file_server() -> object | None:
    """Read the server in the configuration file of the command line; None if there is none."""
    # The environment was read before; here it only says where the file is.
    env = {name: value for name, value in os.environ.items() if not name.startswith("SILO_")}
    try:
        return resolve_server(env=env)
    except ConfigError:
        return None
