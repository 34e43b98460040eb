"""Frequency of CPUs, second by second.

Older runs have none: they have to be read again, with their kernel traces.
"""

from alembic import op

revision = "0011"
down_revision = "0010"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column."""
    op.execute("ALTER TABLE store.cpu_usage ADD COLUMN frequency_hz BIGINT")
