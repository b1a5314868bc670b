# SPDX-License-Identifier: LGPL-2.1-or-later
"""Pictures of the links: PNG and GLB."""
