"""Tables of the schema `store`: their one definition, in SQLAlchemy Core.

`STORE.tables` has them by name. New databases are made from it (`empty_database.py`), rows are
stored by it (`store.py`), and the public views that show a table as it is are made from it too,
with their comments and their page of the documentation (`table_view.py`). Other public views over a
table are files of `schema/public`; what their columns share with the table stands only here. For
users the module `msgflow.schema` has the tables and the public views.

The comment of a table states its grain, the comment of a column its meaning. `column.py` documents
what their `info` holds. Each `ForeignKey` declares a relation. Databases do not have it: DuckDB's
foreign keys would forbid replacing a run in one transaction. `relation_check.py` proves it instead.
"""

from msgflow.db.tables import (
    bag,
    call,
    callback,
    clock,
    executor,
    flow,
    identity,
    link,
    recording,
    ros_object,
    schedule,
    user_event,
)
from msgflow.db.tables.column import STORE

__all__ = [
    "STORE",
    "bag",
    "call",
    "callback",
    "clock",
    "executor",
    "flow",
    "identity",
    "link",
    "recording",
    "ros_object",
    "schedule",
    "user_event",
]
