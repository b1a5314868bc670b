# SPDX-License-Identifier: LGPL-2.1-or-later
"""OpenCASCADE through OCP, the only place that imports it beside the reader of STEP products."""
