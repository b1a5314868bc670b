# SPDX-License-Identifier: LGPL-2.1-or-later
"""What becomes of a report: tables, JSON, CSV, Markdown, snippets, a URDF with its inertials filled in."""
