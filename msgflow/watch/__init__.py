"""A system seen while it runs: chunks of a recording, windows over them, alarms."""
