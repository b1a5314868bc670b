# SPDX-License-Identifier: LGPL-2.1-or-later
"""Server, token and preferences, and their page."""
