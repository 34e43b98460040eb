"""Pages as they are served, and as a browser shows them."""

from __future__ import annotations

import http.client
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from decimal import ROUND_HALF_UP, Decimal
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import duckdb

from msgflow.cli.sql_process import WarmSql
from msgflow.view.server import cookie_of, serving

_UNITS = ((10**9, "s"), (10**6, "ms"), (10**3, "µs"), (1, "ns"))


class Served:
    """A server in a thread of this process."""

    def __init__(self, path: Path, seconds: float = 30) -> None:
        self._sql = WarmSql(path, memory_limit="1GB", seconds=seconds)
        self._serving = serving(path, self._sql, port=0)
        self.address, _ = self._serving.__enter__()
        self.port = urlsplit(self.address).port
        self.token = self.address.partition("token=")[2]

    def get(
        self, path: str, *, method: str = "GET", **headers: str
    ) -> tuple[int, dict[str, str], bytes]:
        """Ask as the browser does that has opened the address; headers replace what it says."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=30)
        cookie = f"msgflow_{self.port}={cookie_of(self.token)}"
        said = {"Host": f"127.0.0.1:{self.port}", "Cookie": cookie, "X-Token": self.token}
        said |= {name.replace("_", "-"): value for name, value in headers.items()}
        connection.request(method, path, headers=said)
        answer = connection.getresponse()
        content = answer.read()
        connection.close()
        return answer.status, {k.lower(): v for k, v in answer.getheaders()}, content

    def generation(self) -> str:
        """Return the generation of the page that is loaded now."""
        page = self.get("/")[2].decode()
        return page.partition('data-generation="')[2].partition('"')[0]

    def close(self) -> None:
        closing = threading.Thread(target=self._serving.__exit__, args=[None] * 3, daemon=True)
        closing.start()
        closing.join(20)
        assert not closing.is_alive(), "the server does not end"
        self._sql.close()


@dataclass
class Page:
    """A page in the browser, and everything that went wrong on it."""

    page: Any
    errors: list[str] = field(default_factory=list)
    foreign: list[str] = field(default_factory=list)

    def open(self, address: str) -> None:
        """Open an address and wait until the page stands."""
        self.page.goto(address)
        self.page.wait_for_selector("html[data-ready]", timeout=30_000)

    def go(self, place: str) -> None:
        """Go to a place of the page, such as '#/paths', and wait until it stands."""
        with self.anew():
            self.page.evaluate("place => { location.hash = place; }", place)

    @contextmanager
    def anew(self) -> Iterator[None]:
        """Wait until the page stands anew, after what is done inside led to another address."""
        ready = "Number(document.documentElement.dataset.ready ?? 0)"
        before = self.page.evaluate(ready)
        yield
        self.page.wait_for_function(f"before => {ready} > before", arg=before)

    def flow(self) -> set[tuple[str, int]]:
        """Return (kind, identity) of everything that the page says the picked flow has."""
        rows = self.page.locator(".steps tbody tr")
        rows.first.wait_for(timeout=30_000)
        found = rows.evaluate_all("rows => rows.map(row => [row.dataset.kind, row.dataset.id])")
        return {(kind, int(number)) for kind, number in found}


def flow_of(connection: duckdb.DuckDBPyConnection, kind: str, number: int) -> set[tuple[str, int]]:
    return set(
        connection.execute("SELECT kind, id FROM flow_both(?, ?)", [kind, number]).fetchall()
    )


def a_publication(connection: duckdb.DuckDBPyConnection, run: int) -> int:
    ((number,),) = connection.execute(
        "SELECT min(publication_id) FROM link_causal AS c JOIN link_transport AS t"
        " USING (publication_id) WHERE c.run_id = ? AND c.kind <> 'direct'",
        [run],
    ).fetchall()
    if number is None:
        ((number,),) = connection.execute(
            "SELECT quantile_disc(publication_id, 0.5) FROM link_transport WHERE run_id = ?", [run]
        ).fetchall()
    return int(number)


def colors(page: Page) -> int:
    """Return how many colours the canvas has: a blank one has few."""
    found: int = page.page.locator("canvas.timeline").evaluate(
        """canvas => {
            const { width, height } = canvas;
            const data = canvas.getContext("2d").getImageData(0, 0, width, height).data;
            const seen = new Set();
            for (let at = 0; at < data.length; at += 4)
                seen.add((data[at] << 16) | (data[at + 1] << 8) | data[at + 2]);
            return seen.size;
        }"""
    )
    return found


def shown(ns: int | None) -> str:
    """Return a duration as pages write it."""
    if ns is None:
        return ""
    if ns == 0:
        return "0"
    scale, unit = next((scale, unit) for scale, unit in _UNITS if abs(ns) >= scale)
    if scale == 1:
        return f"{ns} {unit}"
    # A half goes up, as it does in tables of the terminal.
    value = (Decimal(ns) / scale).quantize(Decimal("0.001"), ROUND_HALF_UP)
    return f"{f'{value:,}'.rstrip('0').rstrip('.')} {unit}"
