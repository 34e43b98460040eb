"""Runs keep how their clocks were to be brought together.

Before, that showed in what came of it: the methods of the clocks, and findings about them.
"""

from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column, and fill it from the clocks and findings of each run."""
    op.execute("ALTER TABLE store.run ADD COLUMN clock_sync VARCHAR")
    op.execute("""
        UPDATE store.run SET clock_sync = CASE
            WHEN run_id IN (SELECT run_id FROM store.clock WHERE method = 'file') THEN 'file'
            WHEN run_id IN (SELECT run_id FROM store.clock WHERE method IN ('messages', 'packets'))
                OR run_id IN (
                    SELECT run_id FROM store.finding
                    WHERE name IN ('clock_not_synchronised', 'clock_uneven')
                )
                THEN 'messages'
            ELSE 'none'
        END
    """)
