"""Many recordings, on one machine or many, into one lake: a folder or bucket of Parquet files.

docs/fleet.md says what a lake holds and what it promises to those who read it.
"""
