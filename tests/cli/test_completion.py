"""Completion in the shell, asked for as shells ask: by variables of the environment."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path

import duckdb
import pytest
from support.hostile import HOSTILE, renamed
from support.thorough import few

from msgflow.db.known_names import known_names

PROGRAM = [
    sys.executable,
    "-c",
    "import sys; sys.argv = ['msgflow']; from msgflow.__main__ import main; main()",
]
EVIL = (
    "/plain",
    "/two words",
    "$(touch hacked)",
    "`touch hacked`",
    "'; touch hacked; '",
    '"/quoted"',
    "/line\nbreak",
    "\x1b[31m/red",
    "--help",
    "~root",
    "*",
    "/a\\b",
    "x;touch hacked",
    "",
    "/ünï",
    "/tab\tbed",
    "!!",
)
SAFE = {"/plain", "/two words", "/ünï"}


# Asks for one line after the other, in one process.
ASKING = """
import json, os, sys
from msgflow.__main__ import main
given, sys.argv = json.loads(sys.argv[1]), ["msgflow"]
for variables in given:
    os.environ.update(variables)
    try:
        main()
    except SystemExit:
        print("", end="\\0", flush=True)
"""


def ask(
    words: list[str], directory: Path, *, shell: str = "fish", database: Path | None = None
) -> list[str]:
    """Return the completions of the last of these words."""
    (answer,) = ask_each([words], directory, shell=shell, database=database)
    return answer


def ask_each(
    lines: list[list[str]], directory: Path, *, shell: str = "fish", database: Path | None = None
) -> list[list[str]]:
    """Return the completions of the last word of each line."""
    environment = {name: value for name, value in os.environ.items() if name != "MSGFLOW_DB"}
    environment |= {
        "_MSGFLOW_COMPLETE": f"complete_{shell}",
        "_TYPER_COMPLETE_FISH_ACTION": "get-args",
    }
    variables = [
        {"_TYPER_COMPLETE_ARGS": line, "COMP_WORDS": line, "COMP_CWORD": str(len(words))}
        for words in lines
        for line in [" ".join(("msgflow", *words))]
    ]
    if database is not None:
        environment["MSGFLOW_DB"] = str(database)
    program = [sys.executable, "-c", ASKING, json.dumps(variables)]
    done = subprocess.run(
        program, cwd=directory, env=environment, capture_output=True, text=True, check=False
    )
    assert done.stderr == ""
    *answers, rest = done.stdout.split("\0")
    assert not rest
    return [[line.partition("\t")[0] for line in answer.splitlines() if line] for answer in answers]


@pytest.fixture
def evil(small_database: Path, tmp_path: Path) -> Path:
    return renamed(small_database, tmp_path / "evil.duckdb", (*HOSTILE, *EVIL))


@pytest.fixture
def named(small_database: Path, tmp_path: Path) -> Path:
    """A database whose runs have the names above, one each."""
    path = tmp_path / "named.duckdb"
    shutil.copyfile(small_database, path)
    with duckdb.connect(str(path)) as connection:
        connection.execute("DELETE FROM store.run WHERE run_id <> 1")
        for number, name in enumerate(EVIL, start=10):
            connection.execute(
                "INSERT INTO store.run SELECT * REPLACE (? AS run_id, ? AS name) FROM store.run"
                " WHERE run_id = 1",
                [number, name],
            )
        connection.execute("DELETE FROM store.run WHERE run_id = 1")
    return path


@pytest.mark.parametrize("shell", few(["bash", "zsh", "fish"], "bash"))
def test_commands_and_queries(tmp_path: Path, shell: str) -> None:
    assert any("query" in line for line in ask(["qu"], tmp_path, shell=shell))
    lines = ask(["query", "e2"], tmp_path, shell=shell)
    assert len(lines) == 1
    assert "e2e-latency" in lines[0]


def test_names_of_the_database(small_database: Path, tmp_path: Path) -> None:
    with duckdb.connect(str(small_database), read_only=True) as connection:
        labels = {
            name for (name,) in connection.execute("SELECT label FROM callback_label").fetchall()
        }
        hosts = {name for (name,) in connection.execute("SELECT hostname FROM host").fetchall()}
    expected = {
        "query topics --measure rate --topic /ch": {"/chatter"},
        "query e2e-latency --node /ta": {"/talker"},
        "query callbacks --callback ": labels,
        "query waits --host ": hosts,
        "query e2e-latency --from /ta": {"/talker"},
        "query e2e-latency --via /chat": {"/chatter"},
        "query e2e-latency --run m": {"morning"},
        "query e2e-latency --run a": {"all"},
        "compare morning no": {"noon"},
        "runs rename no": {"noon"},
        "flow /ch": {"/chatter"},
        "export parquet -o out callback_l": {"callback_label"},
    }
    lines = [line.split(" ") for line in expected]
    answers = ask_each(lines, tmp_path, database=small_database)
    assert [*map(set, answers)] == [*expected.values()]
    assert all(len(answer) == len(set(answer)) for answer in answers)


@pytest.mark.thorough
def test_the_option_is_before_the_variable(small_database: Path, tmp_path: Path) -> None:
    words = ["query", "topics", "--db", str(small_database), "--run", "m"]
    assert ask(words, tmp_path, database=tmp_path / "none.duckdb") == ["morning"]
    assert small_database == tmp_path / "msgflow.duckdb"
    assert ask(["query", "topics", "--run", "m"], tmp_path) == ["morning"]


@pytest.mark.thorough
def test_names_of_paths(tmp_path: Path) -> None:
    words = ["query", "e2e-latency", "--path", "ca"]
    assert ask(words, tmp_path) == []
    text = "paths: [{name: camera, from: /a, to: /b}, {name: lidar, from: /c, to: /b}]"
    (tmp_path / "paths.yaml").write_text(text)
    assert ask(words, tmp_path) == ["camera"]
    (tmp_path / "other.yaml").write_text(text.replace("camera", "cat"))
    assert ask([*words[:2], "--paths", "other.yaml", *words[2:]], tmp_path) == ["cat"]
    (tmp_path / "paths.yaml").write_text("paths: [")
    assert ask(words, tmp_path) == []


@pytest.mark.parametrize(
    "what", few(["missing", "directory", "text", "foreign", "pipe"], "foreign")
)
def test_no_database_has_no_names(tmp_path: Path, what: str) -> None:
    path = tmp_path / "it"
    if what == "directory":
        path.mkdir()
    elif what == "text":
        path.write_text("no database" * 1000)
    elif what == "foreign":
        with duckdb.connect(str(path)) as connection:
            connection.execute("CREATE TABLE run AS SELECT 'x' AS name")
    elif what == "pipe":
        os.mkfifo(path)
    assert ask(["query", "topics", "--run", "x"], tmp_path, database=path) == []
    assert path.exists() == (what != "missing")


def test_a_database_in_use_has_no_names(small_database: Path, tmp_path: Path) -> None:
    copy = tmp_path / "copy.duckdb"
    shutil.copyfile(small_database, copy)
    with duckdb.connect(str(copy)):
        assert ask(["query", "topics", "--run", "m"], tmp_path, database=copy) == []


def test_nothing_keeps_the_database_open(
    small_database: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What still has it when Python ends makes DuckDB's binding write to stderr."""

    class OnABusyMachine(threading.Timer):
        def run(self) -> None:
            super().run()
            time.sleep(0.2)

    monkeypatch.setattr("msgflow.db.known_names.Timer", OnABusyMachine)
    assert known_names(small_database, "run", "")
    assert not [each for each in threading.enumerate() if isinstance(each, OnABusyMachine)]


def test_views_of_a_foreign_file_do_not_run_for_ever(tmp_path: Path) -> None:
    path = tmp_path / "foreign.duckdb"
    with duckdb.connect(str(path)) as connection:
        connection.execute("CREATE SCHEMA store")
        connection.execute("CREATE TABLE store.alembic_version AS SELECT '0001' AS version_num")
        connection.execute(
            "CREATE VIEW run AS SELECT sum(a.range * b.range)::VARCHAR AS name"
            " FROM range(10000000) AS a, range(10000000) AS b"
        )
    assert ask(["query", "topics", "--run", "1"], tmp_path, database=path) == []


def test_an_unknown_query_completes_nothing(small_database: Path, tmp_path: Path) -> None:
    words = ["query", "nothing", "--run", "m"]
    assert ask(words, tmp_path, database=small_database) == []


@pytest.mark.parametrize("shell", few(["bash", "zsh", "fish"], "bash"))
def test_hostile_names_are_left_out(named: Path, evil: Path, tmp_path: Path, shell: str) -> None:
    lines = ask(["runs", "rename", ""], tmp_path, shell=shell, database=named)
    expected = {
        "bash": ["/plain", "/two\\ words", "/ünï"],
        "zsh": ['_arguments \'*: :(("/plain"', '"/two words"', '"/ünï"))\''],
        "fish": ["/plain", "/two words", "/ünï"],
    }
    assert lines == expected[shell]
    asked = [["query", "e2e-latency", "--node", ""], ["flow", ""]]
    for answer in ask_each(asked, tmp_path, database=evil):
        for line in answer:
            assert not set(line) & set("'\"$`\\;|!*?\x1b\n\t")


@pytest.mark.thorough
@pytest.mark.parametrize("typed", few(["", "/tw", "/two\\ w"], "/tw"))
def test_bash_itself_has_words_that_are_names(named: Path, tmp_path: Path, typed: str) -> None:
    """The script that `--show-completion` prints, in a real bash."""
    from typer._completion_shared import get_completion_script

    script = get_completion_script(
        prog_name="msgflow", complete_var="_MSGFLOW_COMPLETE", shell="bash"
    )
    (tmp_path / "bin").mkdir()
    program = tmp_path / "bin" / "msgflow"
    program.write_text(f"#!{sys.executable}\nfrom msgflow.__main__ import main\nmain()\n")
    program.chmod(0o755)
    text = f"""{script}
COMP_WORDS=(msgflow runs rename '{typed}') COMP_CWORD=3
_msgflow_completion msgflow
eval "printf '%s\\n' ${{COMPREPLY[*]}}"
"""
    done = subprocess.run(
        ["bash", "--norc", "-c", text],
        cwd=tmp_path,
        env=os.environ
        | {"PATH": f"{program.parent}:{os.environ['PATH']}", "MSGFLOW_DB": named.name},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stderr == ""
    assert set(done.stdout.splitlines()) == (SAFE if not typed else {"/two words"})
    assert not (tmp_path / "hacked").exists()


@pytest.mark.thorough
def test_the_script_can_be_shown_and_installed(tmp_path: Path) -> None:
    # Typer does not look for the process of the shell then.
    environment = os.environ | {
        "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1",
        "HOME": str(tmp_path),
    }

    def run(*words: str) -> str:
        code = PROGRAM[2].replace("['msgflow']", str(["msgflow", *words]))
        return subprocess.run(
            [sys.executable, "-c", code],
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        ).stdout

    for shell in ("bash", "zsh", "fish"):
        assert f"_MSGFLOW_COMPLETE=complete_{shell}" in run("--show-completion", shell)
    run("--install-completion", "bash")
    assert "msgflow" in (tmp_path / ".bash_completions" / "msgflow.sh").read_text()
    assert "msgflow.sh" in (tmp_path / ".bashrc").read_text()


def test_completion_imports_no_more_than_it_needs(small_database: Path, tmp_path: Path) -> None:
    code = PROGRAM[2] + "\n"
    code = (
        "import atexit, sys\n"
        "atexit.register(lambda: print(*sorted(sys.modules), file=sys.stderr))\n" + code
    )
    environment = os.environ | {
        "_MSGFLOW_COMPLETE": "complete_bash",
        "COMP_WORDS": "msgflow query e2e-latency --topic /ch",
        "COMP_CWORD": "4",
        "MSGFLOW_DB": str(small_database),
    }
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["/chatter"]
    heavy = {
        "pyarrow",
        "numpy",
        "sqlalchemy",
        "alembic",
        "msgflow.query.runner",
        "msgflow.ingest",
        "msgflow.cli.ingest",
        "msgflow.db.connection",
    }
    assert heavy & set(done.stderr.split()) == set()
