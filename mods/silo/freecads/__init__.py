# SPDX-License-Identifier: LGPL-2.1-or-later
"""The FreeCADs of this machine: where they are, what they have open, running one, the add-on in one."""
