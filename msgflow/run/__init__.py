"""Which runs, and between which times: what commands and queries are asked for."""
