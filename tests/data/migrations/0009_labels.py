"""Labels of runs: a migration as a release writes them, of a column that is in truth older."""

import sqlalchemy as sa
from alembic import op
from sqlalchemy.types import UserDefinedType

revision = "0009"
down_revision = "0008"
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
