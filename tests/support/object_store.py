"""An S3-compatible store for tests: moto's server, which can be made to refuse requests."""

from __future__ import annotations

import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

KEYS = {
    "AWS_ACCESS_KEY_ID": "AKIATESTTESTTESTTEST",
    "AWS_SECRET_ACCESS_KEY": "a-secret-that-must-not-be-written",
    "AWS_DEFAULT_REGION": "us-east-1",
}


class ObjectStore:
    """A server with one bucket.

    Attributes:
        url: of the server, for AWS_ENDPOINT_URL.
        refuse_every: of so many requests one is refused; 0: none.
        refused: requests that were refused.
    """

    def __init__(self) -> None:
        from moto.moto_server.werkzeug_app import DomainDispatcherApplication, create_backend_app
        from werkzeug.serving import make_server

        self.refuse_every = 0
        self.refused = 0
        self._count = 0
        self._lock = threading.Lock()
        self._application = DomainDispatcherApplication(create_backend_app)
        self._server = make_server("127.0.0.1", 0, self._answer, threaded=True)
        self.url = f"http://127.0.0.1:{self._server.server_port}"
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)

    def _answer(self, environ: dict[str, Any], start_response: Any) -> Iterable[bytes]:
        with self._lock:
            self._count += 1
            is_refused = bool(self.refuse_every) and self._count % self.refuse_every == 0
            self.refused += is_refused
        if is_refused:
            environ["wsgi.input"].read(int(environ.get("CONTENT_LENGTH") or 0))
            start_response("503 Slow Down", [("Content-Type", "application/xml")])
            return [b"<Error><Code>SlowDown</Code><Message>Slow down.</Message></Error>"]
        answer: Iterable[bytes] = self._application(environ, start_response)
        return answer

    def put(self, path: str, content: bytes) -> None:
        """Write an object: BUCKET/KEY."""
        from msgflow.fleet.file_store import Store

        Store(f"s3://{path.rpartition('/')[0]}").put(path.rpartition("/")[2], content)

    def start(self) -> None:
        """Begin to answer."""
        self._thread.start()

    def stop(self) -> None:
        """Answer no more."""
        self._server.shutdown()
        self._thread.join()
        self._server.server_close()


@contextmanager
def object_store(environment: Any, bucket: str = "fleet") -> Iterator[ObjectStore]:
    """Start a store with a bucket, and let the environment name it.

    Args:
        environment: a pytest.MonkeyPatch.
        bucket: its name.
    """
    import logging
    from urllib.request import Request, urlopen

    logging.getLogger("werkzeug").setLevel(logging.ERROR)
    store = ObjectStore()
    store.start()
    try:
        for name, value in {**KEYS, "AWS_ENDPOINT_URL": store.url}.items():
            environment.setenv(name, value)
        # What moto keeps belongs to the process, so a server finds what the one before it left.
        urlopen(Request(f"{store.url}/moto-api/reset", method="POST"), timeout=30).close()
        urlopen(Request(f"{store.url}/{bucket}", method="PUT"), timeout=30).close()
        yield store
    finally:
        store.stop()
