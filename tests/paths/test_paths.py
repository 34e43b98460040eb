"""Paths with names: their file, what refuses it, and suggestions that can be used as they are."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import duckdb
import pytest
from support.golden import fill_case

from msgflow.database import Database
from msgflow.errors import UsageError
from msgflow.paths.paths_file import read_paths
from msgflow.paths.suggested_paths import suggest_paths

RING = Path(__file__).parents[1] / "query/cases/critical-path/path_in_another_order.case"
GOOD = """\
paths:
  - name: motors
    from: /camera/image
    to: [/base/motors]
    via: [/planning/*, /control/cmd]
  - name: rest
    without: /planning/planner
"""


@pytest.fixture(scope="module")
def database(simulated: Callable[..., Path]) -> Iterator[Database]:
    with Database(simulated("demo", 0.1)) as opened:
        yield opened


@pytest.mark.thorough
def test_a_name_stands_for_a_path(database: Database, tmp_path: Path) -> None:
    file = tmp_path / "paths.yaml"
    file.write_text(GOOD, encoding="utf-8")
    by_name = database.query("e2e-latency", path="motors", paths=file).to_arrow()
    assert by_name.num_rows == 1
    assert (
        by_name
        == database.query(
            "e2e-latency",
            from_="/camera/image",
            to="/base/motors",
            via=["/planning/planner", "/control/cmd"],
        ).to_arrow()
    )
    rest = database.query("e2e-latency", path="rest", paths=file).to_arrow()
    assert rest == database.query("e2e-latency", without="/planning/planner").to_arrow()
    assert rest.num_rows == 2


def test_a_number_stands_for_a_path(database: Database) -> None:
    """It is the number in the tables of paths."""
    every = database.query("e2e-latency")
    path, number = list(every.path_numbers.items())[1]
    (row,) = database.query("e2e-latency", path=str(number)).to_arrow().to_pylist()
    assert row["path"] == path
    with pytest.raises(UsageError, match="no path has this number — 99") as raised:
        database.query("functions", path="99")
    assert raised.value.hint == f"msgflow query e2e-latency shows paths 1 to {len(every)}"


def test_the_number_tells_paths_over_the_same_places_apart(
    empty_database: Path, tmp_path: Path
) -> None:
    path = shutil.copyfile(empty_database, tmp_path / "ring.duckdb")
    with duckdb.connect(str(path)) as connection:
        fill_case(connection, RING)
    with Database(path) as ring:
        every = ring.query("e2e-latency").path_numbers
        assert list(every) == ["/a → /x → /b → /y → /a", "/b → /y → /a → /x → /b"]
        for name in ("e2e-latency", "critical-path", "path-breakdown"):
            found = {
                number: set(
                    ring.query(name, path=str(number)).table["path"].drop_null().to_pylist()
                )
                for number in every.values()
            }
            assert found == {number: {text} for text, number in every.items()}


def test_what_has_no_paths_says_so_in_the_words_of_the_user(
    database: Database, tmp_path: Path
) -> None:
    """Between two ends, a path of all paths is no row; one that names its ends only, is."""
    for path in ("info-nodes", "e2e-latency-ends"):
        with pytest.raises(UsageError, match="has no paths — --path 2\n"):
            database.query(path, path="2")
    (file := tmp_path / "paths.yaml").write_text("paths:\n  - {name: a, from: /camera/image}\n")
    (row,) = database.query("e2e-latency", by="ends", path="a", paths=file).table.to_pylist()
    assert row["first_topic"] == "/camera/image"


@pytest.mark.parametrize(
    ("text", "message", "hint"),
    [
        ("", "line 1: the file is empty", "paths: ["),
        ("paths: 3\n", "line 1: paths is not a list", "paths: ["),
        ("path: []\n", "line 1: the file has no path", "it has paths"),
        ("paths:\n  - from: /a\n", "line 2: a path lacks name", "paths: ["),
        ("paths:\n  - name: a\n", "line 2: nothing says which path it is — a", "paths: ["),
        ("paths:\n  - {name: '3', from: /a}\n", "line 2: a number is that of a path", "paths: ["),
        ("paths:\n  - {name: a, form: /a}\n", "line 2: a path has no form", "it has name, from"),
        ("paths:\n  - {name: a, from: /a, from: /b}\n", "line 2: from is given twice", None),
        ("paths:\n  - {name: a, from: '/a,/b'}\n", "line 2: several names are a list", "[/a, /b]"),
        ("paths:\n  - {name: a, via: []}\n", "line 2: via is empty", "paths: ["),
        ("paths:\n  - name: a\n    via: *x\n", "line 3: ", "quote patterns"),
        (
            GOOD + "  - name: motors\n    to: /a\n",
            "line 8: line 2 has this name, too — motors",
            None,
        ),
    ],
)
def test_mistakes_are_named_with_their_line(
    tmp_path: Path, text: str, message: str, hint: str | None
) -> None:
    file = tmp_path / "paths.yaml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(UsageError) as raised:
        read_paths(file)
    assert f"{file}, {message}" in raised.value.message
    assert (hint or "") in (raised.value.hint or "")


@pytest.mark.parametrize(
    ("text", "name", "message", "hint"),
    [
        (GOOD, "motor", "has no path of this name — motor", "did you mean motors"),
        (GOOD, "x\x1b[31m", "has no path of this name", "it has motors, rest"),
        ("paths: []\n", "a", "has no path of this name — a", "msgflow suggest paths"),
        (
            GOOD.replace("/control/cmd", "/control/cmds"),
            "motors",
            "line 5: there is no such topic or node in the run — /control/cmds",
            "did you mean /control/cmd",
        ),
        (GOOD.replace("/planning/*", "/x*"), "motors", "line 5: no topic or node in the run", None),
    ],
)
def test_names_that_are_not_there(
    database: Database, tmp_path: Path, text: str, name: str, message: str, hint: str | None
) -> None:
    file = tmp_path / "paths.yaml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(UsageError) as raised:
        database.query("e2e-latency", path=name, paths=file)
    assert message in raised.value.message
    assert (hint or "") in (raised.value.hint or "")


def test_a_name_goes_without_other_words(database: Database, tmp_path: Path) -> None:
    file = tmp_path / "paths.yaml"
    file.write_text(GOOD, encoding="utf-8")
    with pytest.raises(UsageError, match="--path says where flows begin and end — motors"):
        database.query("e2e-latency", path="motors", paths=file, from_="/camera/image")
    with pytest.raises(UsageError, match="info --section nodes has no paths — --path motors"):
        database.query("info-nodes", path="motors", paths=file)
    with pytest.raises(UsageError, match="cannot read the file"):
        database.query("e2e-latency", path="motors", paths=tmp_path / "none.yaml")


def test_suggestions_name_every_path_and_nothing_else(database: Database, tmp_path: Path) -> None:
    file = tmp_path / "paths.yaml"
    rows = database.query("e2e-latency").to_arrow().to_pylist()
    file.write_text(suggest_paths(rows), encoding="utf-8")
    named = [path.name.value for path in read_paths(file).paths]
    assert "camera-image-to-base-motors" in named
    for row, name in zip(rows, named, strict=True):
        found = database.query("e2e-latency", path=name, paths=file).to_arrow().to_pylist()
        assert [one["path"] for one in found] == [row["path"]]


def test_suggestions_tell_paths_apart_that_begin_and_end_alike(tmp_path: Path) -> None:
    counts = {"roots": 2, "reached": 1, "p99_ns": None}
    rows = [
        {"path": "/a → /t → /b → /u → /d", **counts},
        {"path": "/a → /t → /c → /v → /d", **counts},
        {"path": '/"x\n → /nul → /d', **counts},
    ]
    file = tmp_path / "paths.yaml"
    file.write_text(suggest_paths(rows), encoding="utf-8")
    paths = read_paths(file).paths
    assert [path.name.value for path in paths] == ["t-to-d", "t-to-d-2", "nul-to-d"]
    assert paths[0].words() == {
        "from": ["/t"],
        "to": ["/d"],
        "via": ["/b", "/u"],
        "without": ["/c", "/v"],
    }
    assert read_paths(file).paths[2].words() == {"from": ["/nul"], "to": ["/d"]}
    file.write_text(suggest_paths([]), encoding="utf-8")
    assert read_paths(file).paths == ()


def test_suggestions_are_no_wider_than_a_narrow_terminal(tmp_path: Path) -> None:
    counts = {"roots": 2, "reached": 1, "p99_ns": 5}
    begin, end = "/start → /image → ", " → /end"
    ways = [
        " → ".join(f"/perception/{way}_{n} → /perception/{way}_topic_{n}" for n in range(9))
        for way in ("node", "other")
    ]
    text = suggest_paths([{"path": begin + way + end, **counts} for way in ways])
    assert max(map(len, text.splitlines())) <= 80
    assert text.count("→") == 2 * 20
    file = tmp_path / "paths.yaml"
    file.write_text(text, encoding="utf-8")
    words = read_paths(file).paths[0].words()
    assert len(words["via"]) == len(words["without"]) == 18
