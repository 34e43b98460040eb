"""Files: written whole or not at all, read with their limits, and where they lie."""
