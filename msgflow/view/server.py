"""The server of `msgflow ui`: it sends the pages of one database to the browser of its user.

A request needs the token of the printed address, which becomes a cookie. The server refuses
requests that other sites make, or that name another host than this machine. Behind `ssh -L` the
host is still this machine.
"""

from __future__ import annotations

import hmac
import html
import ipaddress
import re
import secrets
import socket
import threading
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import anyio
import anyio.to_thread
import duckdb
import uvicorn
from starlette.applications import Starlette
from starlette.responses import JSONResponse, PlainTextResponse, RedirectResponse, Response
from starlette.routing import Route

from msgflow.db.connection import connect
from msgflow.db.memory import default_limit
from msgflow.errors import DatabaseError, MsgflowError, QueryError, UsageError
from msgflow.sql.failure import first_line
from msgflow.view import assets
from msgflow.view.connection import Connection, timed
from msgflow.view.pages import Pages

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from starlette.requests import Request
    from starlette.types import ASGIApp, Receive, Scope, Send

HOST = "127.0.0.1"
DEFAULT_PORT = 8642
# Questions that are answered at the same time; the others wait.
MOST_AT_ONCE = 4
_SECONDS_BETWEEN_LOOKS = 0.1
_LOCAL_NAMES = ("localhost",)
_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:;"
    " connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_POLICY_OF_FILES = "frame-ancestors 'none'"
_TYPES = {".js": "text/javascript", ".css": "text/css"}
_HEADERS = {
    "Content-Security-Policy": _POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cache-Control": "no-store",
}
_FILE = re.compile(r"[\w.-]+\.(?:js|css)")


class ReplacedError(DatabaseError):
    """The database is not the one that the page was made of."""


class UnopenedError(DatabaseError):
    """What took the place of the database cannot be opened, or not yet."""


@dataclass(frozen=True)
class Identity:
    """Tells a file from another of the same name."""

    device: int
    inode: int
    modified_ns: int
    size: int


class Turns:
    """Turns of questions: several at a time, and one alone that had too little memory."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._running = 0
        self._is_alone = False

    def ask(self, question: Callable[[], bytes]) -> bytes:
        """Return the answer.

        Raises:
            MsgflowError: what the question raises; of memory only where it has too little alone.
        """
        with self._turn(alone=False):
            answer = _if_memory_suffices(question)
        if answer is not None:
            return answer
        with self._turn(alone=True):
            answer = _if_memory_suffices(question)
        if answer is None:
            raise QueryError(
                "this takes more memory than the server may use",
                "start it with more: msgflow ui --memory-limit 8GB",
            )
        return answer

    @contextmanager
    def _turn(self, *, alone: bool) -> Iterator[None]:
        with self._changed:
            self._changed.wait_for(lambda: not self._is_alone and not (alone and self._running))
            self._running += 1
            self._is_alone = alone
        try:
            yield
        finally:
            with self._changed:
                self._running -= 1
                self._is_alone = False
                self._changed.notify_all()


class Ahead:
    """Asks for the timeline of the latest run before the page does.

    The bars of a large run are counted once, which takes longer than a browser needs to open.
    """

    def __init__(self, turns: Turns, pages: Pages, cursor: duckdb.DuckDBPyConnection) -> None:
        self._turns = turns
        self._pages = pages
        self._cursor = cursor
        self._thread = threading.Thread(target=self._ask, daemon=True)
        self._thread.start()

    def _ask(self) -> None:
        # The page asks for it too, and shows the error.
        with suppress(MsgflowError, duckdb.Error):
            self._turns.ask(lambda: self._pages.answer(self._cursor, "segments", {}))

    def stop(self) -> None:
        """End it, if it still asks."""
        while self._thread.is_alive():
            self._cursor.interrupt()
            self._thread.join(_SECONDS_BETWEEN_LOOKS)
        self._cursor.close()


def _if_memory_suffices(question: Callable[[], bytes]) -> bytes | None:
    try:
        return question()
    except (duckdb.OutOfMemoryException, QueryError) as error:
        if not isinstance(error.__cause__ or error, duckdb.OutOfMemoryException):
            raise
    return None


@dataclass
class Opened:
    """The database as it was opened once.

    Attributes:
        identity: of its file.
        base: a connection, which those of questions are made of.
        pages: answer questions.
        turns: of questions.
        ahead: the question that comes before those of pages.
    """

    identity: Identity
    base: duckdb.DuckDBPyConnection
    pages: Pages
    turns: Turns
    ahead: Ahead

    def close(self) -> None:
        """Close it; no question may run."""
        self.ahead.stop()
        self.base.close()
        self.pages.close()


class Shared:
    """The open database, which all requests share; it is opened anew when its file is replaced.

    Attributes:
        generation: counts how often that was.
    """

    def __init__(self, path: Path, memory_limit: str | None) -> None:
        self.path = path
        self.generation = 1
        self._memory_limit = memory_limit
        self._changed = threading.Condition()
        self._cursors: set[duckdb.DuckDBPyConnection] = set()
        self._opened: Opened | None = self._open()

    def _open(self) -> Opened:
        # First: if the file is replaced meanwhile, the next request sees another identity.
        identity = _identity(self.path)
        base = connect(
            self.path, read_only=True, memory_limit=self._memory_limit or default_limit()
        )
        pages, turns = Pages(), Turns()
        return Opened(identity, base, pages, turns, Ahead(turns, pages, base.cursor()))

    def renew(self) -> None:
        """Open the database anew if its file was replaced.

        Raises:
            ReplacedError: the file is gone.
            UnopenedError: what took its place cannot be opened.
        """
        with self._changed:
            self._current()

    def answer(
        self,
        name: str,
        params: dict[str, Any],
        generation: str | None,
        started: Callable[[duckdb.DuckDBPyConnection], None],
    ) -> bytes:
        """Return the answer to a question of a page.

        Args:
            name: of the answer.
            params: as the page gives them.
            generation: that of the page.
            started: called with the connection that is asked, which can be interrupted.

        Raises:
            ReplacedError: the file was replaced since the page was made, or is gone.
            UnopenedError: what took its place cannot be opened.
            MsgflowError: as `Pages.answer` does.
        """
        with self._changed:
            opened = self._current()
            if generation is not None and generation != str(self.generation):
                raise self._replaced()
            cursor = opened.base.cursor()
            self._cursors.add(cursor)
        try:
            started(cursor)
            content = opened.turns.ask(lambda: opened.pages.answer(cursor, name, params))
        except (MsgflowError, duckdb.Error):
            if not self._is_same(opened):  # then it was interrupted, or read another file
                raise self._replaced() from None
            raise
        finally:
            with self._changed:
                cursor.close()
                self._cursors.discard(cursor)
                self._changed.notify_all()
        if not self._is_same(opened):  # written in its place, it can be a part of each
            raise self._replaced()
        return content

    def _current(self) -> Opened:
        # A process has a file of one name open once: the old one is closed before the new one.
        while not self._is_same(self._opened):
            if self._cursors:
                self._end_questions()
                continue
            if self._opened is not None:
                self._opened.close()
                self._opened = None
            try:
                self._opened = self._open()
            except DatabaseError as error:
                if not self.path.exists():
                    raise ReplacedError(
                        f"the database is no longer there — {self.path}", "msgflow ui --db FILE"
                    ) from None
                raise UnopenedError(error.message, error.hint) from None
            self.generation += 1
        assert self._opened is not None
        return self._opened

    def _is_same(self, opened: Opened | None) -> bool:
        try:
            return opened is not None and opened.identity == _identity(self.path)
        except (OSError, DatabaseError):
            return False

    def _end_questions(self) -> None:
        for cursor in self._cursors:
            cursor.interrupt()
        self._changed.wait(_SECONDS_BETWEEN_LOOKS)

    def _replaced(self) -> ReplacedError:
        return ReplacedError(
            f"the database was replaced while the page was open — {self.path}",
            "reload the page to see the new one",
        )

    def close(self) -> None:
        """Close the database."""
        with self._changed:
            while self._cursors:
                self._end_questions()
            if self._opened is not None:
                self._opened.close()
                self._opened = None


def _identity(path: Path) -> Identity:
    try:
        stat = path.stat()
    except FileNotFoundError:
        raise DatabaseError(f"no database — {path}", "msgflow ingest TRACE") from None
    return Identity(stat.st_dev, stat.st_ino, stat.st_mtime_ns, stat.st_size)


def application(shared: Shared, token: str) -> ASGIApp:
    """Return the application: pages and their data, for requests with the token.

    Args:
        shared: the database.
        token: of the printed address.
    """
    limiter: list[anyio.CapacityLimiter] = []

    async def page(request: Request) -> Response:
        with suppress(MsgflowError):  # the page asks too, and shows the error
            await anyio.to_thread.run_sync(shared.renew)
        content = assets.page(
            head=_head(), attributes=f' data-generation="{html.escape(str(shared.generation))}"'
        )
        return Response(content, media_type="text/html")

    async def file(request: Request) -> Response:
        name = request.path_params["name"]
        if not _FILE.fullmatch(name):
            return PlainTextResponse("not found", status_code=404)
        if name in (*assets.SCRIPTS, *assets.SHEETS):
            content = assets.vendored(name)
        elif name in assets.modules() or name == "style.css":
            content = assets.text(name)
        else:
            return PlainTextResponse("not found", status_code=404)
        return Response(content, media_type=_TYPES[name[name.rindex(".") :]])

    async def data(request: Request) -> Response:
        if not limiter:
            limiter.append(anyio.CapacityLimiter(MOST_AT_ONCE))
        try:
            return await _answered(shared, request, limiter[0])
        except ReplacedError as error:
            return _failure(error, 409, "replaced")
        except UnopenedError as error:
            return _failure(error, 503, "failed")
        except UsageError as error:
            return _failure(error, 400, "usage")
        except MsgflowError as error:
            return _failure(error, 500, "failed")
        except duckdb.Error as error:
            return JSONResponse(
                {"error": first_line(error), "hint": None, "code": "failed"}, status_code=500
            )

    app = Starlette(
        routes=[
            Route("/", page),
            Route("/{name}", file),
            Route("/api/{name}", data),
        ]
    )
    return Guard(app, token)


def single_application(make: Callable[[], str], token: str) -> ASGIApp:
    """Return the application of one page with its data inside, made again at each load.

    Args:
        make: returns the page, which names its scripts in a policy of its own.
        token: of the printed address.
    """

    async def page(request: Request) -> Response:
        try:
            content = await anyio.to_thread.run_sync(make)
        except MsgflowError as error:
            hint = f"\n\nhint: {error.hint}" if error.hint else ""
            return PlainTextResponse(f"error: {error.message}{hint}\n", status_code=500)
        return Response(content, media_type="text/html")

    return Guard(Starlette(routes=[Route("/", page)]), token, _POLICY_OF_FILES)


def serve_single(
    make: Callable[[], str],
    *,
    port: int | None = None,
    started: Callable[[str], None] = lambda address: None,
) -> None:
    """Serve one page with its data inside until Ctrl-C.

    Args:
        make: returns the page; called whenever it is loaded.
        port: of 127.0.0.1; 0 takes any that is free, None the usual one or else any.
        started: called with the address, which has the token, once it can be opened.

    Raises:
        UsageError: the port is in use.
    """
    with listening(port, lambda token: single_application(make, token)) as (
        server, listener, address,
    ):  # fmt: skip
        started(address)
        server.run(sockets=[listener])


async def _answered(shared: Shared, request: Request, limiter: anyio.CapacityLimiter) -> Response:
    """Return the answer; interrupt the query when the browser no longer waits for it."""
    name = request.path_params["name"]
    params: dict[str, Any] = dict(request.query_params)
    generation = request.headers.get("X-Generation")
    asked: list[duckdb.DuckDBPyConnection] = []
    content: list[bytes] = []

    async def watch() -> None:
        while not await request.is_disconnected():
            await anyio.sleep(_SECONDS_BETWEEN_LOOKS)
        # Repeatedly, since between two statements there is nothing to interrupt.
        while True:
            for cursor in asked:
                with suppress(duckdb.Error):  # it has just ended
                    cursor.interrupt()
            await anyio.sleep(_SECONDS_BETWEEN_LOOKS)

    try:
        async with anyio.create_task_group() as group:
            group.start_soon(watch)
            content.append(
                await anyio.to_thread.run_sync(
                    lambda: shared.answer(name, params, generation, asked.append), limiter=limiter
                )
            )
            group.cancel_scope.cancel()
    except BaseExceptionGroup as errors:
        # A group of one: what the query raised.
        raise errors.exceptions[0] from None
    return Response(content[0], media_type="application/octet-stream")


def _failure(error: MsgflowError, status: int, code: str) -> Response:
    return JSONResponse(
        {"error": error.message, "hint": error.hint, "code": code}, status_code=status
    )


def _head() -> str:
    sheets = "".join(
        f'<link rel="stylesheet" href="{name}">\n' for name in (*assets.SHEETS, "style.css")
    )
    scripts = "".join(f'<script src="{name}" defer></script>\n' for name in assets.SCRIPTS)
    return f'{sheets}{scripts}<script type="module" src="{assets.ENTRY}"></script>'


class Guard:
    """A guard: it passes on requests with the token, from our own page, to this machine."""

    def __init__(self, app: ASGIApp, token: str, policy: str = _POLICY) -> None:
        self._app = app
        self._token = token
        self._headers = _HEADERS | {"Content-Security-Policy": policy}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer, refuse, or pass on."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        from starlette.requests import Request

        request = Request(scope, receive)
        refusal = self._refusal(request)
        if refusal is not None:
            await _with_headers(refusal)(scope, receive, send)
            return

        async def send_with_headers(message: Any) -> None:
            if message["type"] == "http.response.start":
                known = [(k.lower().encode(), v.encode()) for k, v in self._headers.items()]
                message["headers"] = [*message["headers"], *known]
            await send(message)

        await self._app(scope, receive, send_with_headers)

    def _refusal(self, request: Request) -> Response | None:
        if not is_local(request.headers.get("host", "")):
            return PlainTextResponse(
                "error: this server answers for this machine alone\n", status_code=421
            )
        if request.method not in ("GET", "HEAD"):
            return PlainTextResponse("error: nothing can be changed here\n", status_code=405)
        if request.headers.get("sec-fetch-site", "none") not in ("none", "same-origin"):
            # A link on any site may lead to the page; the browser then sends no cookie.
            is_visit = request.headers.get("sec-fetch-mode") == "navigate"
            if not (is_visit and request.url.path == "/"):
                return PlainTextResponse("error: another site asks\n", status_code=403)
        port = request.url.port or 80
        cookie = f"msgflow_{port}"
        given = request.query_params.get("token")
        if given is not None and request.url.path == "/":
            if not _same(given, self._token):
                return _unknown()
            response = RedirectResponse("/", status_code=303)
            response.set_cookie(cookie, self._token, httponly=True, samesite="strict", path="/")
            return response
        if not _same(request.cookies.get(cookie, ""), self._token):
            return _unknown()
        return None


def _with_headers(response: Response) -> Response:
    for name, value in _HEADERS.items():
        response.headers[name] = value
    return response


def _unknown() -> Response:
    return PlainTextResponse(
        "error: this page needs the address that msgflow ui printed, with its token\n",
        status_code=403,
    )


def _same(given: str, token: str) -> bool:
    return hmac.compare_digest(given.encode(), token.encode())


def is_local(host: str) -> bool:
    """Tell whether the Host header of a request names this machine, at any port."""
    match = re.fullmatch(r"(\[[0-9a-fA-F:.]+\]|[^:\[\]]+)(?::\d{1,5})?", host)
    if match is None:
        return False
    name = match[1].lower()
    if name in _LOCAL_NAMES:
        return True
    try:
        return ipaddress.ip_address(name.strip("[]")).is_loopback
    except ValueError:
        return False


def listen(port: int | None) -> socket.socket:
    """Return a socket that listens on this machine alone.

    Args:
        port: which; 0 takes any that is free, None the usual one or else any.

    Raises:
        UsageError: it is in use, or not allowed.
    """
    wanted = DEFAULT_PORT if port is None else port
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((HOST, wanted))
        listener.listen(128)
    except OSError as error:
        listener.close()
        if port is None:
            return listen(0)
        reason = (error.strerror or str(error)).lower()
        raise UsageError(
            f"cannot listen on the port: {reason} — {wanted}",
            "give another --port, or none: then a free one is taken",
        ) from error
    return listener


def serve(
    path: Path,
    *,
    port: int | None = None,
    memory_limit: str | None = None,
    started: Callable[[str], None] = lambda address: None,
) -> None:
    """Serve the pages of a database until Ctrl-C.

    Args:
        path: the database.
        port: of 127.0.0.1; 0 takes any that is free, None the usual one or else any.
        memory_limit: most memory that DuckDB takes, such as '1GB'; when None a quarter of that of
            the machine, at least 500 MB and at most 4 GB.
        started: called with the address, which has the token, once it can be opened.

    Raises:
        DatabaseError: the file is missing, locked, foreign, or of another schema revision.
        UsageError: the port is in use.
    """
    with running(path, port=port, memory_limit=memory_limit) as (server, listener, address):
        started(address)
        server.run(sockets=[listener])


@contextmanager
def running(
    path: Path, *, port: int | None, memory_limit: str | None
) -> Iterator[tuple[uvicorn.Server, socket.socket, str]]:
    """Prepare a server; see `serve`."""
    shared = Shared(path, memory_limit)
    try:
        with listening(port, lambda token: application(shared, token)) as server:
            yield server
    finally:
        shared.close()


@contextmanager
def listening(
    port: int | None, make: Callable[[str], ASGIApp]
) -> Iterator[tuple[uvicorn.Server, socket.socket, str]]:
    """Prepare a server of the application that `make` returns for a token."""
    listener = listen(port)
    token = secrets.token_urlsafe(24)
    address = f"http://{HOST}:{listener.getsockname()[1]}/?token={token}"
    config = uvicorn.Config(
        timed(make(token)), log_level="error", access_log=False, lifespan="off", ws="none",
        timeout_graceful_shutdown=1, server_header=False, proxy_headers=False, http=Connection,
    )  # fmt: skip
    with listener:
        yield uvicorn.Server(config), listener, address
