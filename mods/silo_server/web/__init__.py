# SPDX-License-Identifier: LGPL-2.1-or-later
"""The web pages: server-rendered, usable without script, from the keyboard and on a phone."""
