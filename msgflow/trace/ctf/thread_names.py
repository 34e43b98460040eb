"""Thread names as a dictionary that all batches share: few of them, repeated in every event."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from msgflow.trace.ctf.compiled_columns import Texts
from msgflow.trace.numpy_arrow import integers_to_arrow, texts_to_arrow, to_arrow

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

_WORD = 8
_FACTOR = np.uint64(0x9E3779B97F4A7C15)


class ThreadNames:
    """All names seen so far."""

    def __init__(self) -> None:
        self._index_of_name: dict[str, int] = {}
        self._dictionary: pa.Array | None = None
        self._tables: dict[int, _Table] = {}
        self._texts: dict[int, Texts] = {}
        self._indexes_of_texts: dict[int, NDArray[np.int32]] = {}

    def array(self, indexes: NDArray[np.int32]) -> pa.Array:
        """Return names given by their indexes."""
        if self._dictionary is None or len(self._dictionary) < len(self._index_of_name):
            self._dictionary = texts_to_arrow(list(self._index_of_name))
        return pa.DictionaryArray.from_arrays(to_arrow(indexes), self._dictionary)

    def index_of(self, name: str) -> int:
        """Return the index of a name."""
        return self._index_of_name.setdefault(name, len(self._index_of_name))

    def index_of_bytes(self, content: bytes) -> int:
        """Return the index of the name that ends at the first NUL."""
        return self.index_of(content.partition(b"\0")[0].decode("utf-8", "replace"))

    def array_of(self, names: Iterable[str | None]) -> pa.Array:
        """Return an array of names given one by one."""
        indexes = [None if name is None else self.index_of(name) for name in names]
        self.array(np.empty(0, np.int32))
        return pa.DictionaryArray.from_arrays(
            integers_to_arrow(indexes, pa.int32()), self._dictionary
        )

    def texts(self, length: int) -> Texts:
        """Return what the kernel has seen of names of so many bytes."""
        if length not in self._texts:
            self._texts[length] = Texts(length)
            self._indexes_of_texts[length] = np.empty(0, np.int32)
        return self._texts[length]

    def indexes_of_texts(self, length: int, numbers: NDArray[np.int32]) -> NDArray[np.int32]:
        """Return the indexes of names given by the numbers of their texts."""
        indexes = self._indexes_of_texts[length]
        new = [self.index_of_bytes(text) for text in self._texts[length].after(indexes.size)]
        if new:
            indexes = np.append(indexes, np.array(new, np.int32))
            self._indexes_of_texts[length] = indexes
        return indexes[numbers]

    def indexes(self, words: list[NDArray[np.uint64]], length: int) -> NDArray[np.int32]:
        """Return the indexes of names given by their bytes.

        Args:
            words: the bytes, eight of them in each array; the last word may overlap the one
                before, see `word_offsets`.
            length: bytes of a name.
        """
        if length not in self._tables:
            self._tables[length] = _Table(self, length)
        return self._tables[length].indexes(words)


def word_offsets(length: int) -> list[int]:
    """Return where to read the words that hold a name of so many bytes."""
    whole = list(range(0, length - _WORD + 1, _WORD))
    return whole if length % _WORD == 0 else [*whole, max(length - _WORD, 0)]


class _Table:
    """From the bytes of names of one length to their indexes."""

    def __init__(self, names: ThreadNames, length: int) -> None:
        self._names = names
        self._length = length
        self._hashes = np.empty(0, np.uint64)
        self._words: list[NDArray[np.uint64]] = [
            np.empty(0, np.uint64) for _ in word_offsets(length)
        ]
        self._indexes = np.empty(0, np.int32)

    def indexes(self, words: list[NDArray[np.uint64]]) -> NDArray[np.int32]:
        if self._length < _WORD:
            words = [words[0] & np.uint64((1 << (self._length * _WORD)) - 1)] if words else []
        if not words:
            raise ValueError("a thread name has no bytes")
        hashes = words[0]
        for word in words[1:]:
            hashes = hashes * _FACTOR ^ word
        if self._hashes.size == 0:
            self._learn(hashes, words)
        places = np.minimum(np.searchsorted(self._hashes, hashes), self._hashes.size - 1)
        known = self._hashes[places] == hashes
        if not known.all():
            self._learn(hashes[~known], [word[~known] for word in words])
            places = np.searchsorted(self._hashes, hashes)
        result = self._indexes[places]
        same = self._words[0][places] == words[0]
        for mine, word in zip(self._words[1:], words[1:], strict=True):
            same &= mine[places] == word
        for row in np.flatnonzero(~same).tolist():
            # Two names of one hash.
            result[row] = self._index([word[row] for word in words])
        return result

    def _learn(self, hashes: NDArray[np.uint64], words: list[NDArray[np.uint64]]) -> None:
        new, rows = np.unique(hashes, return_index=True)
        indexes = np.empty(rows.size, np.int32)
        # Numbered as they are first seen.
        for place in np.argsort(rows).tolist():
            indexes[place] = self._index([word[rows[place]] for word in words])
        all_hashes = np.concatenate([self._hashes, new])
        order = np.argsort(all_hashes)
        self._hashes = all_hashes[order]
        self._indexes = np.concatenate([self._indexes, indexes])[order]
        self._words = [
            np.concatenate([mine, word[rows]])[order]
            for mine, word in zip(self._words, words, strict=True)
        ]

    def _index(self, words: list[Any]) -> int:
        content = bytearray(max(self._length, _WORD))
        for offset, word in zip(word_offsets(self._length), words, strict=True):
            content[offset : offset + _WORD] = int(word).to_bytes(_WORD, "little")
        return self._names.index_of_bytes(bytes(content[: self._length]))
