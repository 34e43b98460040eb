"""Tables of the schema `store`: their one definition, in SQLAlchemy Core.

`STORE.tables` has them by name. `python docs/generate.py` renders them into `schema/store.sql`.
What runs reads that file (`store_table.py`), since SQLAlchemy takes long to import. It makes new
databases of it, stores rows by it, and makes of it the public views that show a table as it is,
with their comments and their page of the documentation. Other public views over a table are files
of `schema/public`; what their columns share with the table stands only here. For users the module
`msgflow.schema` has the tables and the public views.

The comment of a table states its grain, the comment of a column its meaning. `column.py` documents
what their `info` holds. Each `ForeignKey` declares a relation. Databases do not have it: DuckDB's
foreign keys would forbid replacing a run in one transaction. `finding.py` proves it instead.
"""

from msgflow.db.tables import call, identity, link, recording, ros_object, schedule
from msgflow.db.tables.column import STORE

__all__ = ["STORE", "call", "identity", "link", "recording", "ros_object", "schedule"]
