# SPDX-License-Identifier: LGPL-2.1-or-later
"""Users, their tokens and sessions, and the list of who did what."""
