"""Network packets of kernel traces that tell how far clocks are apart.

Frozen: it does not follow later changes of msgflow/db/tables.py.
"""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the table; runs that are there have no packets."""
    op.create_table(
        "link_packet",
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("sent_trace_id", sa.BigInteger(), nullable=False, comment="Trace of its sender"),
        sa.Column(
            "received_trace_id", sa.BigInteger(), nullable=False, comment="Trace of its receiver"
        ),
        sa.Column(
            "sent_ns",
            sa.BigInteger(),
            nullable=False,
            comment="Handed to the network device [epoch ns]",
        ),
        sa.Column(
            "received_ns",
            sa.BigInteger(),
            nullable=False,
            comment="Came from the network device [epoch ns]",
        ),
        sa.Column("protocol", sa.String(), nullable=False, comment="'tcp' or 'udp'"),
        sa.Column(
            "source_address",
            sa.String(),
            nullable=False,
            comment="IP address that it was sent from",
        ),
        sa.Column(
            "source_port", sa.Integer(), nullable=False, comment="Port that it was sent from"
        ),
        sa.Column(
            "destination_address",
            sa.String(),
            nullable=False,
            comment="IP address that it was sent to",
        ),
        sa.Column(
            "destination_port", sa.Integer(), nullable=False, comment="Port that it was sent to"
        ),
        sa.Column(
            "identification",
            sa.Integer(),
            comment="Identification of the datagram; NULL: IPv6 has none",
        ),
        sa.Column(
            "sequence_number",
            sa.BigInteger(),
            comment="Sequence number of its first byte; NULL: not TCP",
        ),
        schema="store",
        comment="One row per network packet and clock that received it from another",
    )


def downgrade() -> None:
    """Drop the table."""
    op.drop_table("link_packet", schema="store")
