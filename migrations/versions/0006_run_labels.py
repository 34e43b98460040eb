"""What users say of a run: which robot, which build.

Frozen: it does not follow later changes of msgflow/db/tables.py.
"""

import sqlalchemy as sa
from alembic import op
from sqlalchemy.types import UserDefinedType

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None


class Texts(UserDefinedType[list[str]]):
    cache_ok = True

    def get_col_spec(self, **_: object) -> str:
        return "VARCHAR[]"


def upgrade() -> None:
    """Add the column."""
    op.add_column(
        "run",
        sa.Column(
            "labels",
            Texts(),
            comment="What users say of the run, KEY=VALUE each, sorted; NULL: nothing",
        ),
        schema="store",
    )


def downgrade() -> None:
    """Drop the column."""
    op.drop_column("run", "labels", schema="store")
