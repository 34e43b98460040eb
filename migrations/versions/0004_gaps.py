"""Breaks of a thread's record that losses on other CPUs may have caused.

Frozen: it does not follow later changes of msgflow/db/tables.py.
"""

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column."""
    op.add_column(
        "thread_break",
        sa.Column(
            "is_elsewhere",
            sa.Boolean(),
            comment="Only other CPUs lost events, which it may have visited; NULL: no",
        ),
        schema="store",
    )


def downgrade() -> None:
    """Drop the column."""
    op.drop_column("thread_break", "is_elsewhere", schema="store")
