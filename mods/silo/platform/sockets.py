# SPDX-License-Identifier: LGPL-2.1-or-later
"""Sockets that a server listens on: who may share a port."""

from __future__ import annotations

import socket
from typing import Any

from silo.platform.system import WINDOWS


def own_the_port(sock: socket.socket, constants: Any = socket) -> None:
    """Make sure that no second server can listen on the same port, and that this one can start again right
    after its end.

    On Windows, SO_REUSEADDR lets two programs share the port; so exclusive use is requested there.
    """
    exclusive = getattr(constants, "SO_EXCLUSIVEADDRUSE", None)
    option = constants.SO_REUSEADDR if exclusive is None else exclusive
    sock.setsockopt(socket.SOL_SOCKET, option, 1)


# Worker processes share one listening socket, which Windows does not hand to the event loop of a child.
WORKERS_CAN_SHARE_A_SOCKET = not WINDOWS
