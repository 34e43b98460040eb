"""Traces say whether requests would have events in them.

Before, only requests that were seen told so.
"""

from alembic import op

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column; of older runs without a request it is not known."""
    op.execute("ALTER TABLE store.trace ADD COLUMN has_request_events BOOLEAN")
    op.execute(
        "UPDATE store.trace SET has_request_events = true "
        "WHERE run_id IN (SELECT run_id FROM store.request)"
    )
