"""A bucket that refuses now and then is asked again; where that is hopeless, it is said at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from pyarrow.fs import FileInfo, FileType

from msgflow.errors import DatabaseError
from msgflow.fleet import file_store as store_module
from msgflow.fleet.file_store import Store

LOOKS: list[Callable[[Store], Any]] = [Store.entries, Store.folders, Store.entry]


class Refusing:
    """A file system that refuses the first questions."""

    def __init__(self, times: int, words: str) -> None:
        self.times = times
        self.words = words
        self.asked = 0

    def get_file_info(self, asked: Any) -> Any:
        self.asked += 1
        if self.asked <= self.times:
            raise OSError(self.words)
        return FileInfo("bucket", FileType.NotFound) if isinstance(asked, str) else []


def refusing(monkeypatch: pytest.MonkeyPatch, times: int, words: str) -> tuple[Store, Refusing]:
    monkeypatch.setattr(store_module, "PAUSES", (0, 0, 0, 0))
    store, system = Store("s3://bucket/recordings"), Refusing(times, words)
    monkeypatch.setattr(Store, "filesystem", system)
    return store, system


@pytest.mark.parametrize("look", LOOKS)
def test_who_looks_is_patient(look: Callable[[Store], Any], monkeypatch: Any) -> None:
    slow = "AWS Error SLOW_DOWN during HeadObject operation (HTTP status 503)"
    store, system = refusing(monkeypatch, 4, slow)
    assert not look(store)
    assert system.asked == 5
    store, _ = refusing(monkeypatch, 5, slow)
    with pytest.raises(DatabaseError, match="cannot read the store"):
        look(store)


@pytest.mark.parametrize(
    "words",
    [
        "AWS Error NETWORK_CONNECTION during HeadObject operation: curlCode: 7",
        "AWS Error ACCESS_DENIED during ListObjectsV2 operation: no",
        "AWS Error NO_SUCH_BUCKET during ListObjectsV2 operation: no",
        "AWS Error RESOURCE_NOT_FOUND during ListObjectsV2 operation: no",
        "AWS Error INVALID_ACCESS_KEY_ID during ListObjectsV2 operation: no",
        "AWS Error SIGNATURE_DOES_NOT_MATCH during ListObjectsV2 operation: no",
        "AWS Error UNKNOWN (HTTP status 400) during HeadObject operation: No response body.",
        "AWS Error UNKNOWN (HTTP status 401) during HeadObject operation: No response body.",
        "AWS Error UNKNOWN (HTTP status 404) during HeadObject operation: No response body.",
        "AWS Error UNKNOWN (HTTP status 403) during HeadObject operation: No response body.",
    ],
)
def test_who_looks_in_vain_is_told_at_once(words: str, monkeypatch: Any) -> None:
    store, system = refusing(monkeypatch, 1, words)
    with pytest.raises(DatabaseError, match="cannot read the store"):
        store.entries()
    assert system.asked == 1
