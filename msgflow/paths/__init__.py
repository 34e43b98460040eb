"""Named paths: the file in which a user keeps them, and suggestions for it."""
