"""Publishers and subscriptions say whether a file gave them their topic.

Before, no file could.
"""

from alembic import op

revision = "0009"
down_revision = "0008"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column, false for all."""
    for table in ("publisher", "subscription"):
        op.execute(f"ALTER TABLE store.{table} ADD COLUMN is_topic_declared BOOLEAN DEFAULT false")
        op.execute(f"ALTER TABLE store.{table} ALTER COLUMN is_topic_declared SET NOT NULL")
