# SPDX-License-Identifier: LGPL-2.1-or-later
"""STEP files: their text, their products as the kernel reads them, and split assemblies."""
