"""The server of `msgflow ui`: it sends the pages of one database to the browser of its user.

A page needs the token of the printed address, or the cookie that it then gets. Browsers send
cookies to all ports of a host, also to those of other users: so the cookie opens pages without
data, and a question needs the token itself, which the page keeps for its own port. The server
refuses requests that other sites make, or that name another host than this machine. Behind `ssh -L`
the host is still this machine.
"""

from __future__ import annotations

import hmac
import html
import ipaddress
import os
import re
import socket
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing, contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any, Protocol
from urllib.parse import urlsplit

import anyio
import anyio.to_thread
import duckdb
import uvicorn
from starlette.applications import Starlette
from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import Request
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.routing import Route
from starlette.types import ASGIApp, Receive, Scope, Send

from msgflow.errors import MsgflowError, QueryError, UsageError
from msgflow.sql.failure import first_line
from msgflow.sql.interrupt import noted_interrupts
from msgflow.view import assets
from msgflow.view.connection import Connection, timed
from msgflow.view.kept_token import kept_token
from msgflow.view.shared_database import ReplacedError, SharedDatabase, UnopenedError
from msgflow.view.sql_page import Sql, encoded_error, encoded_rows, most_rows

# A question gives it, when it starts, the function that ends the question.
Started = Callable[[Callable[[], None]], None]

HOST = "127.0.0.1"
DEFAULT_PORT = 8642
# Questions that are answered at the same time; the others wait.
MOST_AT_ONCE = 4
_SECONDS_BETWEEN_LOOKS = 0.1
# SQL has one process, and keeps no page waiting; nor does the next state.
_ALONE = ("sql", "prepare", "show")
_NOT_HERE = "this server answers for this machine alone"
_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:;"
    " connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
# Status and code of an error, the first kind that it is of.
_FAILURES = {
    ReplacedError: (409, "replaced"),
    UnopenedError: (503, "unopened"),
    UsageError: (400, "usage"),
    MsgflowError: (500, "failed"),
}
_TYPES = {".js": "text/javascript", ".css": "text/css"}
_HEADERS = {
    "Content-Security-Policy": _POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cache-Control": "no-store",
}


class Following(Protocol):
    """What moves a database on when a page asks for it."""

    def prepare(self) -> None:
        """Write its next state beside the database; this may take long."""

    def show(self) -> None:
        """Put what was prepared in place of the database."""


def application(
    shared: SharedDatabase, token: str, sql: Sql, following: Following | None = None
) -> ASGIApp:
    """Return the application: pages and their data, for requests with the token."""
    limiters: dict[str, anyio.CapacityLimiter] = {}
    follows = "" if following is None else " data-follows"

    async def page(request: Request) -> Response:
        generation = ""
        with suppress(MsgflowError):  # the page asks too, and shows the error
            generation = await anyio.to_thread.run_sync(shared.generation)
        content = assets.page(
            head=_head(), attributes=f' data-generation="{html.escape(generation)}"{follows}'
        )
        return Response(content, media_type="text/html")

    async def file(request: Request) -> Response:
        name = request.path_params["name"]
        if name in (*assets.SCRIPTS, *assets.SHEETS, *assets.IMPORTED):
            content = assets.vendored(name)
        elif name in assets.modules() or name == "style.css":
            content = assets.text(name)
        else:
            return PlainTextResponse("not found", status_code=404)
        return Response(content, media_type=_TYPES[name[name.rindex(".") :]])

    def rows(params: dict[str, Any], generation: str | None, started: Started) -> bytes:
        limit = most_rows(params)
        shared.require(generation)
        started(sql.interrupt)
        try:
            result = sql(params.get("text", ""), limit)
        except (QueryError, UsageError) as error:
            return encoded_error(error.message, error.hint)
        shared.require(generation)
        return encoded_rows(result)

    def answer(
        name: str, params: dict[str, Any], generation: str | None, started: Started
    ) -> bytes:
        if name == "sql":
            return rows(params, generation, started)
        if following is not None and name == "prepare":
            following.prepare()
            return b""
        if following is not None and name == "show":
            following.show()
            return shared.generation().encode()
        return shared.answer(name, params, generation, started)

    async def data(request: Request) -> Response:
        name = request.path_params["name"]
        params: dict[str, Any] = dict(request.query_params)
        generation = request.headers.get("X-Generation")
        kind = name if name in _ALONE else ""
        if kind not in limiters:
            limiters[kind] = anyio.CapacityLimiter(1 if kind else MOST_AT_ONCE)
        try:
            ask = partial(answer, name, params, generation)
            return await _answered(request, limiters[kind], ask)
        except MsgflowError as error:
            return _failure(error)
        except duckdb.Error as error:
            return _failure(QueryError(first_line(error)))

    app = Starlette(routes=[Route("/", page), Route("/{name}", file), Route("/api/{name}", data)])
    return guarded(app, token)


async def _answered(
    request: Request, limiter: anyio.CapacityLimiter, ask: Callable[[Started], bytes]
) -> Response:
    """Return the answer; interrupt the question when the browser no longer waits for it."""
    interrupts: list[Callable[[], None]] = []
    content: list[bytes] = []
    failures: list[Exception] = []

    async def watch() -> None:
        while not await request.is_disconnected():
            await anyio.sleep(_SECONDS_BETWEEN_LOOKS)
        # Repeatedly, since between two statements there is nothing to interrupt.
        while True:
            for interrupt in interrupts:
                with suppress(duckdb.Error):  # it has just ended
                    interrupt()
            await anyio.sleep(_SECONDS_BETWEEN_LOOKS)

    try:
        async with anyio.create_task_group() as group:
            group.start_soon(watch)
            # What the query raises would leave the group as a group of one.
            try:
                content.append(
                    await anyio.to_thread.run_sync(lambda: ask(interrupts.append), limiter=limiter)
                )
            except Exception as error:
                failures.append(error)
            group.cancel_scope.cancel()
    except anyio.get_cancelled_exc_class():
        # The server ends, and does not wait for the question.
        for interrupt in interrupts:
            interrupt()
        return PlainTextResponse("error: the server has ended\n", status_code=503)
    if failures:
        raise failures[0]
    return Response(content[0], media_type="application/octet-stream")


def _failure(error: MsgflowError) -> Response:
    status, code = next(said for kind, said in _FAILURES.items() if isinstance(error, kind))
    return JSONResponse({"error": error.message, "hint": error.hint, "code": code}, status)


def _head() -> str:
    sheets = "".join(
        f'<link rel="stylesheet" href="{name}">\n' for name in (*assets.SHEETS, "style.css")
    )
    scripts = "".join(f'<script src="{name}" defer></script>\n' for name in assets.SCRIPTS)
    return f'{sheets}{scripts}<script type="module" src="{assets.ENTRY}"></script>'


def guarded(app: ASGIApp, token: str) -> ASGIApp:
    """Return the application for requests with the token, from our own page, to this machine."""

    async def answer(scope: Scope, receive: Receive, send: Send) -> None:
        request = Request(scope, receive)
        refused = _refusal(request, token)
        headers = _HEADERS
        if not refused and "token" in request.query_params:
            cookie = f"{_cookie_name(request)}={cookie_of(token)}"
            headers = headers | {"Set-Cookie": f"{cookie}; HttpOnly; Path=/; SameSite=strict"}

        async def send_with_headers(message: Any) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(headers)
            await send(message)

        respond = PlainTextResponse(f"error: {refused[1]}\n", refused[0]) if refused else app
        await respond(scope, receive, send_with_headers)

    return answer


def _refusal(request: Request, token: str) -> tuple[int, str] | None:
    """Return the status and the words with which a request is refused."""
    if not is_local(request.headers.get("host", "")):
        return 421, _NOT_HERE
    if request.method not in ("GET", "HEAD"):
        return 405, "nothing can be changed here"
    if request.headers.get("sec-fetch-site", "none") not in ("none", "same-origin"):
        # A link on any site may lead to the page; the browser then sends no cookie.
        is_visit = request.headers.get("sec-fetch-mode") == "navigate"
        if not (is_visit and request.url.path == "/"):
            return 403, "another site asks"
    if request.url.path.startswith("/api/"):
        is_known = _same(request.headers.get("X-Token", ""), token)
    elif request.url.path == "/" and "token" in request.query_params:
        is_known = _same(request.query_params["token"], token)
    else:
        cookie = request.cookies.get(_cookie_name(request), "")
        is_known = _same(cookie, cookie_of(token))
    if is_known:
        return None
    return 403, "this page needs the address that msgflow ui printed, with its token"


def cookie_of(token: str) -> str:
    """Return the value of the cookie: the token does not follow from it."""
    return hmac.new(token.encode(), b"page", "sha256").hexdigest()


def _cookie_name(request: Request) -> str:
    return f"msgflow_{request.url.port or 80}"


def _same(given: str, token: str) -> bool:
    return hmac.compare_digest(given.encode(), token.encode())


def is_local(host: str) -> bool:
    """Tell whether the Host header of a request names this machine, at any port."""
    match = re.fullmatch(r"(\[[0-9a-fA-F:.]+\]|[^:\[\]]+)(?::\d{1,5})?", host)
    if match is None:
        return False
    name = match[1].lower()
    try:
        _ = urlsplit(f"//{host}").port  # as the application reads it
        return name == "localhost" or ipaddress.ip_address(name.strip("[]")).is_loopback
    except ValueError:
        return False


def listen(port: int | None) -> socket.socket:
    """Return a socket that listens on this machine alone.

    Port 0 means any free one, None the usual one, or any free one where that is taken.
    """
    wanted = DEFAULT_PORT if port is None else port
    try:
        return socket.create_server((HOST, wanted), backlog=128)
    except OSError as error:
        if port is None:
            return listen(0)
        # Its own text has the address, too.
        reason = (os.strerror(error.errno) if error.errno else str(error)).lower()
        raise UsageError(
            f"cannot listen on the port: {reason} — {wanted}",
            "give another port, or 0: then a free one is taken",
        ) from error


@contextmanager
def serving(
    path: Path,
    sql: Sql,
    *,
    port: int | None,
    memory_limit: str | None = None,
    following: Following | None = None,
    place: str | None = None,
) -> Iterator[tuple[str, Future[None]]]:
    """Serve the pages of a database; see `serving_application` for what it yields.

    `port` is as for `listen`. Without `memory_limit`, DuckDB takes a quarter of the machine's
    memory, at least 500 MB and at most 4 GB. The token is that of `place`, by default of the path.
    """
    place = place or str(path.resolve())
    with (
        closing(SharedDatabase(path, memory_limit)) as shared,
        serving_application(
            place, port, lambda token: application(shared, token, sql, following)
        ) as served,
    ):
        yield served


@contextmanager
def serving_application(
    place: str, port: int | None, make: Callable[[str], ASGIApp]
) -> Iterator[tuple[str, Future[None]]]:
    """Serve, in a thread, the application that `make` returns for the token of a place.

    Yields the address, with the token, and what the server ends with.
    """
    with listen(port) as listener, ThreadPoolExecutor(max_workers=1) as pool:
        token = kept_token(place)
        server = _server(make(token))
        # In the main thread, Ctrl-C could come before the server looks for signals itself.
        with noted_interrupts() as interrupts:
            served = pool.submit(server.run, sockets=[listener])
        try:
            interrupts.check()
            yield f"http://{HOST}:{listener.getsockname()[1]}/?token={token}", served
        finally:
            server.should_exit = True


def serve_text(address: str, port: int, make: Callable[[], bytes], media_type: str) -> None:
    """Serve one text at any path, in a thread, until the process ends.

    An address of this machine alone answers no request that names another host.
    """
    family = socket.AF_INET6 if ":" in address else socket.AF_INET
    listener = socket.create_server((address, port), family=family)

    async def answer(scope: Scope, receive: Receive, send: Send) -> None:
        host = Headers(scope=scope).get("host", "")
        response = (
            PlainTextResponse(f"error: {_NOT_HERE}\n", 421)
            if is_local(address) and not is_local(host)
            else Response(make(), media_type=media_type)
        )
        await response(scope, receive, send)

    run = partial(_server(answer).run, sockets=[listener])
    threading.Thread(target=run, daemon=True).start()


def _server(app: ASGIApp) -> uvicorn.Server:
    config = uvicorn.Config(
        timed(app), log_level="error", access_log=False, lifespan="off", ws="none",
        timeout_graceful_shutdown=1, server_header=False, proxy_headers=False, http=Connection,
    )  # fmt: skip
    return uvicorn.Server(config)
