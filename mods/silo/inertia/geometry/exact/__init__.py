# SPDX-License-Identifier: LGPL-2.1-or-later
"""Volume, centre and tensor from exact faces, by our own integration. numpy only."""
