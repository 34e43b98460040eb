"""Runs migrations on the connection that msgflow.db.migration hands over."""

from alembic import context
from alembic.ddl.impl import DefaultImpl


class DuckDBImpl(DefaultImpl):
    """Teaches Alembic that DuckDB exists and that its DDL is transactional."""

    __dialect__ = "duckdb"
    transactional_ddl = True


context.configure(
    connection=context.config.attributes["connection"],
    version_table_schema="store",
    transactional_ddl=True,
)
with context.begin_transaction():
    context.run_migrations()
