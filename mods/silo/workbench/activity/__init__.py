# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the Database Activity pane says: boxes as plain values, made of commits and events."""
