"""The Model Context Protocol: agents ask a database."""
