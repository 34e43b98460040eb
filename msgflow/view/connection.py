"""Connections to the server of `msgflow ui`: one whose request does not arrive is closed.

uvicorn has no limit for the time in which a request arrives. It takes a protocol of asyncio in
place of its own: ours closes the connection if its time is over. The application tells it when a
request has arrived, and when it is answered.
"""

from __future__ import annotations

import asyncio
from typing import Any, ClassVar

from starlette.types import ASGIApp, Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol

# A browser that opens a connection ahead of its need opens another one later.
SECONDS_FOR_A_REQUEST = 10.0


class Connection(H11Protocol):
    """A connection of uvicorn that is closed if a request takes too long to arrive."""

    # By the addresses of both ends, which the application knows as well.
    _open: ClassVar[dict[tuple[Any, Any], Connection]] = {}

    @classmethod
    def of(cls, scope: Scope) -> Connection | None:
        """Return the connection that a request came by; None if it is closed already."""
        return cls._open.get((scope["client"], scope["server"]))

    def connection_made(self, transport: Any) -> None:
        """Wait for the first request."""
        self._ends = tuple(map(transport.get_extra_info, ("peername", "sockname")))
        self._open[self._ends] = self
        super().connection_made(transport)
        self.wait()

    def wait(self) -> None:
        """Wait for a request, and no longer than it may take."""
        loop = asyncio.get_running_loop()
        self._timer = loop.call_later(SECONDS_FOR_A_REQUEST, self.transport.close)

    def stop(self) -> None:
        """Wait no more: the request has arrived."""
        self._timer.cancel()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the connection."""
        self.stop()
        del self._open[self._ends]
        super().connection_lost(exc)


def timed(app: ASGIApp) -> ASGIApp:
    """Return the application; it tells a connection when a request has arrived and is answered."""

    async def tell(scope: Scope, receive: Receive, send: Send) -> None:
        connection = Connection.of(scope)
        if connection is None:
            return
        connection.stop()
        try:
            await app(scope, receive, send)
        finally:
            connection.wait()

    return tell
