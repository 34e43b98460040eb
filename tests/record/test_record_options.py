"""Every option of `msgflow record` with the real LTTng, whose daemon has sessions of others.

The daemon has a mount namespace of its own: it may die.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
import typer

from msgflow.cli.app import app

# A daemon, two sessions of others, what is to be tested, and what is there afterwards.
IN_NAMESPACE = """
mount -t tmpfs tmpfs /run/lttng || exit 99
lttng-sessiond --no-kernel --daemonize 2> /dev/null
{
    lttng create other --output=$PWD/other && lttng enable-event -u -s other 'ros2:*'
    lttng start other
    lttng create kept --snapshot --output=$PWD/kept && lttng enable-event -u -s kept 'ros2:*'
    lttng start kept
} > /dev/null
"$@"
code=$?
lttng --no-sessiond list > sessions
kill "$(cat /run/lttng/lttng-sessiond.pid)"
exit $code
"""
IN_OTHERS = ("unshare", "--mount", "--propagation", "private", "sh", "-c", IN_NAMESPACE, "sh")
WAIT = "rclcpp_executor_wait_for_work"


def events(name: str, folder: str = "drive") -> Callable[[Path, str], bool]:
    """Whether LTTng knows an event of the recording: it does from the first process on."""
    return lambda here, out: any(
        f'"ros2:{name}"' in path.read_text("utf-8", "replace")
        for path in (here / folder / "ust").rglob("metadata")
    )


def without(name: str) -> Callable[[Path, str], bool]:
    return lambda here, out: not events(name)(here, out) and events("rcl_publish")(here, out)


def there(name: str) -> Callable[[Path, str], bool]:
    return lambda here, out: (here / name).exists()


# What has to be so afterwards, by the words of the option.
OPTIONS: dict[tuple[str, ...], Callable[[Path, str], bool]] = {
    ("--output", "place"): events("callback_start", "place"),
    ("--name", "name"): there("name/ust"),
    ("--duration", "5"): events("callback_start"),
    ("--kernel",): events("callback_start"),
    ("--profile", "99"): there("drive/perf.script"),
    ("--dual", "kept"): there("drive/snapshot"),
    ("--events", "my_pkg:*"): events("callback_start"),
    ("--without", WAIT): without(WAIT),
    ("--without", f"{WAIT},callback_*"): without("callback_start"),
    ("--no-python",): events("rcl_publish"),
    ("--no-cpu-time",): lambda here, out: not (here / "drive" / "cpu").exists(),
    ("--print-python-path",): lambda here, out: out.strip().endswith("python_nodes"),
    ("--subbuf-size", "64K"): events("callback_start"),
    ("--num-subbuf", "2"): events("callback_start"),
    ("--links", "links.yaml"): lambda here, out: "/camera → /image" in out,
    ("--clock-sync", "messages"): lambda here, out: "/camera → /image" in out,
    ("--db", "there.duckdb"): there("there.duckdb"),
    ("--no-ingest",): lambda here, out: not (here / "msgflow.duckdb").exists(),
}


def test_every_option_is_here() -> None:
    (command,) = (
        one for name, one in typer.main.get_command(app).commands.items() if name == "record"
    )
    known = {word for words in OPTIONS for word in words[:1]}
    for option in command.params:
        names = {*option.opts, *option.secondary_opts}
        assert option.name in ("program", "help") or names & known, names


def run_beside_others(tmp_path: Path, *words: str) -> subprocess.CompletedProcess[str]:
    ended = subprocess.run(
        [*IN_OTHERS, *words], cwd=tmp_path, capture_output=True, text=True, timeout=120
    )
    if ended.returncode == 99 or "unshare" in ended.stderr:
        pytest.skip("no mount namespace")
    return ended


@pytest.mark.thorough
@pytest.mark.parametrize("words", OPTIONS, ids=" ".join)
def test_an_option_leaves_sessions_of_others(
    tmp_path: Path, robot: list[str], words: tuple[str, ...]
) -> None:
    (tmp_path / "links.yaml").write_text("links: []")
    named = {*words} & {"--output", "--name"}
    ingests = {*words} & {"--links", "--clock-sync", "--db"}
    ended = run_beside_others(
        tmp_path,
        *(sys.executable, "-m", "msgflow", "record", *words),
        *(() if named else ("--output", "drive")),
        *(() if ingests else ("--no-ingest",)),
        *(() if "--duration" in words else ("--duration", "8" if ingests else "4")),
        *("--", *robot, "0.05"),
    )
    assert ended.returncode == 0, ended.stderr
    assert OPTIONS[words](tmp_path, ended.stdout), ended
    assert "destroyed" not in ended.stderr
    left = (tmp_path / "sessions").read_text()
    assert "other [active]" in left
    assert "kept [active snapshot]" in left
    assert left.count("[") == 2


@pytest.mark.thorough
def test_a_daemon_that_ends_is_told(tmp_path: Path) -> None:
    script = """
        (until lttng --no-sessiond list | grep -q drive; do sleep 0.1; done
        sleep 3
        kill -SEGV "$(cat /run/lttng/lttng-sessiond.pid)") &
        exec "$@"
    """
    ended = run_beside_others(
        tmp_path,
        *("sh", "-c", script, "sh", sys.executable, "-m", "msgflow", "record"),
        *("--no-ingest", "--name", "drive", "--duration", "30"),
    )
    assert ended.returncode == 3, ended.stderr
    assert "the session daemon of LTTng ended: the recording ends here" in ended.stderr
    assert "destroyed" not in ended.stderr
