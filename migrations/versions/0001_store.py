"""Where the history of the tables begins: all of them, as `schema/store.sql` has them.

New databases are made of that file, not of revisions. The first release freezes this revision: a
copy of the file of that day, `0001_store.sql` beside this one, takes the place of it. Each later
change of a table is a revision after this one, with literal operations that do not follow later
changes. Its name is that of its file. Comments, views and macros need no revision: an upgrade
writes them anew.
"""

from alembic import op

from msgflow.db.store_table import store_file

revision = "0001_store"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Create the tables."""
    op.execute(store_file().read_text(encoding="utf-8"))
