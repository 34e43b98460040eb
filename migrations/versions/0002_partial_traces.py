"""What partial traces need: publications know the callback event before them.

Frozen: it does not follow later changes of msgflow/db/tables.py.
"""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None

# The last begin or end of a callback before each publication, from the stored runs of callbacks.
_CALLBACK_EVENT = """
UPDATE store.publication SET callback_event_id = placed.event_id
FROM (
    SELECT b.publication_id, c.event_id
    FROM store.publication AS b
    ASOF JOIN (
        SELECT run_id, thread_id, start_event_id AS event_id FROM store.callback_instance
        UNION ALL
        SELECT run_id, thread_id, end_event_id FROM store.callback_instance
        WHERE end_event_id IS NOT NULL
    ) AS c
        ON b.run_id = c.run_id AND b.thread_id = c.thread_id AND b.start_event_id > c.event_id
) AS placed
WHERE publication.publication_id = placed.publication_id
"""


def upgrade() -> None:
    """Add the columns and fill them for the runs that are there."""
    op.add_column(
        "publication",
        sa.Column(
            "callback_event_id",
            sa.BigInteger(),
            comment="Last begin or end of a callback before it; NULL: none [event order]",
        ),
        schema="store",
    )
    op.execute(_CALLBACK_EVENT)


def downgrade() -> None:
    """Drop the columns."""
    op.drop_column("publication", "callback_event_id", schema="store")
