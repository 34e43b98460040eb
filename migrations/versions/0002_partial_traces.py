"""What partial traces need.

Publications know the callback event before them; marks of what gaps may hide, failed takes, and
what is missing.

Frozen: it does not follow later changes of msgflow/db/tables.py.
"""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None

_LOSS_AFFECTED = {
    "publication": "A gap right before or after it on its thread may hide a layer",
    "take": "A gap right before or after it on its thread may hide a layer or its callback",
    "callback_instance": "A gap inside or beside it on its thread may hide its end or what it did",
}

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
    """Add the columns and tables, and fill the columns for the runs that are there."""
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
    for table, comment in _LOSS_AFFECTED.items():
        _add_column(table, "is_loss_affected", sa.Boolean(), f"{comment}; NULL: not known")
    op.create_table(
        "failed_take",
        _required("run_id", "Run that the row belongs to"),
        _required("trace_id", "Trace it was recorded in"),
        sa.Column("subscription_id", sa.BigInteger(), comment="Subscription"),
        _required("process_id", "Process it lives in"),
        _required("thread_id", "Thread it happened on"),
        _required("failed_ns", "Moment of the attempt [epoch ns]"),
        schema="store",
        comment="One row per attempt to take from a subscription that took nothing",
    )
    op.create_table(
        "undelivered",
        _required("run_id", "Run that the row belongs to"),
        _required("publication_id", "The message"),
        _required("publisher_id", "Its publisher"),
        _required("subscription_id", "Who did not take it"),
        sa.Column("reason", sa.String(), nullable=False, comment="Why; a closed vocabulary"),
        schema="store",
        comment=(
            "One row per publication and subscription of its topic that is not known to have "
            "taken it"
        ),
    )
    op.create_table(
        "orphan_take",
        _required("run_id", "Run that the row belongs to"),
        _required("take_id", "The take"),
        sa.Column("subscription_id", sa.BigInteger(), comment="Subscription that received it"),
        sa.Column("reason", sa.String(), nullable=False, comment="Why; a closed vocabulary"),
        schema="store",
        comment="One row per take whose publication is not known",
    )


def downgrade() -> None:
    """Drop the columns and tables."""
    for table in ("orphan_take", "undelivered", "failed_take"):
        op.drop_table(table, schema="store")
    for table in _LOSS_AFFECTED:
        op.drop_column(table, "is_loss_affected", schema="store")
    op.drop_column("publication", "callback_event_id", schema="store")


def _required(name: str, comment: str) -> sa.Column[int]:
    return sa.Column(name, sa.BigInteger(), nullable=False, comment=comment)


def _add_column(table: str, name: str, kind: sa.types.TypeEngine[object], comment: str) -> None:
    op.add_column(table, sa.Column(name, kind), schema="store")
    op.execute(f"COMMENT ON COLUMN store.{table}.{name} IS '{comment}'")
