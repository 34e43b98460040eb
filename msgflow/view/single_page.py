"""A page with its data inside: one file that any browser opens, without a server."""

from __future__ import annotations

import base64
import gzip
import json
from dataclasses import dataclass, field
from typing import Any

from msgflow.view import assets

_POLICY = (
    "default-src 'none'; script-src {scripts}; style-src {styles}; img-src data:;"
    " base-uri 'none'; form-action 'none'"
)


@dataclass
class Parts:
    """Data of a page: the answers to what it may ask, each under its question."""

    keys: list[dict[str, Any]] = field(default_factory=list)
    buffers: list[bytes] = field(default_factory=list)

    def add(self, key: str, content: bytes) -> None:
        """Keep the answer to a question."""
        self.keys.append({"key": key, "length": len(content)})
        self.buffers.append(content)

    def pack(self, head: dict[str, Any]) -> bytes:
        """Return all answers, compressed."""
        text = json.dumps(head | {"parts": self.keys}, ensure_ascii=False).encode()
        content = b"".join([len(text).to_bytes(4, "little"), text, *self.buffers])
        return gzip.compress(content, compresslevel=6, mtime=0)


def single_page(parts: Parts, head: dict[str, Any]) -> str:
    """Return the page."""
    packed = base64.b64encode(parts.pack(head)).decode()
    scripts = [*(assets.vendored(name) for name in assets.SCRIPTS), assets.joined()]
    styles = [*(assets.vendored(name) for name in assets.SHEETS), assets.text("style.css")]
    policy = _POLICY.format(
        scripts=" ".join(map(assets.source_hash, scripts)),
        styles=" ".join(map(assets.source_hash, styles)),
    )
    # The browser runs scripts at the end of the page, behind the data.
    body = [f'<script type="application/octet-stream" id="msgflow-data">{packed}</script>']
    body += [f"<script>{script}</script>" for script in scripts[:-1]]
    body.append(f'<script type="module">{scripts[-1]}</script>')
    return assets.page(
        head="\n".join(f"<style>{style}</style>" for style in styles),
        body="\n".join(body),
        policy=policy,
    )
