"""Requirements on a run: the file that lists them, and the verdicts."""
