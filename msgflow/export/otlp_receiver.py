"""Receiver of traces: it takes them as OTLP/HTTP, in the binary form of protobuf."""

from __future__ import annotations

import os
import time
import urllib.error
import urllib.request
from http.client import HTTPException
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote, urlsplit

from msgflow.errors import UsageError
from msgflow.version import __version__

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from urllib.parse import SplitResult

_PATH = "/v1/traces"
# All programs that send OTLP read their additional headers there, such as those with a key.
_HEADERS = "OTEL_EXPORTER_OTLP_HEADERS"
# Too many requests, and what is wrong only now: the protocol says that these are sent again.
_AGAIN = (429, 502, 503, 504)
_WAITS_S = (0.5, 1, 2, 4)
_TIMEOUT_S = 60


class Receiver:
    """A collector, or a program that stores traces.

    Args:
        address: 'http://HOST:4318'; with a path, that of the traces.

    Raises:
        UsageError: this is no address, or the package opentelemetry-proto is not installed.
    """

    def __init__(self, address: str) -> None:
        parts = _parts(address)
        if parts is None:
            raise UsageError(
                f"that is no address of a receiver — {address}", "--endpoint http://localhost:4318"
            )
        try:
            from google.protobuf.message import DecodeError
            from opentelemetry.proto.collector.trace.v1 import trace_service_pb2
            from opentelemetry.proto.trace.v1 import trace_pb2
        except ImportError:
            raise UsageError(
                "the package with the messages of OTLP is not installed — opentelemetry-proto",
                "pip install opentelemetry-proto; or in a checkout of msgflow:"
                " uv tool install '.[otlp]'",
            ) from None
        self._request = trace_service_pb2.ExportTraceServiceRequest
        self._response = trace_service_pb2.ExportTraceServiceResponse
        self._spans = trace_pb2.ResourceSpans
        self._decode_error = DecodeError
        path = parts.path.rstrip("/") or _PATH
        self._address = parts._replace(path=path).geturl()
        self._headers = {
            "Content-Type": "application/x-protobuf",
            "User-Agent": f"msgflow/{__version__}",
            **_given_headers(os.environ),
        }

    def send(self, spans: Sequence[Mapping[str, Any]]) -> int:
        """Send spans; return how many the receiver rejected.

        Args:
            spans: the fields of a `ResourceSpans` each.

        Raises:
            UsageError: the receiver cannot be reached, or does not take them.
        """
        body = self._request(resource_spans=[self._spans(**each) for each in spans])
        content = self._post(body.SerializeToString())
        try:
            answer = self._response.FromString(content)
        except self._decode_error as error:
            raise self._no_receiver() from error
        return int(answer.partial_success.rejected_spans)

    def _post(self, body: bytes) -> bytes:
        request = urllib.request.Request(self._address, body, self._headers, method="POST")
        for wait_s in (*_WAITS_S, None):
            try:
                with urllib.request.urlopen(request, timeout=_TIMEOUT_S) as answer:
                    return answer.read()  # type: ignore[no-any-return]
            except urllib.error.HTTPError as error:
                if error.code not in _AGAIN or wait_s is None:
                    raise UsageError(
                        f"the receiver does not take traces: {error.code} {error.reason}"
                        f" — {self._address}",
                        f"its address ends with {_PATH}, as a rule; keys go into {_HEADERS}",
                    ) from error
                time.sleep(wait_s)
            except HTTPException as error:
                raise self._no_receiver() from error
            except OSError as error:
                reason = getattr(error, "reason", error)
                raise UsageError(
                    f"the receiver cannot be reached: {reason} — {self._address}",
                    "start it, or give the address where it takes OTLP/HTTP",
                ) from error
        raise AssertionError("the last try returns or raises")

    def _no_receiver(self) -> UsageError:
        return UsageError(
            f"what answers there is no receiver of OTLP/HTTP — {self._address}",
            "its port is 4318, as a rule; 4317 is that of gRPC",
        )


def _parts(address: str) -> SplitResult | None:
    """Return the parts of an HTTP address; None for any other text."""
    try:
        parts = urlsplit(address)
        port = parts.port
    except ValueError:
        return None
    return parts if parts.scheme in ("http", "https") and parts.hostname and port != 0 else None


def _given_headers(environment: Mapping[str, str]) -> dict[str, str]:
    pairs = (each.partition("=") for each in environment.get(_HEADERS, "").split(",") if each)
    return {unquote(name).strip(): unquote(value).strip() for name, _, value in pairs}
