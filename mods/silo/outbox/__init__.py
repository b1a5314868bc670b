# SPDX-License-Identifier: LGPL-2.1-or-later
"""The outbox: the one durable queue of commits that are not in Silo yet.

:mod:`entry` draws the states, :mod:`store` keeps them on disk (in :mod:`database`), :mod:`send` brings them
to the server and :mod:`report` says how that went.
"""
