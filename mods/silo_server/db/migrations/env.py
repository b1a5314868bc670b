# SPDX-License-Identifier: LGPL-2.1-or-later
"""Alembic's entry: runs on the connection that ``silo_server.db.migrate`` hands over."""

from alembic import context

from silo_server.db.tables import metadata

connection = context.config.attributes["connection"]
context.configure(
    connection=connection,
    target_metadata=metadata,
    transactional_ddl=True,
    render_as_batch=connection.dialect.name == "sqlite",
)
context.run_migrations()
