"""What every part that reads metadata may say of it."""


class MetadataError(Exception):
    """The metadata cannot be understood; the message says why and where."""
