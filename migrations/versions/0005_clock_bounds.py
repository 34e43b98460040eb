"""What is known of the error of the correction of a clock, at any time; copies nobody gets.

Frozen: it does not follow later changes of msgflow/db/tables.py.
"""

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the table and the column.

    Clocks that are corrected already have no rows until they are so anew.
    """
    op.create_table(
        "clock_uncertainty",
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("clock_id", sa.BigInteger(), nullable=False, comment="The clock"),
        sa.Column(
            "at_ns",
            sa.BigInteger(),
            nullable=False,
            comment="Moment, as the clock showed it [epoch ns]",
        ),
        sa.Column(
            "uncertainty_ns",
            sa.BigInteger(),
            nullable=False,
            comment="Bound of the error of the correction at that moment [ns]",
        ),
        schema="store",
        comment="One row per clock and moment; between two the bound is a straight line",
    )
    op.add_column(
        "link_transport",
        sa.Column(
            "is_copy",
            sa.Boolean(),
            comment="Of what a ring buffer carries as well: no callback gets it; NULL: no",
        ),
        schema="store",
    )
    op.add_column(
        "stamp_clock",
        sa.Column(
            "segment",
            sa.BigInteger(),
            comment="Number of jumps of the clock before it",
        ),
        schema="store",
    )


def downgrade() -> None:
    """Drop the columns and the table."""
    op.drop_column("stamp_clock", "segment", schema="store")
    op.drop_column("link_transport", "is_copy", schema="store")
    op.drop_table("clock_uncertainty", schema="store")
