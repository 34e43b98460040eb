"""Processes say whether they are several with equal ids.

Before, nothing looked for that: runs have to be read again to know.
"""

from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column; of older runs it is not known."""
    op.execute("ALTER TABLE store.process ADD COLUMN is_ambiguous BOOLEAN")
