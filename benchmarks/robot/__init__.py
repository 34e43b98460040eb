"""A robot of ten nodes in eight processes, with problems that are planted in it."""
