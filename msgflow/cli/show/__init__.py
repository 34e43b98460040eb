"""What `msgflow watch` shows: a screen with its keys, or a line per window."""
