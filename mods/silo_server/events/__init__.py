# SPDX-License-Identifier: LGPL-2.1-or-later
"""Events: announced with each change, kept in a durable log, and streamed to who listens."""
