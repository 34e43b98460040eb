"""Reading with the compiled kernel and without."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from msgflow import kernel

needs_kernel = pytest.mark.skipif(
    kernel.library() is None, reason="msgflow was installed without a C compiler: no kernel"
)


@contextmanager
def without_kernel() -> Iterator[None]:
    """Leave the kernel out."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kernel, "library", lambda: None)
        yield
