"""Files of the front end: modules, style sheets and libraries, and one page of all of them.

The modules use what every browser has, so nothing builds them. A report has them in one script:
each module after those that it imports, without the words `import` and `export`. So no name may
stand at the outermost level of two modules; a test checks that.
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import json
import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from string import Template
from typing import Any

STATIC = Path(__file__).parent / "static"
VENDOR = Path(__file__).parent / "vendor"
ENTRY = "app.js"
# Libraries of others: each script defines one global name; see vendor/libraries.json.
SCRIPTS = ("uPlot.iife.min.js", "dagre.min.js")
SHEETS = ("uPlot.min.css",)
# Libraries that a page of the server imports when it is opened; a report has none of them.
IMPORTED = ("codemirror.min.js", "flamegraph.min.js")
_IMPORT = re.compile(r'^import\s+\{[^}]*\}\s+from\s+"\./([\w-]+\.js)";\n', re.MULTILINE)
_EXPORT = re.compile(r"^export (?=(?:async function|function|class|const|let)\b)", re.MULTILINE)
_SOURCE_MAP = re.compile(r"^//# sourceMappingURL=.*$", re.MULTILINE)

_POLICY = (
    "default-src 'none'; script-src {scripts}; style-src {styles}; img-src data:;"
    " base-uri 'none'; form-action 'none'"
)


@cache
def modules() -> tuple[str, ...]:
    """Return the names of the modules, each after those that it imports."""
    ordered: list[str] = []

    def visit(name: str) -> None:
        if name in ordered:
            return
        for needed in _IMPORT.findall(text(name)):
            visit(needed)
        ordered.append(name)

    visit(ENTRY)
    return tuple(ordered)


def text(name: str) -> str:
    """Return a file of the front end."""
    return (STATIC / name).read_text(encoding="utf-8")


def vendored(name: str) -> str:
    """Return a library, without the address of a map that is not here."""
    return _SOURCE_MAP.sub("", (VENDOR / name).read_text(encoding="utf-8")).strip() + "\n"


def joined() -> str:
    """Return all modules as one."""
    parts = [_EXPORT.sub("", _IMPORT.sub("", text(name))) for name in modules()]
    return '"use strict";\n' + "\n".join(parts)


def page(*, head: str, body: str = "", policy: str = "", attributes: str = "") -> str:
    """Return the page around the front end."""
    meta = f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n' if policy else ""
    return Template(text("page.html")).substitute(
        head=head, body=body, policy=meta, attributes=attributes
    )


def source_hash(content: str) -> str:
    """Return the name of an inline script or style sheet in a Content-Security-Policy."""
    digest = hashlib.sha256(content.encode()).digest()
    return f"'sha256-{base64.b64encode(digest).decode()}'"


def single_page(parts: Mapping[str, bytes], head: Mapping[str, Any]) -> str:
    """Return a page with its data inside: one file that any browser opens, without a server.

    `parts` are the answers to what it may ask, each under its question.
    """
    lengths = [{"key": key, "length": len(content)} for key, content in parts.items()]
    text_of_head = json.dumps({**head, "parts": lengths}, ensure_ascii=False).encode()
    content = b"".join([len(text_of_head).to_bytes(4, "little"), text_of_head, *parts.values()])
    packed = base64.b64encode(gzip.compress(content, compresslevel=6, mtime=0)).decode()
    scripts = [*(vendored(name) for name in SCRIPTS), joined()]
    styles = [*(vendored(name) for name in SHEETS), text("style.css")]
    policy = _POLICY.format(
        scripts=" ".join(map(source_hash, scripts)), styles=" ".join(map(source_hash, styles))
    )
    # The browser runs scripts at the end of the page, behind the data.
    body = [f'<script type="application/octet-stream" id="msgflow-data">{packed}</script>']
    body += [f"<script>{script}</script>" for script in scripts[:-1]]
    body.append(f'<script type="module">{scripts[-1]}</script>')
    return page(
        head="\n".join(f"<style>{style}</style>" for style in styles),
        body="\n".join(body),
        policy=policy,
    )
