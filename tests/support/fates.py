"""What became of a root: the columns of `e2e-latency` that add up to its roots."""

FATES = (
    "reached",
    "superseded",
    "dropped",
    "lost",
    "no_output",
    "not_connected",
    "unknown",
    "cut_by_recording",
)
