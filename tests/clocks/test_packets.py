"""Offsets and drifts of clocks from network packets of kernel traces."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from support.ingested import rows
from support.kernel_traces import TCP, UDP, Header
from support.network import SECOND, Network, traffic

from msgflow import open_db
from msgflow_sim import simulate

ADDRESSES = {"alpha": "192.168.1.1", "beta": "192.168.1.2", "gamma": "192.168.1.3"}
SECONDS = 3.0

Make = Callable[..., Network]
Ingest = Callable[..., Path]


@pytest.fixture
def make(tmp_path: Path) -> Make:
    """Simulate two hosts; the clock of beta is 7 ms ahead and runs 20 ppm too fast."""

    def simulated(factor: float = 0.03, **options: Any) -> Network:
        done = simulate(
            "two_hosts",
            tmp_path / "traces",
            factor=factor,
            **{"clock_offset_ns": 7_000_000, "clock_drift_ppm": 20, **options},
        )
        return Network(done.directory, ADDRESSES)

    return simulated


@pytest.fixture
def ingest(tmp_path: Path) -> Ingest:
    def into_new(*paths: Path, clock_sync: str = "messages") -> Path:
        database = tmp_path / "msgflow.duckdb"
        with open_db(database) as opened:
            opened.ingest(list(paths), clock_sync=clock_sync)
        return database

    return into_new


def beta(database: Path) -> dict[str, Any]:
    with open_db(database) as opened:
        clocks = opened.query("clocks").to_arrow().to_pylist()
    return next(clock for clock in clocks if clock["hosts"] == "beta")


def require_truth(network: Network, clock: dict[str, Any]) -> None:
    assert clock["reference"] == "alpha"
    offset, drift = network.correction("beta", clock["reference_ns"], "alpha")
    assert abs(clock["offset_ns"] - offset) <= clock["uncertainty_ns"] + 2
    assert abs(clock["drift_ppb"] - drift) <= clock["drift_uncertainty_ppb"] + 1


def details(database: Path) -> dict[str, str]:
    return dict(rows(database, "SELECT name, detail FROM finding"))


def links(database: Path) -> list[tuple[Any, ...]]:
    """The matched packets: device times are left out."""
    return rows(
        database,
        "SELECT protocol, source_address, source_port, destination_address, destination_port, "
        "identification, sequence_number FROM link_packet ORDER BY ALL",
    )


@pytest.mark.thorough
def test_packets_tell_more_than_messages(make: Make, ingest: Ingest, tmp_path: Path) -> None:
    network = make(0.3)
    database = ingest(network.directory)
    alone = beta(database)
    assert alone["method"] == "messages"
    require_truth(network, alone)
    assert rows(database, "SELECT * FROM link_packet") == []
    database.unlink()

    count = traffic(network, SECONDS)
    network.write()
    database = ingest(network.directory)
    clock = beta(database)
    assert clock["method"] == "packets"
    require_truth(network, clock)
    assert clock["uncertainty_ns"] < alone["uncertainty_ns"] / 2
    assert clock["drift_uncertainty_ppb"] < alone["drift_uncertainty_ppb"] / 2
    assert clock["uncertainty_ns"] < 1.1 * 40_000
    assert len(links(database)) == count
    # No packet arrives before it was sent, by more than the bound of the error.
    assert min(latency for (latency,) in rows(database, "SELECT latency_ns FROM link_packet")) > 0
    pairs = rows(
        database,
        "SELECT from_clock_id, to_clock_id, message_count > 0, packet_count, "
        "shortest_packet_ns < shortest_message_ns FROM clock_pair ORDER BY ALL",
    )
    assert [pair[:3] for pair in pairs] == [(1, 2, True), (2, 1, True)]
    assert sum(pair[3] for pair in pairs) == count
    assert all(pair[4] for pair in pairs)
    assert "seen on both ends" in details(database)["network_packets_unused"]


@pytest.mark.thorough
def test_what_is_known_of_ros_does_not_change(make: Make, ingest: Ingest) -> None:
    network = make()
    database = ingest(network.directory, clock_sync="none")

    def known() -> dict[str, list[tuple[Any, ...]]]:
        found = {
            table: rows(database, f"SELECT * EXCLUDE (trace_id) FROM {table} ORDER BY ALL")
            for table in ("publication", "take", "callback_instance", "gap")
        }
        found |= {
            table: rows(database, f"FROM {table} ORDER BY ALL") for table in ("process", "thread")
        }
        found["run"] = rows(database, "SELECT name, start_ns, end_ns FROM run")
        return found

    before = known()
    database.unlink()
    # The kernel was traced before and after, and says which process it interrupted.
    network.carry("alpha", "beta", -SECOND)
    network.carry("alpha", "beta", 60 * SECOND, identification=2)
    network.write(contexts=True)
    database = ingest(network.directory, clock_sync="none")
    assert known() == before
    assert rows(database, "SELECT count(*) FROM link_packet") == [(2,)]
    kinds = rows(database, "SELECT DISTINCT detail FROM finding WHERE name = 'unknown_event'")
    assert kinds == [
        ("events that are not in the catalogue and were not loaded: kernel events of 1 names",)
    ]


@pytest.mark.thorough
def test_a_kernel_trace_of_an_older_tracer_lies_anywhere(
    make: Make, ingest: Ingest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It gives a received packet another name."""
    monkeypatch.setattr("network.RECEIVED", "netif_receive_skb")
    monkeypatch.setattr("kernel_traces.RECEIVED", "netif_receive_skb")
    network = make()
    for number in range(50):
        network.carry("alpha", "beta", number * 1_000_000, identification=number + 1)
        network.carry("beta", "alpha", number * 1_000_000, identification=number + 1)
    network.write(place=lambda host: tmp_path / "elsewhere" / host)
    database = ingest(network.directory, tmp_path / "elsewhere")
    assert beta(database)["method"] == "packets"
    assert rows(database, "SELECT count(*) FROM link_packet") == [(100,)]
    assert rows(database, "SELECT hostname FROM host ORDER BY 1") == [("alpha",), ("beta",)]


@pytest.mark.thorough
def test_a_number_that_comes_round_again_is_told_by_time(make: Make, ingest: Ingest) -> None:
    """Identifications repeat every three seconds, and once after a tenth of one."""
    network = make(clock_offset_ns=5 * SECOND)
    for number in range(4):
        network.carry("alpha", "beta", number * 3 * SECOND, identification=9)
    network.carry("alpha", "beta", 12 * SECOND, identification=8)
    network.carry("alpha", "beta", 12 * SECOND + SECOND // 10, identification=8)
    network.carry("alpha", "beta", 13 * SECOND, identification=7)
    network.write()
    database = ingest(network.directory, clock_sync="none")
    assert [row[5] for row in links(database)] == [7, 9, 9, 9, 9]
    ways = rows(database, "SELECT received_ns - sent_ns FROM link_packet")
    assert all(5 * SECOND < way < 5 * SECOND + 1_000_000 for (way,) in ways)
    unused = details(database)["network_packets_unused"]
    assert "of 7 network packets sent and 7 received on alpha and beta, 5 were seen" in unused
    assert "4 that were repeated" in unused


@pytest.mark.thorough
def test_clocks_are_told_by_numbers_that_all_come_again(make: Make, ingest: Ingest) -> None:
    """No number is there only once, and the hosts did not record at the same time."""
    network = make(clock_offset_ns=-300 * SECOND)
    for round_, begin in enumerate((0, 9, 17, 28, 36)):
        for number in range(20):
            time = begin * SECOND + number * 50_000_000
            lost = network.random.random() < 0.1 or round_ == 4
            header = Header("192.168.1.1", "192.168.1.2", identification=number + 1)
            network.sent("alpha", time, header)
            if not lost:
                network.received("beta", time + 60_000, header)
    # Beta's trace begins earlier.
    for number in range(20):
        network.received(
            "beta", -20 * SECOND, Header("192.168.1.1", "192.168.1.2", identification=number + 1)
        )
    network.write()
    database = ingest(network.directory, clock_sync="none")
    ways = [way for (way,) in rows(database, "SELECT received_ns - sent_ns FROM link_packet")]
    assert 60 < len(ways) < 80
    assert all(abs(way + 300 * SECOND - 60_000) < 2_000_000 for way in ways)


@pytest.mark.thorough
def test_numbers_that_come_again_regularly_tell_nothing(make: Make, ingest: Ingest) -> None:
    network = make()
    for number in range(200):
        network.carry("alpha", "beta", number * SECOND, identification=1 + number % 10)
    network.write()
    database = ingest(network.directory)
    assert links(database) == []
    assert beta(database)["method"] == "messages"
    unused = details(database)["network_packets_unused"]
    assert "400 whose other end was not seen or is not certain" in unused


def test_headers_of_all_kinds(make: Make, ingest: Ingest) -> None:
    network = make()
    v6 = {"source": "fd00:0:0:0:0:0:0:1", "destination": "fd00:0:0:0:0:0:0:2"}
    both = {"source": "192.168.1.1", "destination": "239.255.0.1"}
    carry = network.carry
    carry("alpha", "beta", 1, protocol=TCP, ports=(1, 2), **v6, sequence=2**32 - 1)
    carry("alpha", "beta", 2, protocol=UDP, ports=(3, 4), **v6, checksum=5)
    carry("alpha", "beta", 3, protocol=UDP, ports=(7, 8), **both, identification=65_535)
    # The sender receives its own multicast, which tells nothing of clocks.
    network.received("alpha", 9_000, Header(**both, ports=(7, 8), identification=65_535))
    # Of no use: no way to tell, a later fragment, no ports, the same on every host.
    carry("alpha", "beta", 4, protocol=UDP, ports=(3, 4), **v6)
    carry("alpha", "beta", 5, fragment=0x2001, identification=3)
    carry("alpha", "beta", 6, protocol=99)
    carry("alpha", "beta", 7, source="127.0.0.1", destination="127.0.0.1", identification=5)
    carry("alpha", "beta", 8, source="0:0:0:0:0:0:0:1", destination="0:0:0:0:0:0:0:1", checksum=5)
    # The same header from both hosts: it cannot be told whose a third one received.
    for host in ("alpha", "beta"):
        network.sent(host, 50_000, Header("172.17.0.2", "172.17.0.3", identification=6))
        network.received(host, 60_000, Header("172.17.0.2", "172.17.0.3", identification=6))
    network.write()
    database = ingest(network.directory)
    assert links(database) == [
        ("tcp", "fd00:0:0:0:0:0:0:1", 1, "fd00:0:0:0:0:0:0:2", 2, None, 2**32 - 1),
        ("udp", "192.168.1.1", 7, "239.255.0.1", 8, 65_535, None),
        ("udp", "fd00:0:0:0:0:0:0:1", 3, "fd00:0:0:0:0:0:0:2", 4, None, None),
    ]
    unused = details(database)["network_packets_unused"]
    assert "10 that look like others, 4 that were repeated" in unused
    assert "1 whose other end was not seen or is not certain" in unused


@pytest.mark.thorough
def test_one_host_is_said(make: Make, ingest: Ingest) -> None:
    network = make()
    traffic(network, 0.5)
    network.write(["beta"])
    database = ingest(network.directory)
    unused = details(database)["network_packets_unused"]
    assert "received on beta, 0 were seen on both ends" in unused
    assert beta(database)["method"] == "messages"


@pytest.mark.thorough
def test_a_kernel_trace_without_packets_is_said(make: Make, ingest: Ingest) -> None:
    network = make()
    network.write(with_network=False)
    database = ingest(network.directory)
    assert "enable net_dev_queue and net_if_receive_skb" in details(database)["no_network_packets"]
    assert rows(database, "SELECT count(*) FROM finding WHERE name = 'no_network_packets'") == [
        (2,)
    ]


@pytest.mark.thorough
def test_one_clock_needs_no_packets(tmp_path: Path, ingest: Ingest) -> None:
    directory = simulate("pipeline", tmp_path / "traces", factor=0.01).directory
    (host,) = (path.name for path in directory.iterdir() if (path / "ust").is_dir())
    network = Network(directory, {host: "10.0.0.1", "other": "10.0.0.2"})
    network.carry(host, "other", 1)
    network.write()
    database = ingest(directory)
    assert not {"no_network_packets", "network_packets_unused"} & set(details(database))
