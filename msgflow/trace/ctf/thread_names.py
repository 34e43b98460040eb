"""Thread names: a dictionary shared by all batches, as every event repeats one of few names."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from msgflow.trace.numpy_arrow import integers_to_arrow, texts_to_arrow, to_arrow, to_numpy

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray


class ThreadNames:
    """All names seen so far."""

    def __init__(self) -> None:
        self._index_of_name: dict[str, int] = {}
        self._dictionary = texts_to_arrow([])

    def array_of(self, names: Iterable[str | None]) -> pa.Array:
        """Return an array of names given one by one."""
        indexes = [None if name is None else self._index_of(name) for name in names]
        return self._array(integers_to_arrow(indexes, pa.int32()))

    def array_of_bytes(self, content: NDArray[Any]) -> pa.Array:
        """Return an array of names that end at their first NUL.

        `content` has the bytes of each name as one item of numpy's type `V`.
        """
        size, count = content.dtype.itemsize, content.size
        buffer = pa.py_buffer(np.ascontiguousarray(content))
        encoded = pa.Array.from_buffers(pa.binary(size), count, [None, buffer]).dictionary_encode()
        indexes = [
            self._index_of(name.partition(b"\0")[0].decode("utf-8", "replace"))
            for name in encoded.dictionary.to_pylist()
        ]
        return self._array(to_arrow(np.array(indexes, np.int32)[to_numpy(encoded.indices)]))

    def _index_of(self, name: str) -> int:
        return self._index_of_name.setdefault(name, len(self._index_of_name))

    def _array(self, indexes: pa.Array) -> pa.Array:
        if len(self._dictionary) < len(self._index_of_name):
            self._dictionary = texts_to_arrow(list(self._index_of_name))
        return pa.DictionaryArray.from_arrays(indexes, self._dictionary)
