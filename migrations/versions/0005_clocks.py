"""What clock synchronisation needs: which clocks belong together, and how well drift is known.

Frozen: it does not follow later changes of msgflow/db/tables.py.
"""

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None

_COLUMNS = {
    "drift_uncertainty_ppb": (
        "What its bound grows by per time elapsed since reference_ns or before it; NULL: none, or "
        "not known [1e-9]"
    ),
    "reference_clock_id": (
        "Clock whose times its times become; NULL: not brought together with others"
    ),
}


def upgrade() -> None:
    """Add the columns; clocks that are there stay as they are."""
    for name, comment in _COLUMNS.items():
        op.add_column("clock", sa.Column(name, sa.BigInteger()), schema="store")
        op.execute(f"COMMENT ON COLUMN store.clock.{name} IS '{comment}'")


def downgrade() -> None:
    """Drop the columns."""
    for name in _COLUMNS:
        op.drop_column("clock", name, schema="store")
