# SPDX-License-Identifier: LGPL-2.1-or-later
"""The outbox: the one durable queue of commits that are not in Silo yet.

:mod:`entry` draws the states, :mod:`store` keeps them on disk (:mod:`tables`), :mod:`send` brings them to the
server, :mod:`report` says how that went, :mod:`status_text` how each entry stands.
"""
