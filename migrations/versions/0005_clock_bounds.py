"""What is known of the error of the correction of a clock, at any time; copies nobody gets.

Frozen: it does not follow later changes of msgflow/db/tables.py.
"""

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None

# A run is a recording; one execution of a callback is a callback instance.
WORDS = (
    (
        "TABLE store.callback_instance",
        "One row per run of a callback",
        "One row per callback instance",
    ),
    (
        "COLUMN store.callback_instance.callback_instance_id",
        "Identity of the run",
        "Identity of the callback instance",
    ),
    (
        "COLUMN store.executor_state.callback_instance_id",
        "First callback run in it",
        "First callback instance in it",
    ),
    (
        "TABLE store.link_causal",
        "One row per callback run, or take outside of any, that led to a publication",
        "One row per callback instance, or take outside of any, that led to a publication",
    ),
    (
        "COLUMN store.link_causal.candidate_count",
        "Runs that it could have been",
        "Callback instances that it could have been",
    ),
    (
        "TABLE store.link_request",
        "One row per request that a callback run or thread sent",
        "One row per request that a callback instance or thread sent",
    ),
    (
        "TABLE store.link_response",
        "One row per response and the callback run that sent it",
        "One row per response and the callback instance that sent it",
    ),
)


def upgrade() -> None:
    """Add the table and the columns, and say callback instance where that is meant.

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
    op.add_column(
        "stamp_clock",
        sa.Column(
            "is_sharp",
            sa.Boolean(),
            comment="The drift is known: publications microseconds apart are told apart; NULL: yes",
        ),
        schema="store",
    )
    for thing, _, new in WORDS:
        op.execute(f"COMMENT ON {thing} IS '{new}'")


def downgrade() -> None:
    """Drop the columns and the table."""
    for thing, old, _ in WORDS:
        op.execute(f"COMMENT ON {thing} IS '{old}'")
    op.drop_column("stamp_clock", "is_sharp", schema="store")
    op.drop_column("stamp_clock", "segment", schema="store")
    op.drop_column("link_transport", "is_copy", schema="store")
    op.drop_table("clock_uncertainty", schema="store")
