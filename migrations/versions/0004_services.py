"""What services need: responses know the request that they answer.

Frozen: it does not follow later changes of msgflow/db/tables.py.
"""

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0002"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column. Earlier versions stored no responses: there is nothing to fill."""
    op.add_column(
        "response",
        sa.Column("request_id", sa.BigInteger(), comment="Request that it answers"),
        schema="store",
    )


def downgrade() -> None:
    """Drop the column."""
    op.drop_column("response", "request_id", schema="store")
