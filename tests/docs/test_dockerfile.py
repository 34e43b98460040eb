"""The Dockerfile copies all files of a wheel, and the user of the container is not root."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from msgflow.backports import tomllib

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "Dockerfile").read_text("utf-8")


def copied() -> set[str]:
    lines = re.findall(r"^COPY (?!--from)(.+)$", TEXT, re.MULTILINE)
    return {source for line in lines for source in line.split()[:-1]}


def test_it_copies_what_is_let_through_and_no_more() -> None:
    lines = (ROOT / ".dockerignore").read_text("utf-8").splitlines()
    assert {line[1:] for line in lines if line.startswith("!")} == copied()
    assert "*" in lines


def test_a_wheel_can_be_made_of_it(tmp_path: Path) -> None:
    for name in copied():
        source = ROOT / name
        if source.is_dir():
            ignored = shutil.ignore_patterns("__pycache__")
            shutil.copytree(source, tmp_path / name, ignore=ignored)
        else:
            (tmp_path / name).parent.mkdir(exist_ok=True)
            shutil.copy(source, tmp_path / name)
    with (tmp_path / "pyproject.toml").open("rb") as stream:
        included = tomllib.load(stream)["tool"]["hatch"]["build"]["targets"]["wheel"]
    assert {*included["packages"], *included["force-include"]} <= copied()
    code = "import sys; sys.path.insert(0, 'packaging'); import checked_hatchling as backend; "
    code += "print(backend.build_wheel('.'))"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert (tmp_path / done.stdout.split()[-1]).is_file()


def test_it_runs_msgflow_as_nobody_special() -> None:
    final = TEXT.rpartition("\nFROM ")[2]
    assert re.search(r"^USER (?!root|0)\w+$", final, re.MULTILINE)
    assert 'ENTRYPOINT ["msgflow"]' in final


def test_what_others_wrote_is_pinned_by_its_hash() -> None:
    """Images, packages and actions: a name or a branch may be something else tomorrow."""
    images = re.findall(r"^FROM (\S+)", TEXT, re.MULTILINE)
    assert len(images) == 2
    assert all(re.search(r"@sha256:[0-9a-f]{64}$", image) for image in images)
    installs = re.findall(r"pip install (.+)", TEXT)
    assert len(installs) == 3
    assert all("--require-hashes" in words or "--no-deps dist/" in words for words in installs)
    texts = [path.read_text("utf-8") for path in (ROOT / ".github" / "workflows").glob("*.yml")]
    used = [name for text in texts for name in re.findall(r"uses: (\S+)", text)]
    assert len(used) > 10
    assert [name for name in used if not re.search(r"@[0-9a-f]{40}$", name)] == []


def test_what_is_locked_is_what_the_project_needs() -> None:
    for file, table in (("image.txt", "project"), ("build.txt", "build-system")):
        text = (ROOT / "packaging" / file).read_text("utf-8")
        locked = dict(re.findall(r"^([a-z0-9.-]+)==(\S+)", text, re.MULTILINE))
        wanted = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))[table]
        for need in map(Requirement, wanted.get("dependencies", wanted.get("requires"))):
            if need.marker is None or need.marker.evaluate({"python_version": "3.12"}):
                assert need.specifier.contains(locked[canonicalize_name(need.name)]), need
