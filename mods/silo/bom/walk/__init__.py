# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the walker knows of one object and of one assembly: kinds, arrays, joints, identity, the tree."""
