"""Results of queries: rows, how people read them on a terminal, how they print themselves."""
