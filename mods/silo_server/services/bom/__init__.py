# SPDX-License-Identifier: LGPL-2.1-or-later
"""One BOM: its lines, how they change, and its history."""
