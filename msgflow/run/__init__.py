"""Runs, their choice, and time windows: the slice of a database that is read."""
