"""Recordings that are made now: LTTng sessions, from checks before to the last packet."""
