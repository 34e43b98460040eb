"""Python runs this when it starts, if its folder is on PYTHONPATH: nodes of rclpy are traced.

It runs in programs of others, with any Python from 2.7 on; those before 3.8 are not traced. It
changes nothing until `rclpy` is imported, and what goes wrong in it is one line on stderr. A
`sitecustomize` that would have run without this folder runs as well.
"""

import os
import sys

_TRACER = "_msgflow_rclpy"


class _Finder:
    """Finds modules of rclpy as Python would, and has the tracer wrap them once they are loaded."""

    def __init__(self, folder):
        self._folder = folder
        self._wrappers = {"rclpy.executors": "wrap_executors", "rclpy.node": "wrap_node"}

    def find_spec(self, name, path=None, target=None):
        if name not in self._wrappers:
            return None
        try:
            spec = self._found(name, path, target)
            if spec is not None:
                self._load_with(spec.loader)
            return spec
        except Exception as error:
            self._wrappers.clear()
            _say(error)
            return None

    def _found(self, name, path, target):
        for finder in sys.meta_path:
            find = None if finder is self else getattr(finder, "find_spec", None)
            spec = find and find(name, path, target)
            if spec is not None:
                return spec
        return None

    def _load_with(self, loader):
        load = loader.exec_module

        def load_and_wrap(module):
            load(module)
            try:
                # It may have been found several times.
                wrapper = self._wrappers.pop(module.__name__, None)
                if wrapper is not None:
                    getattr(self._tracer(), wrapper)(module)
            except Exception as error:
                self._wrappers.clear()
                _say(error)

        loader.exec_module = load_and_wrap

    def _tracer(self):
        if _TRACER not in sys.modules:
            from importlib.util import module_from_spec, spec_from_file_location

            place = os.path.join(self._folder, _TRACER + ".py")
            spec = spec_from_file_location(_TRACER, place)
            module = module_from_spec(spec)
            spec.loader.exec_module(module)
            sys.modules[_TRACER] = module
        return sys.modules[_TRACER]


def _say(error):
    try:
        sys.stderr.write(
            "msgflow: this process runs without traced callbacks: "
            + (str(error) or type(error).__name__).splitlines()[0]
            + "\n"
        )
    except Exception:
        pass


def _is_of_tracer(entry):
    """Tell whether a folder has a tracer: this one by another path, or that of another msgflow."""
    return bool(entry) and os.path.exists(os.path.join(entry, _TRACER + ".py"))


def _begin():
    """Leave the search path as it would be without this folder, and wait for rclpy."""
    sys.path[:] = [entry for entry in sys.path if not _is_of_tracer(entry)]
    # With rights that its user lacks, a program runs nothing that this user's environment names.
    if sys.version_info >= (3, 8) and (os.getuid(), os.getgid()) == (os.geteuid(), os.getegid()):
        # A process has one tracer.
        kinds = [(kind.__module__, kind.__name__) for kind in map(type, sys.meta_path)]
        if (_Finder.__module__, _Finder.__name__) not in kinds:
            sys.meta_path.insert(0, _Finder(os.path.dirname(os.path.abspath(__file__))))


def _run_other():
    """Run the `sitecustomize` behind this one; its errors are Python's to tell, as ever."""
    try:
        from importlib.machinery import PathFinder
        from importlib.util import module_from_spec
    except ImportError:  # Python 2
        import imp

        try:
            found = imp.find_module("sitecustomize")
        except ImportError:
            return
        imp.load_module("sitecustomize", *found)
        return
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
