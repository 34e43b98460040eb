"""Packets between hosts whose clocks are known, as the kernel traces of a simulated system."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from random import Random

from support.kernel_traces import (
    NOISE,
    RECEIVED,
    SENT,
    TCP,
    UDP,
    Header,
    KernelEvent,
    kernel_trace_of,
    write_kernel_trace,
)

SECOND = 1_000_000_000


@dataclass
class Network:
    """Sends packets between the hosts of a simulated system and records them.

    Attributes:
        directory: of the simulated traces.
        addresses: hostname to IP address; hosts without a trace may be among them.
        random: for delays and what is sent.
        events: hostname to what its kernel saw.
    """

    directory: Path
    addresses: dict[str, str]
    random: Random = field(default_factory=lambda: Random(1))
    events: dict[str, list[KernelEvent]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        hosts = json.loads((self.directory / "truth" / "meta.json").read_text())["hosts"]
        self._begins = {name: host["begin_of_tracing_ns"] for name, host in hosts.items()}
        self._drifts = {
            name: Fraction(host["clock_drift_ppb"], 10**9) for name, host in hosts.items()
        }
        self.events = {name: [] for name in hosts}

    def shows(self, host: str, time: int) -> int:
        """Return what the clock of a host shows at a time since the begin [ns]."""
        return int(self._begins[host] + time * (1 + self._drifts[host]))

    def correction(self, host: str, at_ns: int, reference: str) -> tuple[Fraction, Fraction]:
        """Return offset [ns] and drift [1e-9] towards `reference` when `host` shows `at_ns`."""
        own, other = 1 + self._drifts[host], 1 + self._drifts[reference]
        time = (at_ns - self._begins[host]) / own
        return self._begins[reference] + time * other - at_ns, (other / own - 1) * 10**9

    def sent(self, host: str, time: int, header: Header) -> None:
        """A packet is handed to a device."""
        self._add(host, time, SENT, header)

    def received(self, host: str, time: int, header: Header) -> None:
        """A packet comes from a device."""
        self._add(host, time, RECEIVED, header)

    def _add(self, host: str, time: int, name: str, header: Header) -> None:
        if host in self.events:
            event = KernelEvent(self.shows(host, time), name, header, cpu=self.random.randrange(2))
            self.events[host].append(event)

    def carry(
        self,
        sender: str,
        receiver: str,
        time: int,
        *,
        base_ns: int = 40_000,
        checksum_is_filled_in: bool = False,
        **header: object,
    ) -> None:
        """Send a packet that arrives, with a checksum that the network card may fill in."""
        addresses = {
            "source": self.addresses[sender],
            "destination": self.addresses[receiver],
        }
        packet = Header(**{**addresses, **header})  # type: ignore[arg-type]
        self.sent(sender, time, packet)
        if checksum_is_filled_in:
            packet = Header(**{**vars(packet), "checksum": self.random.randrange(1, 1 << 16)})
        delay = base_ns + int(self.random.expovariate(1) * 30_000)
        self.received(receiver, time + delay, packet)

    def write(
        self,
        hosts: Iterable[str] | None = None,
        *,
        place: Callable[[str], Path] | None = None,
        with_network: bool = True,
        contexts: bool = False,
    ) -> None:
        """Write the kernel traces of these hosts, beside the user-space traces where not said."""
        for host in self.events if hosts is None else hosts:
            root = self.directory / host
            begin = self.shows(host, 0)
            events = [KernelEvent(begin, NOISE), KernelEvent(begin, NOISE, cpu=1)]
            events += self.events[host] if with_network else []
            content = kernel_trace_of(
                root / "ust", events, with_network=with_network, contexts=contexts
            )
            directory = root / "kernel" if place is None else place(host)
            write_kernel_trace(directory, content)


def traffic(network: Network, seconds: float) -> int:
    """Send packets of all kinds between alpha and beta, and to and from a third host.

    Returns:
        how many alpha and beta sent to each other that can be told from all others.
    """
    random = network.random
    count = 0
    for way, (sender, receiver) in enumerate((("alpha", "beta"), ("beta", "alpha"))):
        for number in range(int(seconds * 400)):
            time = random.randrange(int(seconds * SECOND))
            kind = random.choice(
                ["tcp", "tcp", "udp", "udp", "plain", "lost", "again", "twice", "third", "card"]
            )
            ports = (40_000 + way, 7411)
            udp: dict[str, object] = {"protocol": UDP, "ports": ports, "length": 200}
            tcp: dict[str, object] = {
                "protocol": TCP,
                "ports": ports,
                "identification": number,
                "sequence": 1460 * number,
                "acknowledgement": 77,
            }
            if kind == "tcp":
                network.carry(sender, receiver, time, **tcp, checksum_is_filled_in=True)
                count += 1
            elif kind == "udp":
                network.carry(
                    sender,
                    receiver,
                    time,
                    **udp,
                    identification=number + 1,
                    checksum_is_filled_in=True,
                )
                count += 1
            elif kind == "plain":  # small datagrams have no identification, but a checksum
                network.carry(
                    sender, receiver, time, **udp, identification=0, checksum=1 + 7 * number
                )
                count += 1
            elif kind == "lost":
                packet = Header(network.addresses[sender], network.addresses[receiver], **tcp)  # type: ignore[arg-type]
                network.sent(sender, time, packet)
            elif kind == "again":  # lost at first, and sent again with the same header
                packet = Header(network.addresses[sender], network.addresses[receiver], **tcp)  # type: ignore[arg-type]
                network.sent(sender, time, packet)
                network.carry(sender, receiver, time + 200_000_000, **tcp)
            elif kind == "twice":  # the network delivers it twice
                packet = Header(network.addresses[sender], network.addresses[receiver], **tcp)  # type: ignore[arg-type]
                network.carry(sender, receiver, time, **tcp)
                network.received(receiver, time + 900_000, packet)
            elif kind == "third":
                network.carry(sender, "gamma", time, **tcp)
                network.carry("gamma", receiver, time + 5_000, **udp, identification=number + 1)
            else:  # nothing tells it from others: the card fills in the checksum
                network.carry(
                    sender,
                    receiver,
                    time,
                    **udp,
                    identification=0,
                    checksum=4711,
                    checksum_is_filled_in=True,
                )
    return count
