"""Errors of metadata and of fields."""


class MetadataError(Exception):
    """The metadata cannot be understood; the message says why and where."""


class FieldError(Exception):
    """A field cannot be read; the message says why."""
