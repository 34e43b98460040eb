"""Indirect links that a file declares: read, matched to the nodes of a run, stored, suggested."""
