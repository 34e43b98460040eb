"""Text: values as people and JSON read them, where lines are broken, and names that were meant."""
