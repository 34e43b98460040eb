"""What is typed becomes recordings, or a clear error before anything is done."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from support.object_store import KEYS, ObjectStore, object_store

from msgflow.errors import DatabaseError, UsageError
from msgflow.fleet.file_store import Store
from msgflow.fleet.sources import fetch, find_recordings, look_at, read_manifest

pytestmark = pytest.mark.skipif(not find_spec("moto"), reason="moto[server] is not installed")


@pytest.fixture(scope="module")
def bucket() -> Iterator[ObjectStore]:
    with pytest.MonkeyPatch.context() as patch, object_store(patch) as store:
        yield store


def manifest(folder: Path, text: str | bytes, name: str = "night.csv") -> str:
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return str(path)


def test_labels_are_texts_as_they_stand_there(tmp_path: Path) -> None:
    text = (
        "\ufeffpath,robot,note,version\r\n"
        'a,r1,"says ""hi"", twice\nand more",007\r\n'
        "s3://bucket/b,,'quoted',1.10\r\n"
        "\r\n"
        f'{tmp_path}/a,r1,"says ""hi"", twice\nand more",007\r\n'
    )
    # Equal rows count once.
    first, second = find_recordings([manifest(tmp_path, text)])
    assert first.source == str(tmp_path / "a")
    assert first.labels == {
        "robot": "r1",
        "note": 'says "hi", twice\nand more',
        "version": "007",
    }
    assert second.source == "s3://bucket/b"
    assert second.labels == {"note": "'quoted'", "version": "1.10"}


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("n.csv", "", "the manifest has no column path, its columns are none"),
        ("n.csv", "path,robot\n", "the manifest is empty"),
        ("n.csv", "robot,site\nr,s\n", "no column path, its columns are robot, site"),
        ("n.csv", "path,robot,robot\na,b,c\n", "two columns robot"),
        ("n.csv", "path,my robot\na,b\n", "no key of a label — 'my robot', a column of"),
        ("n.csv", "path,robot\na,b\n,c\n", "a row without a path, in line 3"),
        ("n.csv", "path,robot\na,b,c\n", "3 values for 2 columns, in line 2"),
        ("n.csv", "path,robot\na,b\n./a,c\n", "given twice, with different labels — .*/a"),
        ("n.csv", 'path,robot\na,"b\n', "cannot read the manifest: .*in line 2"),
        ("n.csv", b"path\n\xff\n", "not UTF-8"),
        ("n.csv", f"path,x\na,{'y' * 1001}\n", "no value of a label — x, in line 2"),
    ],
)
def test_what_is_no_manifest(tmp_path: Path, name: str, text: str | bytes, words: str) -> None:
    with pytest.raises(UsageError, match=words):
        find_recordings([manifest(tmp_path, text, name)])


def test_sources_are_paths_patterns_and_manifests(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("a1", "a2", "b", "c[1]"):
        (tmp_path / name).mkdir()
    monkeypatch.chdir(tmp_path)
    listed = manifest(tmp_path, "path,robot\na1,r1\n")
    found = find_recordings(["b", "c[1]", listed, "b", "a[2-9]"], {"site": "x", "robot": "any"})
    assert [(Path(r.source).name, r.labels["robot"]) for r in found] == [
        ("b", "any"),
        ("c[1]", "any"),
        ("a1", "r1"),
        ("a2", "any"),
    ]
    for sources, words in (
        (["z*"], r"nothing fits the pattern — z\*"),
        ([""], "the path of a recording is empty"),
        (["none.csv"], "no such manifest"),
        ([], "there is no recording"),
        (["a1", listed], "given twice, with different labels"),
        (["http://host/x"], "neither a folder nor a bucket"),
    ):
        with pytest.raises(UsageError, match=words):
            find_recordings(sources)


def test_buckets_have_recordings_too(bucket: ObjectStore, tmp_path: Path) -> None:
    for path in ("night/r1/ust/metadata", "night/r1/ust/0", "night/r2.tar.gz", "day/r1/metadata"):
        bucket.put(f"fleet/{path}", path.encode())
    bucket.put("fleet/lists/all.csv", b"path,robot\ns3://fleet/night/r1,r1\n../x,r2\n")
    found = find_recordings(["s3://fleet/*/r*"])
    assert [r.source for r in found] == [
        "s3://fleet/day/r1",
        "s3://fleet/night/r1",
        "s3://fleet/night/r2.tar.gz",
    ]
    listed = read_manifest("s3://fleet/lists/all.csv")
    assert [(r.source, r.labels) for r in listed] == [
        ("s3://fleet/night/r1", {"robot": "r1"}),
        ("s3://fleet/x", {"robot": "r2"}),
    ]
    before = look_at("s3://fleet/night/r1")
    assert (before.size, before.is_archive) == (len("night/r1/ust/metadatanight/r1/ust/0"), False)
    copy = fetch("s3://fleet/night/r1", tmp_path)
    assert {p.relative_to(copy).as_posix() for p in copy.rglob("*") if p.is_file()} == {
        "ust/metadata",
        "ust/0",
    }
    assert fetch("s3://fleet/night/r2.tar.gz", tmp_path).read_bytes() == b"night/r2.tar.gz"
    archive = look_at("s3://fleet/night/r2.tar.gz")
    assert (archive.is_archive, archive.size) == (True, len(b"night/r2.tar.gz"))
    assert look_at("s3://fleet/night/r1") == before
    bucket.put("fleet/night/r1/ust/1", b"more")
    assert look_at("s3://fleet/night/r1") != before


def test_a_store_that_is_not_there(bucket: ObjectStore, monkeypatch: pytest.MonkeyPatch) -> None:
    assert Store("s3://nobodys-bucket/lake").read("lake.json") is None
    with pytest.raises(DatabaseError, match="cannot write to the store") as raised:
        Store("s3://nobodys-bucket/lake").put("x", b"y")
    assert not any(secret in str(raised.value) for secret in KEYS.values() if "-1" not in secret)
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:9")
    monkeypatch.setattr("msgflow.fleet.file_store.MOST_ATTEMPTS", 1)
    with pytest.raises(DatabaseError, match="cannot read the store"):
        Store("s3://fleet/lake").read("lake.json")


def test_a_download_that_breaks_off_is_repeated_once(
    bucket: ObjectStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bucket.put("fleet/broken/off", b"all")
    store, reading, left = Store("s3://fleet/broken"), Store._reading, [1]

    def breaking(self: Store, path: str) -> Any:
        if left[0]:
            left[0] -= 1
            raise OSError("AWS Error INTERNAL_FAILURE during GetObject operation")
        return reading(self, path)

    monkeypatch.setattr(Store, "_reading", breaking)
    assert store.read("off") == b"all"
    left[0] = 1
    store.fetch("off", tmp_path / "off")
    assert (tmp_path / "off").read_bytes() == b"all"
    left[0] = 2
    with pytest.raises(DatabaseError, match="INTERNAL_FAILURE"):
        store.read("off")


@pytest.mark.thorough
def test_a_store_that_refuses_now_and_then(bucket: ObjectStore) -> None:
    bucket.refuse_every = 8
    refused = bucket.refused
    try:
        store = Store("s3://fleet/often")
        for number in range(5):
            store.put(f"{number}", b"x" * number)
        assert [(entry.path, entry.size) for entry in store.entries()] == [
            (str(number), number) for number in range(5)
        ]
        store.delete("0")
        assert store.read("0") is None
        assert store.read("4") == b"x" * 4
    finally:
        bucket.refuse_every = 0
    assert bucket.refused > refused
