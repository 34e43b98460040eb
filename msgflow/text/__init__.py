"""Text: values as people and JSON read them, and where lines are broken."""
