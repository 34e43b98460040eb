"""Replay of a recorded run: how late its messages would be if something were changed."""
