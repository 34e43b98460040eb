"""Emits for nodes of rclpy what rclcpp emits for its own: callbacks, timers, executors.

The tracepoints are functions of `libtracetools.so`, which rclpy has loaded. A robot runs this, with
Python 3.8 to 3.14 and rclpy 3 to 10: only the standard library is imported, and what goes wrong in
it turns it off for the process, in one line on stderr.

Events and fields are those of rclcpp. A callback is known by the handle of its subscription, timer
or service, or by a number of its own. Besides, `rclcpp_callback_register` says with symbols that
begin with `#msgflow`:

* `#msgflow python VERSION` of 0: this process is traced so.
* `#msgflow executor KIND` of an executor: the thread works for it.
* `#msgflow function NAME` of a number: a callback of no subscription, timer or service.
* `#msgflow source FILE:LINE` of a handle or number: where its function begins.
* `#msgflow step` of a number: something goes on later, because of what runs here.
* `#msgflow resume` of such a number: what goes on is the callback that begins next on the thread.
* `#msgflow job` of such a number: likewise, on a thread of no executor.
* `#msgflow cpu` of nanoseconds: so long the callback or step that has just ended had a CPU, by the
  clock of its thread.
* `#msgflow collect GENERATION` of nanoseconds: so long Python has just collected garbage on the
  thread.
* `#msgflow thread NAME` of 0: the name that Python has for the thread, before its first callback.
* `#msgflow off REASON` of 0: from here on this process is not traced so.

An interrupt that comes while Python collects garbage is raised in what runs next. Where that is the
function here, Python only prints it; rclpy shuts its context down all the same.
"""

import collections
import concurrent.futures
import ctypes
import functools
import gc
import inspect
import itertools
import os
import queue
import signal
import sys
import threading
import time
import weakref

# More functions than that are no callbacks of a node, but made by it: they share a number.
_MOST_FUNCTIONS = 10000
_LONGEST_SYMBOL = 500
# Events of rclcpp on objects with callbacks. The handle of the object is both their arguments.
_ANNOUNCED = {
    "Subscription": ("rclcpp_subscription_init", "rclcpp_subscription_callback_added"),
    "Timer": ("rclcpp_timer_callback_added",),
    "Service": ("rclcpp_service_callback_added",),
}
# What these modules run on threads goes on for many callbacks.
_MACHINERY = ("asyncio", "concurrent", "logging", "multiprocessing", "rclpy")
_NAMES = ("__module__", "__qualname__")
_KINDS = {"SingleThreadedExecutor": "single_threaded", "MultiThreadedExecutor": "multi_threaded"}

_is_on = True
# Whether a session records callbacks; asked for before each wait.
_is_recorded = True
_is_announced = False
# Counts sessions: each gets the names of threads.
_session = 1
# When the collection of garbage that goes on began; None if it is not recorded.
_collection_begin = None
_numbers = itertools.count(1)
# Numbers of functions that belong to no subscription, timer or service: by symbol, and by the
# callback for which they go on (0: none), as nodes of one class have the same functions.
_functions = {}
# By number, of these: symbol, source and callback.
_told = {}
# By the identity of their callback: subscriptions, timers and services.
_owners = weakref.WeakValueDictionary()
# Classes of actions, and of other things that take by themselves.
_waitables = set()
_originals = []


class _Thread(threading.local):
    """What a thread does."""

    # The latest event of its executor.
    state = None
    # The executor that it was said to work for.
    executor = None
    # The latest session that has its name.
    session = 0
    # It waits for work itself, as threads of a pool do not.
    is_spinning = False
    is_waiting = False
    # Tasks that run inside each other.
    depth = 0
    # Numbers of callbacks that run inside each other, or of a job of one.
    calls = ()
    # The job: its number, its step, the CPU time at its begin, whether it may get others, and the
    # queue from which it got one.
    job = None
    # The step in which what was got from a queue was put there, and the callback that did (0: none,
    # or one of this thread).
    handed = 0, 0
    # What the running task takes from.
    entity = None
    # The next callback is not for what was taken last.
    is_unclear = False
    # The number of the call that goes on here; 0: one that begins.
    step = 0


_thread = _Thread()


class _Tracepoints:
    """The functions of the library that this process has loaded."""

    def __init__(self):
        # Not released: no other thread gets to run because of an event.
        library = ctypes.PyDLL("libtracetools.so", mode=os.RTLD_NOLOAD | os.RTLD_NOW)
        pointer, text = ctypes.c_void_p, ctypes.c_char_p
        for name, types in (
            ("callback_start", (pointer, ctypes.c_bool)),
            ("callback_end", (pointer,)),
            ("rclcpp_subscription_init", (pointer, pointer)),
            ("rclcpp_subscription_callback_added", (pointer, pointer)),
            ("rclcpp_timer_callback_added", (pointer, pointer)),
            ("rclcpp_timer_link_node", (pointer, pointer)),
            ("rclcpp_service_callback_added", (pointer, pointer)),
            ("rclcpp_callback_register", (pointer, text)),
            ("rclcpp_executor_get_next_ready", ()),
            ("rclcpp_executor_wait_for_work", (ctypes.c_int64,)),
            ("rclcpp_executor_execute", (pointer,)),
        ):
            function = getattr(library, "ros_trace_" + name)
            function.argtypes, function.restype = types, None
            setattr(self, name, function)
        try:
            self.is_recorded = library.ros_trace_enabled_callback_start
        except AttributeError:  # Humble
            self.is_recorded = lambda: True
        else:
            self.is_recorded.argtypes, self.is_recorded.restype = (), ctypes.c_bool


def wrap_executors(executors):
    """Wrap what runs callbacks, and what callbacks belong to."""
    global _tracepoints
    try:
        _tracepoints = _Tracepoints()
        executor = executors.Executor
        _require(executor._make_handler, "self", "entity", "node", "take_from_wait_list")
        _require(executor.create_task, "self", "callback", "args")
        _require(executors.await_or_execute, "callback", "args")
        _require(executor.wait_for_ready_callbacks, "self", "args")
        _require(executors.Task.__call__, "self")
        _wrap(executors, "await_or_execute", _await_or_execute)
        _wrap(executor, "_make_handler", _make_handler)
        _wrap(executor, "create_task", _create_task)
        _wrap(executor, "wait_for_ready_callbacks", _wait_for_ready_callbacks)
        _wrap(executors.Task, "__call__", _run_task)
        _wrap(executors._rclpy.WaitSet, "wait", _wait)
        for kind in ("goal", "cancel", "result"):
            take = functools.partial(_take_answer, "_pending_%s_requests" % kind)
            _wrap(executors._rclpy.ActionClient, "take_%s_response" % kind, take)
        for name in _ANNOUNCED:
            module = sys.modules["rclpy." + name.lower()]
            # Lyrical: asyncio has others of the same base.
            owner = getattr(module, "Base" + name, None) or getattr(module, name)
            _wrap(owner, "__init__", functools.partial(_made, name))
        _wrap(concurrent.futures.ThreadPoolExecutor, "submit", _passes_on)
        _wrap(concurrent.futures.Future, "add_done_callback", _passes_on)
        _wrap(threading.Thread, "start", _starts)
        _wrap(queue.Queue, "_put", _puts)
        _wrap(queue.Queue, "_get", _got)
        _wrap(queue.Queue, "get", _gets)
        os.register_at_fork(after_in_child=_begin_anew)
        gc.callbacks.append(_collect)
    except Exception as error:
        _turn_off(error)


def wrap_node(node):
    """Wrap what makes timers."""
    if _is_on:
        try:
            _wrap(node.Node, "create_timer", _create_timer)
        except Exception as error:
            _turn_off(error)


def _pass_on_signal(error):
    """Raise what a signal handler of the program raised while it interrupted the tracer."""
    handlers = [_code_of(signal.getsignal(number)) for number in signal.valid_signals()]
    at = error.__traceback__
    while at is not None:
        if at.tb_frame.f_code in handlers:
            raise error
        at = at.tb_next


def _turn_off(error):
    """Leave rclpy as it was, and say why."""
    global _is_on, _is_recorded
    _pass_on_signal(error)
    if not _is_on:
        return
    _is_on = _is_recorded = False
    for owner, name, original, wrapper in reversed(_originals):
        # Another tool may have wrapped it since.
        if getattr(owner, name, None) is wrapper:
            setattr(owner, name, original)
    if _collect in gc.callbacks:
        gc.callbacks.remove(_collect)
    try:
        reason = (str(error) or type(error).__name__).splitlines()[0]
        if _is_announced:
            _register(0, "#msgflow off " + reason)
        sys.stderr.write("msgflow: this process runs without traced callbacks: %s\n" % reason)
    except Exception:
        pass


def _require(function, *names):
    if list(inspect.signature(function).parameters)[: len(names)] != list(names):
        raise TypeError("another rclpy: " + getattr(function, "__qualname__", repr(function)))


def _wrap(owner, name, make):
    original = getattr(owner, name)
    wrapper = make(original)
    functools.update_wrapper(wrapper, original)
    setattr(owner, name, wrapper)
    _originals.append((owner, name, original, wrapper))


# What a process is made of.


def _announce_process():
    global _is_announced
    _is_announced = True
    _register(0, "#msgflow python " + ".".join(map(str, sys.version_info[:3])))


def _register(number, symbol):
    text = symbol[:_LONGEST_SYMBOL].replace("\0", "\\0")
    _tracepoints.rclcpp_callback_register(number, text.encode("utf-8", "backslashreplace"))


def _register_callback(handle, callback):
    _register(handle, _symbol(callback))
    _register_source(handle, _source(callback))


def _register_source(number, source):
    if source:
        _register(number, "#msgflow source " + source)


def _source(callback):
    try:
        code = _code_of(callback)
    except Exception as error:
        _pass_on_signal(error)
        code = None
    return "%s:%d" % (code.co_filename, code.co_firstlineno) if inspect.iscode(code) else ""


def _code_of(callback):
    """Return the code of a function or frame; None if it is not of Python."""
    while isinstance(callback, functools.partial):
        callback = callback.func
    code = getattr(callback, "__code__", None) or getattr(callback, "f_code", None)
    # An object that can be called has the function of its class.
    return code or getattr(type(callback).__dict__.get("__call__"), "__code__", None)


def _begin_anew():
    """Let a process that was forked say itself what it is made of."""
    global _is_recorded, _is_announced
    _is_recorded = _is_announced = False


def _announce_again():
    """Tell a session that began just now what it has missed, as far as it is of Python."""
    global _session
    _session += 1
    _announce_process()
    _functions.clear()
    _thread.executor = None
    for owner in list(_owners.values()):
        _register_callback(owner._msgflow, owner.callback)


def _made(kind, original):
    def __init__(self, *args, **kwargs):
        original(self, *args, **kwargs)
        if _is_on:
            try:
                self._msgflow = self.handle.pointer
                self._msgflow_kind = kind
                _own(self)
            except Exception as error:
                _turn_off(error)

    return __init__


def _own(entity):
    """Tell which callback an object has; it may get another one later."""
    # Not before: rcl_init begins a process.
    if not _is_announced:
        _announce_process()
    callback = entity.callback
    if callback is not None:
        for name in _ANNOUNCED[entity._msgflow_kind]:
            getattr(_tracepoints, name)(entity._msgflow, entity._msgflow)
        _register_callback(entity._msgflow, callback)
        _owners[id(callback)] = entity
    entity._msgflow_callback = callback


def _create_timer(original):
    def create_timer(self, *args, **kwargs):
        timer = original(self, *args, **kwargs)
        if _is_on:
            try:
                _tracepoints.rclcpp_timer_link_node(timer.handle.pointer, self.handle.pointer)
            except Exception as error:
                _turn_off(error)
        return timer

    return create_timer


# How callbacks run.


def _await_or_execute(original):
    async def await_or_execute(callback, *args):
        number = _number_of(callback) if _is_recorded else None
        if number is None:
            return await original(callback, *args)
        if inspect.iscoroutinefunction(callback):
            return await _Steps(callback, callback(*args), number, _thread.step)
        step = _thread.step
        begin_ns = _start(number, step)
        try:
            return callback(*args)
        finally:
            _end(number, step, begin_ns)

    return await_or_execute


def _number_of(callback):
    """Return the number of a callback; None of one of rclpy itself that nothing has."""
    try:
        function = callback
        while isinstance(function, functools.partial):
            function = function.func
        owner = _thread.entity
        if getattr(owner, "_msgflow", None) is None or owner.callback is not function:
            owner = _owners.get(id(function))
        if owner is not None and owner.callback is function:
            if owner._msgflow_callback is not function:
                _own(owner)
            return owner._msgflow
        if (getattr(function, "__module__", None) or "").partition(".")[0] == "rclpy":
            return None
        return _function(function)
    except Exception as error:
        _turn_off(error)
        return None


def _function(callback, suffix=""):
    """Return the number of a function that no subscription, timer or service has."""
    return _numbered(_symbol(callback) + suffix, _origin(), callback)


def _origin():
    """Return the callback for which the thread works: a job works for the one that started it."""
    number = _thread.calls[-1] if _thread.calls else 0
    return _told[number][2] if number in _told else number


def _numbered(symbol, origin, callback=None, source=""):
    if (symbol, origin) not in _functions and len(_functions) >= _MOST_FUNCTIONS:
        symbol, origin = "(others)", 0
    number = _functions.get((symbol, origin))
    if number is None:
        number, source = next(_numbers), source or _source(callback)
        # Before another thread may get the number.
        _told[number] = symbol, source, origin
        number = _functions.setdefault((symbol, origin), number)
        _register(number, "#msgflow function " + symbol)
        _register_source(number, source)
    return number


def _symbol(callback):
    while isinstance(callback, functools.partial):
        callback = callback.func
    try:
        module, name = callback.__module__, callback.__qualname__
    except Exception as error:
        _pass_on_signal(error)
        module = name = None
    # An object, also a coroutine, may answer anything, or raise.
    if not (isinstance(name, str) and isinstance(module, str)):
        module, name = (type.__dict__[each].__get__(type(callback)) for each in _NAMES)
    return "%s:%s" % (module, name)


def _start(number, step, goes_on=b"#msgflow resume"):
    """Begin a callback; return the CPU time of its thread until then."""
    _thread.calls += (number,)
    if _thread.session != _session:
        _name_thread()
    if step:
        if _thread.depth:
            _ready()
        _tracepoints.rclcpp_callback_register(step, goes_on)
    elif _thread.is_unclear:
        _thread.is_unclear = False
        _tracepoints.rclcpp_executor_get_next_ready()
    _tracepoints.callback_start(number, False)
    return _cpu_time_ns()


def _end(number, step, begin_ns):
    _thread.calls = _thread.calls[:-1]
    end_ns = _cpu_time_ns()
    # What an action does after its first callback goes on because of that.
    if not step and _thread.entity is not None and not hasattr(_thread.entity, "_msgflow"):
        _thread.step = _new_step()
    _tracepoints.callback_end(number)
    # A process that the callback has forked has a clock that began anew.
    if 0 < begin_ns <= end_ns:
        _tracepoints.rclcpp_callback_register(end_ns - begin_ns, b"#msgflow cpu")


def _cpu_time_ns():
    try:
        return time.thread_time_ns()
    except Exception as error:  # There is no such clock.
        _pass_on_signal(error)
        return 0


def _name_thread():
    _thread.session = _session
    try:
        # A thread that Python has not started has none, and would get one from current_thread().
        own = threading.get_ident()
        for thread in threading.enumerate():
            if thread.ident == own:
                _register(0, "#msgflow thread %s" % thread.name)
    except Exception as error:
        _turn_off(error)


def _collect(phase, details, is_finalizing=sys.is_finalizing):
    """Tell how long Python collects garbage; it calls this before and after."""
    global _collection_begin
    # When Python ends, nothing else is sure to be there.
    if is_finalizing():
        return
    try:
        begin_ns, _collection_begin = _collection_begin, None
        if not _is_recorded:
            return
        if phase == "start":
            _collection_begin = time.monotonic_ns()
        elif begin_ns is not None:
            duration_ns = time.monotonic_ns() - begin_ns
            _register(duration_ns, "#msgflow collect %d" % details["generation"])
    except Exception as error:
        _turn_off(error)


# How work goes on, on threads of no executor.


def _passes_on(original):
    def pass_on(self, *args, **kwargs):
        if args and _thread.calls and _is_recorded:
            args = (_job(args[0]), *args[1:])
        return original(self, *args, **kwargs)

    return pass_on


def _starts(original):
    def start(self):
        if _thread.calls and _is_recorded:
            try:
                # One that runs already cannot be started.
                if self.ident is None:
                    _start_as_job(self)
            except Exception as error:  # A thread like no other.
                _pass_on_signal(error)
        return original(self)

    return start


def _start_as_job(thread):
    if isinstance(thread, threading.Timer):
        # It is asleep until then, perhaps again and again.
        thread.function = _job(thread.function)
        return
    run = thread.run
    is_plain = getattr(run, "__func__", None) is threading.Thread.run
    job = _job(run, thread._target if is_plain else run, is_thread=True)
    if job is not run and "run" not in vars(thread):

        def run_once():
            del thread.run
            job()

        thread.run = run_once


def _job(function, named=None, is_thread=False):
    """Return a function that goes on, on another thread, because of what runs now."""
    try:
        if inspect.isfunction(function):
            function = vars(function).get("_msgflow_job", function)
        named = named or function
        module = getattr(named, "__module__", None) or ""
        if not callable(named) or module.partition(".")[0] in _MACHINERY:
            return function
        number = _function(named)
        # What a job starts goes on with it; what others start, each by itself.
        step = (_thread.job and _thread.step) or _new_step()

        def run(*args, **kwargs):
            if _thread.calls or not _is_recorded:
                return function(*args, **kwargs)
            _begin_job(number, step, is_thread)
            try:
                return function(*args, **kwargs)
            finally:
                _end_job()

        run._msgflow_job = function
        return functools.update_wrapper(run, function, updated=())
    except Exception as error:  # A function like no other.
        _pass_on_signal(error)
        return function


def _begin_job(number, step, is_thread, source=None):
    _thread.step = step
    begin_ns = _start(number, step, b"#msgflow job")
    _thread.job = (number, step, begin_ns, is_thread, source)


def _end_job():
    job, _thread.job = _thread.job, None
    if job is not None:
        _end(*job[:3])
        _thread.step = 0


# What a thread gets from a queue is a job of what put it there: until it gets the next one.


class _Handed:
    """In which step, and by which callback, each item of a queue was put there."""

    __slots__ = ("known", "unknown")

    def __init__(self):
        # Of the latest items; how many others are before these.
        self.known = collections.deque()
        self.unknown = 0


def _handed_by(source, count):
    """Return what is known of the items of a queue; its program may change them, too."""
    handed = vars(source).setdefault("_msgflow_handed", _Handed())
    if handed.unknown + len(handed.known) != count:
        handed.known.clear()
        handed.unknown = count
    return handed


def _puts(original):
    def _put(self, item):
        original(self, item)
        if _is_recorded and (_thread.calls or hasattr(self, "_msgflow_handed")):
            try:
                step = (_thread.step or _new_step()) if _thread.calls else 0
                put = (id(item), threading.get_ident(), step, _origin())
                _handed_by(self, len(self.queue) - 1).known.append(put)
            except Exception as error:  # A queue like no other.
                _pass_on_signal(error)

    return _put


def _got(original):
    def _get(self):
        item = original(self)
        if hasattr(self, "_msgflow_handed"):
            try:
                handed = _handed_by(self, len(self.queue) + 1)
                if handed.unknown:
                    handed.unknown -= 1
                else:
                    identity, thread, *by = handed.known.popleft()
                    if identity == id(item) and thread != threading.get_ident():
                        _thread.handed = by
            except Exception as error:
                _pass_on_signal(error)
        return item

    return _get


def _gets(original):
    def get(self, *args, **kwargs):
        # A callback that gets something goes on.
        if not _is_recorded or len(_thread.calls) > bool(_thread.job):
            return original(self, *args, **kwargs)
        job = _thread.job
        if job is not None and job[4] is self:
            _end_job()
        _thread.handed = 0, 0
        item = original(self, *args, **kwargs)
        try:
            _receive(self, sys._getframe(1), *_thread.handed)
        except Exception as error:
            _pass_on_signal(error)
        return item

    return get


def _receive(source, caller, step, origin):
    job = _thread.job
    if job is None:
        while caller.f_globals.get("__name__") == "queue":
            caller = caller.f_back
        module = caller.f_globals.get("__name__", "")
        if step and module.partition(".")[0] not in _MACHINERY:
            code = caller.f_code
            symbol = "%s:%s" % (module, getattr(code, "co_qualname", code.co_name))
            _begin_job(_numbered(symbol, origin, caller), step, True, source)
    elif job[3] and job[4] is None:
        # A thread that gets a second one works for all.
        if step:
            _end_job()
            symbol, place, _ = _told[job[0]]
            _begin_job(_numbered(symbol, origin, source=place), step, True, source)
        else:
            _thread.job = (*job[:4], source)
    elif job[4] is not None and step not in (0, job[1]):
        # It may be for either.
        _end_job()


def _new_step():
    number = next(_numbers)
    _tracepoints.rclcpp_callback_register(number, b"#msgflow step")
    return number


class _Steps:
    """A coroutine of a callback, awaited: each of its steps is told apart."""

    __slots__ = ("_awaited", "_callback", "_coroutine", "_number", "_step")

    def __init__(self, callback, coroutine, number, step):
        self._callback = callback
        self._coroutine = coroutine
        self._number = number
        self._step = step
        self._awaited = None

    def __await__(self):
        return self

    def __iter__(self):
        return self

    def __next__(self):
        return self.send(None)

    def send(self, value):
        # Executors before Lyrical ask again and again whether a future is done.
        if not _is_recorded or (self._awaited is not None and _is_pending(self._awaited)):
            return self._coroutine.send(value)
        return self._run(self._coroutine.send, value)

    def throw(self, *args):
        return self._run(self._coroutine.throw, *args)

    def close(self):
        self._coroutine.close()

    def _run(self, function, *args):
        before = _thread.step
        number = self._number
        begin_ns = _start(number, self._step)
        _thread.step = self._step
        try:
            result = function(*args)
            self._rest()
            return result
        finally:
            _end(number, self._step, begin_ns)
            # A task of asyncio has the thread only for this step.
            if not _thread.depth:
                _thread.step = before

    def _rest(self):
        """Tell that there are more steps. They are no calls of the timer or subscription."""
        try:
            if not self._step:
                self._step = _thread.step = _new_step()
            if self._callback is not None:
                self._number = _function(self._callback, " (goes on)")
                self._callback = None
            self._awaited = _awaited(self._coroutine)
        except Exception as error:
            _turn_off(error)


def _awaited(coroutine):
    """Return the future of rclpy that a coroutine waits for; None if it is not known."""
    try:
        while inspect.iscoroutine(coroutine):
            coroutine = coroutine.cr_await
        future = coroutine.gi_frame.f_locals.get("self")
        return future if _is_pending(future) else None
    except Exception as error:
        _pass_on_signal(error)
        return None


def _is_pending(future):
    return not (future.done() or future.cancelled())


# What executors do.


def _ready():
    if _thread.state != "ready":
        _thread.state = "ready"
        _tracepoints.rclcpp_executor_get_next_ready()


def _wait_for_ready_callbacks(original):
    def wait_for_ready_callbacks(self, *args, **kwargs):
        if not _is_on:
            return original(self, *args, **kwargs)
        global _is_recorded
        was_recorded = _is_recorded
        _is_recorded = _tracepoints.is_recorded()
        if not _is_recorded:
            return original(self, *args, **kwargs)
        if not was_recorded:
            _announce_again()
        try:
            # What its thread got before is over: now it works for all.
            if not _thread.depth:
                _end_job()
                # An exception may have come before a callback began.
                _thread.calls = ()
            # A callback that spins is in a thread of a pool all the same.
            _thread.is_spinning = _thread.is_spinning or not _thread.depth
            _work_for(self)
            _ready()
            _thread.is_waiting = True
        except Exception as error:
            _turn_off(error)
        try:
            return original(self, *args, **kwargs)
        finally:
            _thread.is_waiting = False

    return wait_for_ready_callbacks


def _wait(original):
    def wait(self, timeout):
        if not _thread.is_waiting:
            return original(self, timeout)
        _thread.state = "wait"
        _tracepoints.rclcpp_executor_wait_for_work(timeout)
        try:
            return original(self, timeout)
        finally:
            _ready()

    return wait


def _work_for(executor):
    if _thread.executor != id(executor):
        _thread.executor = id(executor)
        kind = _KINDS.get(type(executor).__name__, "unknown")
        _register(id(executor), "#msgflow executor " + kind)


def _make_handler(original):
    def _make_handler(self, entity, node, take_from_wait_list, *args, **kwargs):
        if not _is_recorded:
            return original(self, entity, node, take_from_wait_list, *args, **kwargs)

        def take(entity):
            if _is_recorded:
                try:
                    _turn_to(self, entity)
                except Exception as error:
                    _turn_off(error)
            return take_from_wait_list(entity)

        return original(self, entity, node, take, *args, **kwargs)

    return _make_handler


def _turn_to(executor, entity):
    _work_for(executor)
    _ready()
    _thread.entity = entity
    handle = getattr(entity, "_msgflow", None)
    if handle is None:
        _look_into(type(entity))
    elif entity._msgflow_kind != "Service":
        _thread.state = "execute"
        _tracepoints.rclcpp_executor_execute(handle)


def _look_into(waitable):
    """Look what actions take at once: a callback would seem to be for the last of that."""
    if waitable not in _waitables:
        _waitables.add(waitable)
        if hasattr(waitable, "take_data"):
            _wrap(waitable, "take_data", _take_data)


def _take_data(original):
    def take_data(self):
        data = original(self)
        if _is_recorded and isinstance(data, dict):
            # Only the callback of feedback is called then, if there is feedback.
            taken = {"goal", "cancel", "result", "status"}.intersection(data)
            _thread.is_unclear = len(taken) > 1 and "feedback" not in data
        return data

    return take_data


def _take_answer(pending, original):
    def take(self, *args):
        answer = original(self, *args)
        try:
            # Each has a future, and what waits for that goes on because of it.
            future = getattr(_thread.entity, pending, {}).get(answer[0])
            if _is_recorded and future is not None:
                future._msgflow_step = _new_step()
        except Exception as error:
            _turn_off(error)
        return answer

    return take


def _create_task(original):
    def create_task(self, callback, *args, **kwargs):
        if _is_recorded:
            try:
                callback = _later(callback, *args[:1])
            except Exception as error:
                _turn_off(error)
        return original(self, callback, *args, **kwargs)

    return create_task


def _later(callback, future=None):
    """Return a callback that goes on because of what runs now, or because of an answer."""
    is_coroutine = inspect.iscoroutinefunction(callback)
    number = _number_of(callback)
    if not callable(callback) or (number is None and not is_coroutine):
        return callback
    step = getattr(future, "_msgflow_step", 0) or _thread.step or _new_step()

    async def run_steps(*args, **kwargs):
        _thread.step = step
        coroutine = callback(*args, **kwargs)
        return await (coroutine if number is None else _Steps(callback, coroutine, number, step))

    def run(*args, **kwargs):
        _thread.step = step
        if not _is_recorded:
            return callback(*args, **kwargs)
        begin_ns = _start(number, step)
        try:
            return callback(*args, **kwargs)
        finally:
            _end(number, step, begin_ns)

    return run_steps if is_coroutine else run


def _run_task(original):
    def __call__(self, *args):
        if not _is_recorded:
            return original(self, *args)
        entity, step = _thread.entity, _thread.step
        _thread.entity, _thread.step, _thread.is_unclear = None, 0, False
        _thread.depth += 1
        try:
            return original(self, *args)
        finally:
            _thread.depth -= 1
            _thread.entity, _thread.step = entity, step
            if _thread.is_spinning:
                _thread.state = None
            elif _thread.state in ("ready", "execute"):
                # A thread of a pool: it waits for the next task.
                _thread.state = "wait"
                _tracepoints.rclcpp_executor_wait_for_work(-1)

    return __call__
