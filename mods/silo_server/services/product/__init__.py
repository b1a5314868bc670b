# SPDX-License-Identifier: LGPL-2.1-or-later
"""All that is below an item: the graph of its BOMs, and what is made of the whole of it."""
