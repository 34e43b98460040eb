"""The front end as files: what is ours can be joined, what is not is what it says it is."""

from __future__ import annotations

import hashlib
import json
import re
from collections import Counter
from pathlib import Path

from msgflow.view import assets

_DECLARED = re.compile(
    r"^(?:export )?(?:async )?(?:function\*?|class|const|let) (?:(\w+)|\[)", re.MULTILINE
)
# Each with words of its text.
_LICENCES = {
    "MIT": "Permission is hereby granted",
    "Apache-2.0 AND ISC AND BSD-3-Clause": "Apache License",
}
ROOT = Path(__file__).resolve().parents[2]
_ADDRESS = re.compile(r"https?://[\w./-]+")
# The name of a name space of XML looks like an address; browsers do not ask for it.
_NAME_SPACES = {"http://www.w3.org/2000/svg"}


def libraries() -> list[dict[str, object]]:
    listed: list[dict[str, object]] = json.loads((assets.VENDOR / "libraries.json").read_text())
    return listed


def test_libraries_are_those_that_are_listed() -> None:
    files: dict[str, str] = {}
    for library in libraries():
        files |= library["files"]  # type: ignore[operator]
        files[str(library["licence_file"])] = str(library["licence_sha256"])
        licence = (assets.VENDOR / str(library["licence_file"])).read_text()
        assert _LICENCES[str(library["licence"])] in licence
        assert re.fullmatch(r"\d+\.\d+\.\d+", str(library["version"]))
        packages: dict[str, dict[str, str]] = library["packages"]  # type: ignore[assignment]
        for package in packages.values():
            assert re.fullmatch(r"\d+\.\d+\.\d+", package["version"])
            assert package["integrity"].startswith("sha512-")
    assert files.keys() | {"libraries.json"} == {path.name for path in assets.VENDOR.iterdir()}
    for name, digest in files.items():
        assert hashlib.sha256((assets.VENDOR / name).read_bytes()).hexdigest() == digest, name
    assert {*assets.SCRIPTS, *assets.SHEETS, *assets.IMPORTED} <= files.keys()


def test_bundles_are_made_of_what_is_listed() -> None:
    for folder, library in (("codemirror", "CodeMirror"), ("flamegraph", "d3-flame-graph")):
        made = json.loads((ROOT / "packaging" / folder / "package.json").read_text())
        (listed,) = (one["packages"] for one in libraries() if one["name"] == library)
        packages: dict[str, dict[str, str]] = listed  # type: ignore[assignment]
        assert made["dependencies"] == {name: one["version"] for name, one in packages.items()}


def test_every_module_is_used() -> None:
    assert set(assets.modules()) == {path.name for path in assets.STATIC.glob("*.js")}


def test_modules_can_be_joined() -> None:
    names = Counter(
        name for module in assets.modules() for name in _DECLARED.findall(assets.text(module))
    )
    assert not [name for name, number in names.items() if number > 1 and name]
    assert not re.search(r"^(?:import|export)\b", assets.joined(), re.MULTILINE)
    assert "</script" not in assets.joined().lower()


def test_nothing_is_fetched_from_anywhere() -> None:
    for path in assets.STATIC.iterdir():
        found = set(_ADDRESS.findall(path.read_text())) - _NAME_SPACES
        assert not found, path.name
        assert "@import" not in path.read_text()


def test_nothing_makes_markup_of_text() -> None:
    for module in assets.modules():
        for word in ("innerHTML", "outerHTML", "insertAdjacentHTML", "document.write", "eval("):
            assert word not in assets.text(module), module
