"""Where the history of the tables begins: what `msgflow/db/tables.py` declares.

New databases are made of that declaration, not of revisions, and nothing older was released, so
that nothing has to be done here. Until the first release the tables may change without a revision:
a file with others is refused, and its traces are ingested again. From then on each change of a
table is a revision after this one, with literal operations that do not follow later changes.
"""

revision = "0008"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Do nothing."""
