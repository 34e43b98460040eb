"""What the standard library has since Python 3.11, also under 3.10."""

from __future__ import annotations

import sys
from enum import Enum

if sys.version_info >= (3, 11):
    from typing import Self, Unpack

    import tomllib
else:
    import tomli as tomllib
    from typing_extensions import Self, Unpack

__all__ = ("Self", "StrEnum", "Unpack", "tomllib")


class StrEnum(str, Enum):
    """An enumeration of words: each is printed and compared as the word that it stands for."""

    __str__ = str.__str__
