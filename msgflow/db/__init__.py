"""The database: definition of its tables, connections, migrations, views and findings."""
