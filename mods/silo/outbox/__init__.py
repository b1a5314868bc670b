# SPDX-License-Identifier: LGPL-2.1-or-later
"""The outbox: the one durable queue of commits that are not in Silo yet.

:mod:`entry` draws the states, :mod:`store` keeps them on disk, :mod:`send` brings them to the server and says
how that went.
"""
