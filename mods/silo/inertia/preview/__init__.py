# SPDX-License-Identifier: LGPL-2.1-or-later
"""The links to look at: a GLB file and one HTML page."""
