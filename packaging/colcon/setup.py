"""msgflow as a package of a colcon workspace, from the sources above this directory.

colcon cannot read a pyproject.toml that names the Python it requires: this directory has none.
"""

import os
import sys
from pathlib import Path

from setuptools import setup

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path("../..")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
SOURCES = {"msgflow": "msgflow"}
SOURCES |= PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"]
VERSION: dict[str, str] = {}
exec((ROOT / "msgflow" / "version.py").read_text(encoding="utf-8"), VERSION)


def entry_points(given: dict[str, str]) -> list[str]:
    """Return entry points as setuptools takes them."""
    return [f"{name} = {target}" for name, target in given.items()]


# Directories with files, by the name of the package that they are in.
packages = {
    directory.replace(source, target, 1).replace("/", "."): f"../../{directory}"
    for source, target in SOURCES.items()
    for path, _, files in os.walk(ROOT / source)
    if files and not path.endswith("__pycache__")
    for directory in [os.path.relpath(path, ROOT)]
}
setup(
    name="ros2msgflow",
    version=VERSION["__version__"],
    packages=sorted(packages),
    package_dir=packages,
    package_data={"": ["*"]},
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/ros2msgflow"]),
        ("share/ros2msgflow", ["package.xml"]),
    ],
    entry_points={
        "console_scripts": entry_points(PROJECT["project"]["scripts"]),
        "ros2cli.command": entry_points(PROJECT["project"]["entry-points"]["ros2cli.command"]),
    },
    zip_safe=False,
)
