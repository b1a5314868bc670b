# SPDX-License-Identifier: LGPL-2.1-or-later
"""What colleagues committed: as the server announces it, and as a look at Silo finds it."""
