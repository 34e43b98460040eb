"""`msgflow record --on`: another machine by ssh, containers by what stands for docker and podman.

A machine is a namespace of its own: it has the session daemon, the directory of temporary files and
the name of a machine. Its processes are of this one, so that nodes find each other.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from support.lttng_program import Record, free_port

from msgflow.database import Database
from msgflow.errors import UsageError
from msgflow.record.remote import read_places

SSHD = Path("/usr/sbin/sshd")
# A node here, one there, and messages both ways: they end when a hundred have come.
NODE = """
import sys
import rclpy
from rclpy.node import Node
from std_msgs.msg import UInt64

rclpy.init()
node = Node(sys.argv[1])
if sys.argv[1] == "camera":
    image = node.create_publisher(UInt64, "/image", 10)
    node.create_timer(0.05, lambda: image.publish(UInt64()))
    come = []
    node.create_subscription(UInt64, "/objects", come.append, 10)
else:
    objects = node.create_publisher(UInt64, "/objects", 10)
    node.create_subscription(UInt64, "/image", objects.publish, 10)
try:
    while sys.argv[1] != "camera" or len(come) < 100:
        rclpy.spin_once(node)
except BaseException:
    pass
"""


@dataclass
class Machine:
    """A namespace that stands for a machine."""

    pid: int

    def words(self, *command: str) -> list[str]:
        """Return what runs a command there."""
        return ["nsenter", f"--target={self.pid}", "--mount", "--uts", *command]

    def sessions(self) -> str:
        """Return what LTTng says there."""
        asked = self.words("lttng", "--no-sessiond", "list")
        return subprocess.run(asked, capture_output=True, text=True).stdout

    def processes(self) -> list[str]:
        """Return the programs that run there, but what keeps the namespace."""
        mine = os.readlink(f"/proc/{self.pid}/ns/mnt")
        found = []
        for entry in Path("/proc").glob("[0-9]*"):
            try:
                if os.readlink(entry / "ns" / "mnt") == mine:
                    found.append((entry / "comm").read_text().strip())
            except OSError:
                continue
        return [name for name in found if name not in ("sleep", "sshd")]

    def is_clean(self) -> bool:
        """Tell whether nothing of a recording is left; what ends has some seconds for it."""
        end = time.monotonic() + 20
        while self.processes() and time.monotonic() < end:
            time.sleep(0.1)
        left = subprocess.run(self.words("ls", "/tmp"), capture_output=True, text=True).stdout
        return not self.processes() and "msgflow" not in left


@pytest.fixture
def machine(tmp_path: Path) -> Iterator[Machine]:
    """A machine with the name `arm`."""
    if os.geteuid() or shutil.which("unshare") is None or not tmp_path.is_relative_to("/tmp"):
        pytest.skip("namespaces need root")
    # Of the temporary files it sees those of this test.
    script = (
        "mount -t tmpfs -o size=300M tmpfs /run/lttng && mount -t tmpfs -o size=300M tmpfs /mnt"
        f" && mkdir -p /mnt{tmp_path} && mount --bind {tmp_path} /mnt{tmp_path}"
        " && mount --rbind /mnt/tmp /tmp && hostname arm && echo ready && exec sleep 1000"
    )
    Path("/run/lttng").mkdir(exist_ok=True)
    command = ["unshare", "--mount", "--uts", "--propagation=private", "sh", "-c", script]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    if process.stdout.readline() != "ready\n":
        pytest.skip("namespaces are not allowed")
    yield Machine(process.pid)
    process.kill()
    process.wait()


@pytest.fixture
def container(machine: Machine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Machine:
    """A machine that docker, which is installed, and podman know as the container `arm`."""
    programs = tmp_path / "programs"
    programs.mkdir()
    inside = shlex.join(machine.words())
    for name in ("docker", "podman"):
        (programs / name).write_text(
            "#!/bin/sh\n"
            f'if [ "$1 $2" = "container inspect" ]; then [ "$3" = arm ]; exit; fi\n'
            f'[ "$1 $2 $3" = "exec --interactive arm" ] || exit 2\nshift 3\nexec {inside} "$@"\n'
        )
        (programs / name).chmod(0o755)
    monkeypatch.setenv("PATH", str(programs), prepend=":")
    return machine


@pytest.fixture
def by_ssh(machine: Machine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Machine:
    """A machine that ssh knows as `arm`, with keys of its own."""
    if not SSHD.exists():
        pytest.skip("no sshd")
    port = free_port()
    for name in ("host", "user", "stranger"):
        key = ["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", str(tmp_path / name)]
        subprocess.run(key, check=True)
    (tmp_path / "authorized").write_text((tmp_path / "user.pub").read_text())
    (tmp_path / "sshd_config").write_text(
        f"Port {port}\nListenAddress 127.0.0.1\nHostKey {tmp_path}/host\nStrictModes no\n"
        f"AuthorizedKeysFile {tmp_path}/authorized\nPermitRootLogin yes\nUsePAM no\n"
        f"PidFile none\n"
    )
    for name, key in (("arm", "user"), ("locked", "stranger")):
        with (tmp_path / "ssh_config").open("a") as file:
            file.write(
                f"Host {name}\nHostName 127.0.0.1\nPort {port}\nIdentityFile {tmp_path}/{key}\n"
                "IdentitiesOnly yes\nStrictHostKeyChecking no\nUserKnownHostsFile /dev/null\n"
            )
    Path("/run/sshd").mkdir(exist_ok=True)
    server = [*machine.words(), str(SSHD), "-D", "-f", str(tmp_path / "sshd_config")]
    process = subprocess.Popen(server, stderr=subprocess.DEVNULL)
    programs = tmp_path / "programs"
    programs.mkdir()
    # It reads the configuration of the user whom the system knows, not that of $HOME.
    ssh = shutil.which("ssh")
    (programs / "ssh").write_text(f'#!/bin/sh\nexec {ssh} -F {tmp_path}/ssh_config "$@"\n')
    (programs / "ssh").chmod(0o755)
    monkeypatch.setenv("PATH", str(programs), prepend=":")
    end = time.monotonic() + 10
    while (
        time.monotonic() < end
        and subprocess.run(["ssh", "arm", "true"], capture_output=True).returncode
    ):
        time.sleep(0.1)
    yield machine
    process.terminate()
    process.wait()


@pytest.fixture
def two_nodes(machine: Machine, robot: list[str], tmp_path: Path) -> list[str]:
    """A command that starts a node here, and another one on the machine."""
    *python, _, _ = robot
    start = [*python, "-c", NODE]
    (tmp_path / "robot.sh").write_text(
        f"{shlex.join([*start, 'detector'])} &\n"
        f"exec {shlex.join(machine.words(*start, 'camera'))}\n"
    )
    return ["sh", str(tmp_path / "robot.sh")]


def test_a_container_and_this_machine_are_one_recording(
    record: Record, container: Machine, two_nodes: list[str], tmp_path: Path
) -> None:
    words = ("--name", "drive", "--on", "container:arm", "--", *two_nodes)
    ended = record(*words)
    assert ended.exit_code == 0, ended.err
    assert "/camera → /image → /detector → /objects → /camera" in ended.out
    with Database(tmp_path / "msgflow.duckdb") as database:
        # One clock: a container of this machine needs no messages for it.
        hosts = database.sql(
            "SELECT h.hostname, c.clock_id, n.name AS node"
            " FROM host AS h JOIN clock AS c USING (clock_id) JOIN process AS p USING (host_id)"
            " JOIN node AS n USING (process_id) ORDER BY n.name"
        )
        rows = hosts.to_arrow().to_pylist()
        assert [row["node"] for row in rows] == ["camera", "detector"]
        assert rows[0]["hostname"] == "arm" != rows[1]["hostname"]
        assert rows[0]["clock_id"] == rows[1]["clock_id"]
        lost = database.sql(
            "SELECT count(*) FILTER (WHERE NOT is_linked) AS alone, count(*) AS n FROM ("
            "SELECT l.take_id IS NOT NULL AS is_linked FROM take AS t LEFT JOIN link_transport AS l"
            " USING (take_id))"
        )
        (counted,) = lost.to_arrow().to_pylist()
        assert counted["n"] > 190
        assert counted["alone"] <= 2
    assert container.is_clean()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_no_session_stays_there(container: Machine, tmp_path: Path, number: signal.Signals) -> None:
    words = ("--no-ingest", "--name", "drive", "--on", "container:arm", "--no-cpu-time")
    process = subprocess.Popen(
        [sys.executable, "-m", "msgflow", "record", *words],
        cwd=tmp_path,
        stderr=subprocess.PIPE,
    )
    end = time.monotonic() + 30
    while "drive" not in container.sessions() and time.monotonic() < end:
        time.sleep(0.1)
    assert "drive" in container.sessions()
    time.sleep(1)
    process.send_signal(number)
    process.communicate(timeout=60)
    assert container.is_clean()
    # No process ran there: what came has no event, and goes again.
    is_fetched = (tmp_path / "drive" / "hosts").is_dir()
    assert is_fetched == (number == signal.SIGINT)


def test_clocks_that_are_apart_come_together(
    record: Record, by_ssh: Machine, two_nodes: list[str], tmp_path: Path
) -> None:
    words = ("--no-ingest", "--name", "drive", "--on", "arm", "--", *two_nodes)
    ended = record(*words)
    assert ended.exit_code == 0, ended.err
    assert by_ssh.is_clean()

    def later(found: re.Match[str]) -> str:
        return f"offset = {int(found[1]) + 50_000_000};"

    def another(found: re.Match[str]) -> str:
        return found[1] + ("2" if found[0].endswith("1") else "1")

    # The clock of another machine, 50 ms ahead of this one.
    for metadata in (tmp_path / "drive" / "hosts" / "arm").rglob("metadata"):
        text = metadata.read_bytes().decode("latin-1")
        text = re.sub(
            r"offset = (\d+);", lambda m: f"offset = {int(m[1]) + 50_000_000:{len(m[1])}};", text
        )
        text = re.sub(
            r'(clock \{[^}]*uuid = ")(.)',
            lambda m: m[1] + ("1" if m[2] != "1" else "2"),
            text,
            flags=re.S,
        )
        metadata.write_bytes(text.encode("latin-1"))
    with Database(tmp_path / "msgflow.duckdb") as database:
        database.ingest(
            tmp_path / "drive",
            hosts={"arm": tmp_path / "drive" / "hosts" / "arm"},
            clock_sync="messages",
        )
        (clock,) = (
            database.sql(
                "SELECT offset_ns, uncertainty_ns FROM clock WHERE clock_id <> reference_clock_id"
            )
            .to_arrow()
            .to_pylist()
        )
        assert abs(abs(clock["offset_ns"]) - 50_000_000) <= clock["uncertainty_ns"] < 5_000_000


def test_a_machine_that_cannot_be_reached_ends_the_recording(
    record: Record, by_ssh: Machine
) -> None:
    for host, why in (("locked", "permission denied"), ("nowhere.invalid", "not resolve")):
        words = ("--name", "drive", "--on", host, "--on", "arm", "--", "sleep", "9")
        ended = record(*words)
        assert ended.exit_code == 1, ended.err
        assert f"cannot record on {host}: " in ended.err
        assert why in ended.err
        assert by_ssh.is_clean()


def test_a_full_disk_there_is_said(record: Record, container: Machine) -> None:
    fill = container.words("dd", "if=/dev/zero", "of=/tmp/full", "bs=1M")
    subprocess.run(fill, capture_output=True)
    ended = record("--name", "drive", "--on", "container:arm", "--", "sleep", "9")
    assert ended.exit_code == 1, ended.err
    assert "disk of /tmp is full" in ended.err
    assert container.is_clean()


def test_a_machine_that_goes_away_leaves_what_is_here(
    by_ssh: Machine, two_nodes: list[str], tmp_path: Path
) -> None:
    words = ["--name", "drive", "--on", "arm", "--", *two_nodes]
    process = subprocess.Popen(
        [sys.executable, "-m", "msgflow", "record", *words],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    end = time.monotonic() + 30
    while "drive" not in by_ssh.sessions() and time.monotonic() < end:
        time.sleep(0.1)
    time.sleep(2)
    # The connection, not the server.
    subprocess.run(["pkill", "-f", "sshd: root@notty"])
    _, err = process.communicate(timeout=120)
    assert process.returncode == 1, err
    assert "the recording on arm is lost: " in err
    assert "run: drive (1)" in err
    assert by_ssh.is_clean()


@pytest.mark.parametrize(
    "word",
    [
        "-oProxyCommand=x",
        "a b",
        "",
        "container:",
        "container:-v",
        "a;b",
        "a\n",
        "$(x)",
        "robot@",
        "user@..",
    ],
)
def test_a_name_that_means_something_to_a_shell_is_refused(word: str) -> None:
    with pytest.raises(UsageError, match="not a machine"):
        read_places([word])


def test_a_machine_is_named_once() -> None:
    with pytest.raises(UsageError, match="two places have one name"):
        read_places(["robot", "user@robot"])


def test_any_login_shell_passes_the_script_on() -> None:
    """Some know other escapes between single quotes than a POSIX shell."""
    (place,) = read_places(["user@robot"])
    *words, target, text = place.command
    assert (words[0], words[-1], target) == ("ssh", "--", "user@robot")
    assert text.count("'") == 2
    assert "\\" not in text
