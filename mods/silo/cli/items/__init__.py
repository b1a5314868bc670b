# SPDX-License-Identifier: LGPL-2.1-or-later
"""The commands that look at items of the server, and at what happened to them."""
