"""Messages of a bag find the publications that they are of, or none."""

from __future__ import annotations

import os
import random
import shutil
import struct
import tempfile
from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import duckdb
import pyarrow as pa
import pytest
from support.thorough import few

from msgflow.bag.messages import read_bag
from msgflow.database import open_db
from msgflow.errors import DatabaseError, TraceError, UsageError

rosbag2 = pytest.importorskip("rosbags.rosbag2")
typesys = pytest.importorskip("rosbags.typesys")

STAMPED = "geometry_msgs/msg/PointStamped"
PLAIN = "std_msgs/msg/String"
SECOND = 1_000_000_000
PUBLISHED = """
SELECT b.publication_id, p.topic_name, coalesce(b.source_timestamp_ns, b.start_ns) AS sent_ns
FROM publication AS b
JOIN publisher AS p USING (publisher_id)
WHERE NOT p.is_internal
ORDER BY sent_ns, publication_id
"""
# Publication, topic, time of receipt; the number of the publication becomes the stamp.
Message = tuple[int, str, int]


def write_bag(path: Path, messages: Iterable[Message], *, plugin: str = "SQLITE3") -> Path:
    """Write a bag whose stamps name the publications; topics that begin with /plain have none."""
    store = typesys.get_typestore(typesys.Stores.LATEST)
    header, time, stamped, point, text = (
        store.types[name]
        for name in (
            "std_msgs/msg/Header", "builtin_interfaces/msg/Time", STAMPED,
            "geometry_msgs/msg/Point", PLAIN,
        )
    )  # fmt: skip
    with rosbag2.Writer(path, version=9, storage_plugin=rosbag2.StoragePlugin[plugin]) as writer:
        connections: dict[str, Any] = {}
        for publication, topic, received_ns in messages:
            is_plain = topic.startswith("/plain")
            kind = PLAIN if is_plain else STAMPED
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            message = (
                text(data="hello")
                if is_plain
                else stamped(
                    header=header(
                        stamp=time(sec=publication // SECOND, nanosec=publication % SECOND),
                        frame_id=f"frame{publication}",
                    ),
                    point=point(x=0.0, y=0.0, z=0.0),
                )
            )
            writer.write(connections[topic], received_ns, store.serialize_cdr(message, kind))
    return path


@pytest.fixture
def database(simulated: Callable[..., Path], tmp_path: Path) -> Path:
    return Path(shutil.copyfile(simulated("pipeline", 0.1), tmp_path / "run.duckdb"))


def published(path: Path) -> list[Message]:
    with duckdb.connect(str(path), read_only=True) as connection:
        return connection.execute(PUBLISHED).fetchall()


def stored(path: Path) -> list[dict[str, Any]]:
    with open_db(path) as opened:
        rows: list[dict[str, Any]] = (
            opened.sql("FROM bag_message ORDER BY publication_id", limit=None)
            .to_arrow()
            .to_pylist()
        )
    return rows


def join(path: Path, bag: Path) -> dict[str, Counter[str]]:
    with open_db(path) as opened:
        rows = opened.join_bag(bag).to_arrow().to_pylist()
    for row in rows:
        assert row["messages"] == sum(
            row[name] for name in ("joined", "ambiguous", "no_publication", "topic_not_published")
        )
    return {row["topic_name"]: Counter(row) for row in rows}


@pytest.mark.parametrize("plugin", few(["SQLITE3", "MCAP"], "MCAP"))
def test_messages_find_their_publications(database: Path, tmp_path: Path, plugin: str) -> None:
    jitter = random.Random(7)
    sent = published(database)
    received = [(one, topic, at + jitter.randrange(50_000)) for one, topic, at in sent]
    found = join(database, write_bag(tmp_path / "bag", received, plugin=plugin))
    assert sum(row["joined"] for row in found.values()) == len(sent)
    assert sum(row["published"] for row in found.values()) == len(sent)
    rows = stored(database)
    assert [row["publication_id"] for row in rows] == sorted(one for one, _, _ in sent)
    assert all(row["stamp_ns"] == row["publication_id"] for row in rows)
    assert all(row["frame_id"] == f"frame{row['publication_id']}" for row in rows)
    assert {row["type_name"] for row in rows} == {STAMPED}
    frame = len("frame1") + 1
    assert min(row["size_bytes"] for row in rows) >= 4 + 8 + 4 + frame + 24


def test_what_is_not_in_both_is_not_joined(database: Path, tmp_path: Path) -> None:
    sent = published(database)
    kept = [one for place, one in enumerate(sent) if place % 3]
    with duckdb.connect(str(database)) as connection:
        # The trace lost some of them, and the bag others.
        lost = [number for number, _, _ in kept[::5]]
        connection.execute(
            "DELETE FROM store.publication WHERE list_contains(?::BIGINT[], publication_id)", [lost]
        )
    others = [(1, "/elsewhere", sent[0][2]), (2, "/plain/elsewhere", sent[0][2])]
    received = [(number, topic, at + 20_000) for number, topic, at in kept]
    found = join(database, write_bag(tmp_path / "bag", [*received, *others]))
    assert found["/elsewhere"]["topic_not_published"] == 1
    assert found["/plain/elsewhere"]["topic_not_published"] == 1
    assert sum(row["no_publication"] for row in found.values()) == len(lost)
    rows = stored(database)
    assert len(rows) == len(kept) - len(lost)
    assert all(row["stamp_ns"] == row["publication_id"] for row in rows)


def test_what_may_be_several_is_not_joined(database: Path, tmp_path: Path) -> None:
    sent = published(database)
    (number, topic, at), *others = sent
    received = [(one, name, when + 20_000) for one, name, when in others]
    # Twice the same time, and a publication that has another one just before it.
    twice = [(number, topic, at + 10_000), (number, topic, at + 10_000)]
    near, near_topic, near_at = others[len(others) // 2]
    with duckdb.connect(str(database)) as connection:
        connection.execute(
            "INSERT INTO store.publication SELECT * REPLACE ("
            " (SELECT max(publication_id) + 1 FROM store.publication) AS publication_id,"
            " source_timestamp_ns - 1000 AS source_timestamp_ns, start_ns - 1000 AS start_ns)"
            " FROM store.publication WHERE publication_id = ?",
            [near],
        )
    found = join(database, write_bag(tmp_path / "bag", [*twice, *received]))
    assert sum(row["ambiguous"] for row in found.values()) == 3
    assert found[topic]["ambiguous"] >= 2
    rows = stored(database)
    assert {row["publication_id"] for row in rows} == {one for one, _, _ in others} - {near}
    assert all(row["stamp_ns"] == row["publication_id"] for row in rows)
    assert near_topic in found
    assert near_at


def test_a_bag_of_another_time_joins_nothing_and_replaces(database: Path, tmp_path: Path) -> None:
    sent = published(database)
    good = [(one, topic, at + 10_000) for one, topic, at in sent]
    join(database, write_bag(tmp_path / "good", good))
    assert len(stored(database)) == len(sent)
    later = [(one, topic, at + 3600 * SECOND) for one, topic, at in sent]
    found = join(database, write_bag(tmp_path / "late", later))
    assert sum(row["no_publication"] for row in found.values()) == len(sent)
    assert stored(database) == []
    assert join(database, write_bag(tmp_path / "empty", [])) == {}


def test_flows_have_the_size_and_age_of_the_message_at_their_end(
    database: Path, tmp_path: Path
) -> None:
    sent = published(database)
    with open_db(database) as opened:
        before = opened.query("flows").to_arrow().to_pylist()
    assert {row["size_bytes"] for row in before} == {None}
    join(database, write_bag(tmp_path / "bag", [(one, name, at + 9_000) for one, name, at in sent]))
    with open_db(database) as opened:
        flows = opened.query("flows", where="take_id IS NOT NULL").to_arrow().to_pylist()
        links = dict(
            opened.connection.execute(
                "SELECT take_id, publication_id FROM link_transport"
            ).fetchall()
        )
    assert flows
    for row in flows:
        assert row["age_from_stamp_ns"] == row["sink_ns"] - links[row["take_id"]]
        assert row["size_bytes"] > 40
    same = [{**row, "size_bytes": None, "age_from_stamp_ns": None} for row in flows]
    assert same == [row for row in before if row["take_id"] is not None]


@pytest.mark.thorough
def test_types_without_a_header_have_a_size(database: Path, tmp_path: Path) -> None:
    number, _, at = published(database)[0]
    with duckdb.connect(str(database)) as connection:
        connection.execute("UPDATE store.publisher SET topic_name = '/plain' || topic_name")
        connection.execute("UPDATE store.subscription SET topic_name = '/plain' || topic_name")
    ((_, topic, _), *_) = published(database)
    join(database, write_bag(tmp_path / "bag", [(number, topic, at + 9_000)]))
    (row,) = stored(database)
    assert (row["size_bytes"], row["stamp_ns"], row["frame_id"]) == (4 + 4 + 6, None, None)


def damaged(path: Path, sent: list[Message], how: str, plugin: str) -> Path:
    """Return a bag that something is wrong with."""
    bag = write_bag(path, [(one, topic, at) for one, topic, at in sent], plugin=plugin)
    (data,) = (file for file in bag.iterdir() if file.suffix in (".db3", ".mcap"))
    content = data.read_bytes()
    match how:
        case "cut":
            data.write_bytes(content[: len(content) // 2])
        case "zeros":
            middle = len(content) // 4
            data.write_bytes(content[:middle] + bytes(middle) + content[2 * middle :])
        case "empty":
            data.write_bytes(b"")
        case "no_data":
            data.unlink()
        case "no_metadata":
            (bag / "metadata.yaml").write_text("rosbag2_bagfile_information: 7\n")
    return bag


@pytest.mark.parametrize("plugin", few(["SQLITE3", "MCAP"], "MCAP"))
@pytest.mark.parametrize(
    "how", few(["cut", "zeros", "empty", "no_data", "no_metadata"], "cut", "no_metadata")
)
def test_a_damaged_bag_is_an_error_and_changes_nothing(
    database: Path, tmp_path: Path, how: str, plugin: str
) -> None:
    sent = published(database)
    join(
        database, write_bag(tmp_path / "good", [(one, name, at + 9_000) for one, name, at in sent])
    )
    before = stored(database)
    bag = damaged(tmp_path / "bad", sent, how, plugin)
    with pytest.raises(TraceError, match="cannot read as a bag"):
        join(database, bag)
    assert stored(database) == before


# Name of a topic, its type, the language of its definition, and that.
Channel = tuple[str, str, str, bytes]


def write_mcap(bag: Path, channels: Iterable[Channel], message: bytes, received_ns: int) -> Path:
    """Write a message of each topic, as `ros2 bag record` does."""
    writer = pytest.importorskip("mcap.writer").Writer(str(bag))
    writer.start(profile="ros2", library="test")
    for topic, kind, language, text in channels:
        schema = writer.register_schema(kind, language, text)
        channel = writer.register_channel(topic, "cdr", schema, {"offered_qos_profiles": ""})
        writer.add_message(channel, received_ns, message, received_ns)
    writer.finish()
    return bag


def test_a_topic_whose_definition_cannot_be_read_is_left_out(
    database: Path, tmp_path: Path
) -> None:
    """Of a service `ros2 bag record` writes the text of the service into MCAP."""
    publication, topic, sent_ns = published(database)[0]
    service = ("/reset/_service_event", "my_pkg/srv/Reset_Event")
    channels = [
        (*service, "ros2msg", b"bool hard\n---\nbool done\n"),
        (topic, PLAIN, "ros2msg", b"string data\n"),
    ]
    message = b"\0\1\0\0\2\0\0\0a\0"
    bag = write_mcap(tmp_path / "bag.mcap", channels, message, sent_ns + 9_000)
    with open_db(database) as opened:
        result = opened.join_bag(bag)
    (row,) = stored(database)
    assert (row["publication_id"], row["topic_name"], row["size_bytes"]) == (publication, topic, 10)
    (note,) = result.notes
    assert note.startswith(
        "/reset/_service_event is left out: the definition of my_pkg/srv/Reset_Event cannot be"
        " read: Could not parse: 'MSG: my_pkg"
    )


OF_IDL = [
    "struct Time { long sec; unsigned long nanosec; };",
    "struct Header { builtin_interfaces::msg::Time stamp; string frame_id; };",
    "struct Mine { std_msgs::msg::Header header; };",
]


def test_a_definition_in_idl_has_several_parts(tmp_path: Path) -> None:
    packages = ("builtin_interfaces", "std_msgs", "my_pkg")
    parts = [
        f"{'=' * 80}\nIDL: {package}/msg/X\nmodule {package} {{ module msg {{ {text} }}; }};\n"
        for package, text in zip(packages, OF_IDL, strict=True)
    ]
    channel = ("/mine", "my_pkg/msg/Mine", "ros2idl", "".join(reversed(parts)).encode())
    message = struct.pack("<4siII2s", b"\0\1\0\0", 3, 4, 2, b"a\0")
    with read_bag(write_mcap(tmp_path / "bag.mcap", [channel], message, SECOND)) as found:
        assert not found.schema.metadata
        (row,) = found.read_all().to_pylist()
    assert (row["stamp_ns"], row["frame_id"]) == (3 * SECOND + 4, "a")


@pytest.mark.parametrize("name", few(["metadata.yaml", "bag.mcap"], "bag.mcap"))
def test_a_pipe_is_refused(tmp_path: Path, name: str) -> None:
    os.mkfifo(tmp_path / name)
    for bag in (tmp_path, tmp_path / name):
        with pytest.raises(TraceError, match="a pipe, no file"), read_bag(bag):
            pass


def test_a_bag_reads_no_file_outside_of_its_folder(tmp_path: Path) -> None:
    """Whatever its metadata say of where its messages lie."""
    bag = write_bag(tmp_path / "bag", [(1, "/plain", SECOND)])
    (inside,) = bag.glob("*.db3")
    outside = inside.rename(tmp_path / inside.name)
    metadata = bag / "metadata.yaml"
    text = metadata.read_text()
    for path in (str(outside), f"../{outside.name}"):
        metadata.write_text(text.replace(outside.name, path))
        with pytest.raises(TraceError, match="cannot read as a bag"), read_bag(bag):
            pass


def test_a_file_that_unpacks_to_much_more_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before the disk has it; nothing of it stays."""
    monkeypatch.setenv("TMPDIR", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", None)
    bag = compressed(write_bag(tmp_path / "bag", [(1, "/topic", 2)]), bytes(10_000_000))
    monkeypatch.setenv("MSGFLOW_UNPACK_LIMIT", "9MB")
    with pytest.raises(TraceError, match="more than 9,000,000 bytes unpacked"), read_bag(bag):
        pass
    assert list((tmp_path / "temporary").iterdir()) == []
    monkeypatch.setenv("MSGFLOW_UNPACK_LIMIT", "11MB")
    with pytest.raises(TraceError, match="cannot read as a bag"), read_bag(bag):
        pass


def compressed(bag: Path, content: bytes) -> Path:
    """Return the bag with another content, compressed as a file."""
    (data,) = (file for file in bag.iterdir() if file.suffix in (".db3", ".mcap"))
    data.with_name(f"{data.name}.zstd").write_bytes(pa.compress(content, "zstd", asbytes=True))
    about = (bag / "metadata.yaml").read_text()
    for word, value in (("format", "zstd"), ("mode", "file")):
        about = about.replace(f"compression_{word}: ''", f"compression_{word}: {value}")
    about = about.replace(data.name, f"{data.name}.zstd")
    (bag / "metadata.yaml").write_text(about)
    data.unlink()
    return bag


def record(kind: int, *fields: bytes) -> bytes:
    return struct.pack("<BQ", kind, sum(map(len, fields))) + b"".join(fields)


def sized(text: bytes) -> bytes:
    return struct.pack("<I", len(text)) + text


def bomb(how: str) -> bytes:
    """Return an MCAP file of some kB whose one chunk has 768 MB unpacked.

    A reader finds it by the summary alone, whatever else stands where it lies.
    """
    packed = pa.compress(bytes(96 << 20), "lz4" if how == "lz4" else "zstd", asbytes=True) * 8
    if how == "skippable frame":
        packed = struct.pack("<II4x", 0x184D2A50, 4) + packed
    name = b"lz4" if how == "lz4" else b"zstd"
    content = struct.pack("<QQQI", 0, 1, 768 << 20, 0) + sized(name)
    chunk = record(6, content, struct.pack("<Q", len(packed)), packed)
    begin = b"\x89MCAP0\r\n" + record(1, sized(b"ros2"), sized(b"x"))
    if how == "attachment":
        begin += struct.pack("<BQ", 9, len(chunk))
    elif how == "damage before":
        begin += record(6, bytes(28), sized(b"zstd"), struct.pack("<Q", 4), b"\x28\xb5\x2f\xfd")
    schema = record(
        3, struct.pack("<H", 1), sized(PLAIN.encode()), sized(b"ros2msg"), sized(b"string data")
    )
    channel = record(4, struct.pack("<HH", 1, 1), sized(b"/plain"), sized(b"cdr"), sized(b""))
    end = len(begin) + len(chunk)
    index = record(
        8, struct.pack("<QQQQ", 0, 1, len(begin), len(chunk)), sized(struct.pack("<HQ", 1, end)),
        struct.pack("<Q", 31), sized(name), struct.pack("<QQ", len(packed), 768 << 20),
    )  # fmt: skip
    statistics = record(11, struct.pack("<QHIIIIQQ", 1, 1, 1, 0, 0, 1, 0, 1), sized(b""))
    footer = record(2, struct.pack("<QQI", end, 0, 0))
    return begin + chunk + schema + channel + index + statistics + footer + begin[:8]


HIDDEN = ["chunk", "lz4", "attachment", "skippable frame", "damage before", "file"]


@pytest.mark.parametrize("how", few(HIDDEN, "attachment", "file"))
def test_a_chunk_that_unpacks_to_much_more_is_refused(tmp_path: Path, how: str) -> None:
    """Wherever it lies, and whatever is said of its size."""
    bag = tmp_path / "bag.mcap"
    if how == "file":
        bag = compressed(write_bag(tmp_path / "bag", [(1, "/plain", 2)], plugin="MCAP"), bomb(how))
    else:
        bag.write_bytes(bomb(how))
    with (
        pytest.raises(TraceError, match=r"more memory unpacked than 50MB|Failed to resize buffer"),
        read_bag(bag, memory_limit="50MB"),
    ):
        pass


@pytest.mark.parametrize("plugin", few(["SQLITE3", "MCAP"], "MCAP"))
def test_messages_that_unpack_to_much_more_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, plugin: str
) -> None:
    store = typesys.get_typestore(typesys.Stores.LATEST)
    writer = rosbag2.Writer(
        tmp_path / "bag", version=9, storage_plugin=rosbag2.StoragePlugin[plugin]
    )
    writer.set_compression(rosbag2.CompressionMode.MESSAGE, rosbag2.CompressionFormat.ZSTD)
    with writer:
        topic = writer.add_connection("/zeros", PLAIN, typestore=store)
        for at in range(10):
            writer.write(topic, at, bytes(1_000_000))
    monkeypatch.setenv("MSGFLOW_UNPACK_LIMIT", "9MB")
    with (
        pytest.raises(TraceError, match="more than 9,000,000 bytes unpacked"),
        read_bag(tmp_path / "bag"),
    ):
        pass
    monkeypatch.setenv("MSGFLOW_UNPACK_LIMIT", "11MB")
    with read_bag(tmp_path / "bag") as found:
        assert found.read_all()["size_bytes"].to_pylist() == [1_000_000] * 10


def test_what_is_no_bag(database: Path, tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "file.mcap").write_text("no bag")
    (tmp_path / "old.bag").write_text("no bag")
    for name in ("folder", "file.mcap", "old.bag"):
        with pytest.raises(TraceError, match=f"cannot read as a bag.*{name}"):
            join(database, tmp_path / name)
    with pytest.raises(TraceError, match="no such bag"):
        join(database, tmp_path / "nowhere")


@pytest.fixture
def drifting(simulated: Callable[..., Path], tmp_path: Path) -> tuple[Path, Path]:
    """A database of hosts whose clocks differ, and a bag of what was published in it."""
    path = Path(shutil.copyfile(simulated("demo", 0.1), tmp_path / "run.duckdb"))
    sent = [(one, name, at + 9_000) for one, name, at in published(path)]
    return path, write_bag(tmp_path / "bag", sent)


def test_clocks_that_are_not_synchronised_are_refused(drifting: tuple[Path, Path]) -> None:
    path, bag = drifting
    with pytest.raises(UsageError, match="not synchronised"):
        join(path, bag)


@pytest.mark.thorough
def test_clocks_that_were_brought_together_are_joined(drifting: tuple[Path, Path]) -> None:
    path, bag = drifting
    sent = published(path)
    with open_db(path) as opened:
        opened.apply_clocks("messages")
    found = join(path, bag)
    rows = stored(path)
    assert len(rows) == sum(row["joined"] for row in found.values()) > len(sent) / 2
    assert all(row["stamp_ns"] == row["publication_id"] for row in rows)


def test_tables_of_another_version_are_refused(older_database: Path, tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", [(1, "/plain", SECOND)])
    with pytest.raises(DatabaseError, match="not as this msgflow makes it"):
        join(older_database, bag)
