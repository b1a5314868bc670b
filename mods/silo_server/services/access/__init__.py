# SPDX-License-Identifier: LGPL-2.1-or-later
"""Who may come in: users, their passwords, tokens, sessions and login links."""
