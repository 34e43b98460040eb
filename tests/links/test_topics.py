"""Names that a file gives to topics without one: what can be asked then, and what is refused."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.each import each
from support.ingested import rows

from msgflow import Database
from msgflow.errors import UsageError
from msgflow.ingest.ingest import ingest
from msgflow.links.links_file import read_links
from msgflow_sim import Recording, simulate

LATE = Recording(start_ns=300_000_000)
TOPICS = "SELECT DISTINCT topic_name FROM {} WHERE NOT is_internal ORDER BY ALL"
UNNAMED = "SELECT detail FROM finding WHERE name = 'topic_unnamed' ORDER BY count DESC, detail"


@pytest.fixture(scope="module")
def trace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A pipeline that had started before its recording did: nothing has a name."""
    directory = tmp_path_factory.mktemp("late") / "trace"
    simulate("pipeline", directory, factor=0.2, recording=LATE)
    return directory


@pytest.fixture(scope="module")
def ingested(trace: Path) -> Path:
    path = trace.parent / "late.duckdb"
    ingest([trace], path)
    return path


@pytest.fixture
def database(ingested: Path, tmp_path: Path) -> Path:
    path = tmp_path / "copy.duckdb"
    path.write_bytes(ingested.read_bytes())
    return path


def entries(database: Path) -> list[str]:
    """The lines that the findings show, to be written below `topics:`."""
    return [detail.partition(": ")[2] for (detail,) in rows(database, UNNAMED)]


def file_of(database: Path, names: list[str]) -> Path:
    lines = [
        line.replace("/NAME", name) for line, name in zip(entries(database), names, strict=False)
    ]
    file = database.parent / "links.yaml"
    file.write_text("\n".join(["topics:", *(f"  {line}" for line in lines)]))
    return file


def test_a_named_topic_can_be_asked_for(database: Path) -> None:
    """The line that the finding shows names the topic for all that its messages join."""
    unnamed = len(entries(database))
    assert unnamed >= 2
    assert rows(database, TOPICS.format("publisher")) == [(None,)]
    with Database(database) as opened:
        with pytest.raises(UsageError, match="no such topic"):
            opened.query("topics", topic="/first")
        (applied,) = opened.apply_links(file_of(database, ["/first", "/second"]))
        assert (applied.topic_count, applied.annotation_count) == (2, 0)
        for topic in ("/first", "/second"):
            (paths,) = {
                row["path"].count(topic)
                for row in opened.query("e2e-latency", from_=topic).to_arrow().to_pylist()
            }
            assert paths == 1
    assert len(entries(database)) == unnamed - 2
    for topic in ("/first", "/second"):
        ends = rows(
            database,
            "SELECT publisher_count, subscription_count, "
            "publication_count > 20 AND take_count > 20 "
            f"FROM topic WHERE topic_name = '{topic}'",
        )
        assert ends == [(1, 1, True)]
    assert rows(
        database,
        "SELECT count(*) FROM link_transport AS l JOIN publication AS b USING (publication_id) "
        "JOIN publisher AS p ON b.publisher_id = p.publisher_id "
        "WHERE p.topic_name = '/first' AND l.method = 'exact'",
    ) == [(0,)], "the file and the stamp decide, not the trace"


@pytest.mark.thorough
def test_a_file_names_topics_while_ingesting(trace: Path, database: Path, tmp_path: Path) -> None:
    file = file_of(database, ["/first"])
    again = tmp_path / "again.duckdb"
    ingest([trace], again, links=file)
    assert ("/first",) in rows(again, TOPICS.format("publisher"))
    assert ("/first",) in rows(again, TOPICS.format("subscription"))
    assert rows(again, "SELECT count(*) FROM publisher WHERE is_topic_declared") == [(1,)]


@pytest.mark.thorough
def test_another_file_takes_the_names_back(database: Path) -> None:
    before = entries(database)
    with Database(database) as opened:
        (applied,) = opened.apply_links(file_of(database, ["/first"]))
        assert applied.topic_count == 1
        opened.apply_links(database, content="links: []")
    assert entries(database) == before
    assert rows(database, TOPICS.format("subscription")) == [(None,)]


def suggested(database: Path) -> str:
    with Database(database) as opened:
        return opened.suggest_links().text("msgflow links apply FILE")


@pytest.mark.thorough
def test_suggestions_keep_names_and_offer_the_others(database: Path) -> None:
    offered = [line.replace("- ", "# - ", 1) for line in entries(database)]
    text = suggested(database)
    assert [line.strip() for line in text.splitlines() if "/NAME" in line] == offered
    assert read_links(Path("none"), text).topics == ()
    assert "messages from [" in text
    with Database(database) as opened:
        opened.apply_links(file_of(database, ["/first"]))
    text = suggested(database)
    (topic,) = read_links(Path("none"), text).topics
    assert topic.name.value == "/first"
    with Database(database) as opened:
        opened.apply_links(database, content=text)
    assert ("/first",) in rows(database, TOPICS.format("publisher"))


@pytest.mark.thorough
def test_one_topic_has_one_name(database: Path) -> None:
    """A publisher and the subscription that takes its messages are on one topic."""
    (publisher, subscription) = rows(
        database,
        "SELECT DISTINCT coalesce(p.publisher_handle, p.rmw_handle), "
        "coalesce(s.subscription_handle, s.rmw_handle) FROM link_transport AS l "
        "JOIN publication AS b USING (publication_id) JOIN take AS t USING (take_id) "
        "JOIN publisher AS p ON b.publisher_id = p.publisher_id "
        "JOIN subscription AS s ON t.subscription_id = s.subscription_id ORDER BY ALL",
    )[0]
    text = (
        f"topics:\n- {{name: /a, publisher: 0x{publisher:x}}}\n"
        f"- {{name: /b, subscription: 0x{subscription:x}}}\n"
    )
    with Database(database) as opened:
        with pytest.raises(UsageError) as refused:
            opened.apply_links("links.yaml", content=text)
        assert "line 3: line 2 calls the same topic /a — /b" in refused.value.message
        assert rows(database, TOPICS.format("publisher")) == [(None,)]
        opened.apply_links("links.yaml", content=text.replace("/b", "/a"))
    assert ("/a",) in rows(database, TOPICS.format("publisher"))


WRONG = (
    ("- {name: /a, publisher: 0x1}", "no publisher without a topic has this handle — 0x1"),
    ("- {name: a, publisher: 0x1}", "a topic begins with / — a"),
    ("- {name: /a, publisher: filter}", "publisher is not a handle — filter"),
    ("- {name: /a}", "a topic has a publisher or a subscription — /a"),
    ("- {name: /a, publisher: 1, subscription: 1}", "a topic has a publisher or a subscription"),
    ("- {publisher: 0x1}", "a topic lacks name"),
)


@each(WRONG, name=lambda case: case[0])
def test_mistakes_have_their_line(case: tuple[str, str], ingested: Path) -> None:
    entry, message = case
    with Database(ingested) as opened, pytest.raises(UsageError) as refused:
        opened.apply_links("links.yaml", content=f"topics:\n{entry}")
    assert f"links.yaml, line 2: {message}" in refused.value.message


@pytest.mark.thorough
def test_a_handle_that_two_processes_have(database: Path) -> None:
    """The line that the finding shows says which; a name that messages tell cannot be changed."""
    import duckdb

    from msgflow.db.derivation import derive

    with duckdb.connect(str(database)) as con:
        con.execute("UPDATE store.publisher SET publisher_handle = 48, rmw_handle = NULL")
        derive(con, 1)
    with Database(database) as opened:
        with pytest.raises(UsageError, match=r"publishers have this handle — 0x30") as refused:
            opened.apply_links("x", content="topics:\n- {name: /a, publisher: 0x30}")
        assert "say which with process: and host:" in str(refused.value.hint)
        opened.apply_links(file_of(database, ["/a"]))
    assert rows(database, "SELECT count(*) FROM publisher WHERE topic_name = '/a'") == [(1,)]
    with duckdb.connect(str(database)) as con:
        con.execute(
            "UPDATE store.publisher SET is_topic_declared = false, is_inferred = false "
            "WHERE topic_name = '/a'"
        )
        handle = con.execute(
            "SELECT coalesce(subscription_handle, rmw_handle) FROM store.subscription "
            "WHERE topic_name = '/a'"
        ).fetchall()[0][0]
    with Database(database) as opened, pytest.raises(UsageError) as refused:
        opened.apply_links("x", content=f"topics:\n- {{name: /b, subscription: 0x{handle:x}}}")
    assert "messages show that this subscription is on /a — /b" in refused.value.message
