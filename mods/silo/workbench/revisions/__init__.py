# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files from Silo: open an item, the history of a document, a colleague's revision, the project."""
