"""Python runs this when it starts, if its folder is on PYTHONPATH: nodes of rclpy are traced.

It runs in programs of others, with Python 3.8 and later: it changes nothing until `rclpy` is
imported, and what goes wrong in it is one line on stderr. A `sitecustomize` that would have run
without this folder runs as well.
"""

import os
import sys


class _Finder:
    """Finds modules of rclpy as Python would, and has the tracer wrap them once they are loaded."""

    def __init__(self, folder):
        self._folder = folder
        self._wrappers = {"rclpy.executors": "wrap_executors", "rclpy.node": "wrap_node"}

    def find_spec(self, name, path=None, target=None):
        if name not in self._wrappers:
            return None
        wrapper = self._wrappers.pop(name)
        try:
            spec = self._found(name, path, target)
            self._load_with(spec.loader, wrapper)
        except Exception as error:
            self._wrappers.clear()
            _say(error)
            return None
        return spec

    def _found(self, name, path, target):
        for finder in sys.meta_path:
            find = None if finder is self else getattr(finder, "find_spec", None)
            spec = find and find(name, path, target)
            if spec is not None:
                return spec
        raise ImportError("no " + name)

    def _load_with(self, loader, wrapper):
        load = loader.exec_module

        def load_and_wrap(module):
            del loader.exec_module
            load(module)
            try:
                getattr(self._tracer(), wrapper)(module)
            except Exception as error:
                self._wrappers.clear()
                _say(error)

        loader.exec_module = load_and_wrap

    def _tracer(self):
        name = "_msgflow_rclpy"
        if name not in sys.modules:
            from importlib.util import module_from_spec, spec_from_file_location

            spec = spec_from_file_location(name, os.path.join(self._folder, name + ".py"))
            module = module_from_spec(spec)
            spec.loader.exec_module(module)
            sys.modules[name] = module
        return sys.modules[name]


def _say(error):
    try:
        sys.stderr.write(
            "msgflow: this process runs without traced callbacks: "
            + (str(error) or type(error).__name__).splitlines()[0]
            + "\n"
        )
    except Exception:
        pass


def _begin():
    """Leave the search path as it would be without this folder, and wait for rclpy."""
    folder = os.path.dirname(os.path.abspath(__file__))
    sys.path[:] = [entry for entry in sys.path if not entry or os.path.abspath(entry) != folder]
    # With rights that its user lacks, a program runs nothing that this user's environment names.
    if (os.getuid(), os.getgid()) == (os.geteuid(), os.getegid()):
        sys.meta_path.insert(0, _Finder(folder))


def _run_other():
    """Run the `sitecustomize` behind this one; its errors are Python's to tell, as ever."""
    from importlib.machinery import PathFinder
    from importlib.util import module_from_spec

    spec = PathFinder.find_spec("sitecustomize")
    if spec is not None and spec.loader is not None and spec.origin != __file__:
        module = module_from_spec(spec)
        sys.modules["sitecustomize"] = module
        spec.loader.exec_module(module)


try:
    _begin()
except Exception as _error:
    _say(_error)
_run_other()
