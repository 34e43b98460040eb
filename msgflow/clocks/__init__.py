"""Clocks of several hosts: corrected by messages, by a file, or not at all."""
