"""Pictures of a database in a browser: one front end, served (`ui`) or in one file (`report`)."""
