"""What traces Python nodes, on an rclpy and a tracetools that are as small as can be."""

from __future__ import annotations

import ast
import os
import re
import shutil
import subprocess
import sys
import textwrap
from collections.abc import Callable
from pathlib import Path

import pytest

from msgflow.record import program as module
from msgflow.record.program import PYTHON_NODES, with_python_nodes

FAKE = Path(__file__).with_name("fake_ros")
BESIDE = re.compile("#msgflow (python|executor|source|cpu|collect|thread)")
# A node with a subscription (7) that spins; what a test does comes in between.
NODE = """
    from rclpy import executors, subscription, timer, service, node
    executor = executors.SingleThreadedExecutor()

    def heard(message):
        print(message)

    {code}
    print("over")
"""


class Robot:
    """A program of rclpy, and what it traces."""

    def __init__(self, directory: Path, library: Path) -> None:
        self.directory = directory
        self.nodes = PYTHON_NODES
        self.words = [sys.executable]
        self.trace = directory / "trace.txt"
        self.session = directory / "session"
        self.session.touch()
        self.environment = {
            "PYTHONPATH": str(FAKE),
            "FAKE_LIBRARY": str(library),
            "FAKE_TRACE": str(self.trace),
            "FAKE_SESSION": str(self.session),
        }

    def run(
        self, code: str, *, traced: bool = True, first: Callable[[], None] | None = None
    ) -> tuple[int, str, str]:
        """Run a program, and return its exit code, its output and its errors."""
        program = self.directory / "robot.py"
        code = textwrap.indent(textwrap.dedent(code), "    ")
        program.write_text(textwrap.dedent(NODE.format(code=code.strip())))
        path = [str(self.nodes)] * traced + [self.environment["PYTHONPATH"]]
        ended = subprocess.run(
            [*self.words, program],
            cwd=self.directory,
            env=self.environment | {"PYTHONPATH": os.pathsep.join(path)},
            capture_output=True,
            text=True,
            timeout=60,
            preexec_fn=first,
        )
        return ended.returncode, ended.stdout, ended.stderr

    def traced(self) -> list[str]:
        """Return the events of callbacks and executors, without the marks beside them."""
        return [line for line in self.lines() if not BESIDE.search(line)]

    def lines(self, word: str = "") -> list[str]:
        """Return all events that have the word."""
        lines = self.trace.read_text().splitlines() if self.trace.exists() else []
        return [line for line in lines if word in line]


@pytest.fixture(autouse=True)
def _alone() -> None:
    """Nothing is recorded here: other tests need not wait."""


@pytest.fixture(scope="session")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if shutil.which("gcc") is None:
        pytest.skip("no gcc")
    path = tmp_path_factory.mktemp("tracetools") / "libtracetools.so"
    soname = f"-Wl,-soname,{path.name}"
    subprocess.run(
        ["gcc", "-shared", "-fPIC", soname, "-o", path, FAKE / "tracetools.c"], check=True
    )
    return path


@pytest.fixture
def robot(tmp_path: Path, library: Path) -> Robot:
    return Robot(tmp_path, library)


ONE_MESSAGE = """
    executor.ready = [(subscription.Subscription(7, heard), ["hello"])]
    executor.spin_once()
"""


def test_a_callback_and_its_executor(robot: Robot) -> None:
    assert robot.run(ONE_MESSAGE) == (0, "hello\nover\n", "")
    assert robot.traced() == [
        "rclcpp_subscription_init 7 7",
        "rclcpp_subscription_callback_added 7 7",
        "register 7 __main__:heard",
        "ready",
        "rclcpp_executor_wait_for_work -1",
        "ready",
        "rclcpp_executor_execute 7",
        "callback_start 7",
        "callback_end 7",
    ]
    text = robot.trace.read_text()
    assert f"#msgflow python {sys.version.split()[0]}" in text
    assert "#msgflow executor single_threaded" in text


def test_two_objects_with_one_function_are_told_apart(robot: Robot) -> None:
    robot.run("""
        executor.ready = [
            (subscription.Subscription(7, heard), ["a"]),
            (subscription.Subscription(8, heard), ["b"]),
        ]
        executor.spin_once(); executor.spin_once(); executor.spin_once()
    """)
    assert [line for line in robot.traced() if "start" in line] == [
        "callback_start 7",
        "callback_start 8",
    ]


def test_timers_have_a_node_and_services_no_execution(robot: Robot) -> None:
    robot.run("""
        executor.ready = [
            (node.Node().create_timer(5, lambda: None), []), (service.Service(6, heard), [1])
        ]
        executor.spin_once(); executor.spin_once(); executor.spin_once()
    """)
    traced = robot.traced()
    assert "rclcpp_timer_link_node 5 900" in traced
    assert "register 5 __main__:<lambda>" in traced
    assert "rclcpp_service_callback_added 6 6" in traced
    assert [line for line in traced if "execute" in line] == ["rclcpp_executor_execute 5"]


def test_steps_of_coroutines_belong_together(robot: Robot) -> None:
    """Another callback runs in between, and nothing while the future is not done."""
    assert robot.run("""
        future = executors.Future()

        async def slowly(message):
            await future
            print("later")

        executor.ready = [
            (subscription.Subscription(7, slowly), [1]), (subscription.Subscription(8, heard), [2])
        ]
        executor.spin_once()
        executor.spin_once()
        executor.tasks.clear() if future.is_done else None
        task = executor.tasks[0]
        executor.tasks = []
        executor.spin_once()
        future.is_done = True
        task()
    """) == (0, "2\nlater\nover\n", "")
    wanted = ("callback", "step", "resume")
    assert [line for line in robot.traced() if any(word in line for word in wanted)][2:] == [
        "callback_start 7",
        "register 1 #msgflow step",
        "callback_end 7",
        "callback_start 8",
        "callback_end 8",
        "register 1 #msgflow resume",
        "callback_start 2",
        "callback_end 2",
    ]
    assert "register 2 #msgflow function __main__:slowly (goes on)" in robot.traced()


def test_tasks_go_on_for_what_made_them(robot: Robot) -> None:
    robot.run("""
        def later():
            print("later")

        def asking(message):
            executor.create_task(later)

        executor.ready = [(subscription.Subscription(7, asking), [1])]
        executor.spin_once(); executor.spin_once()
    """)
    traced = robot.traced()
    assert traced[traced.index("callback_start 7") + 1 :] == [
        "register 1 #msgflow function __main__:later",
        "register 2 #msgflow step",
        "callback_end 7",
        "ready",
        "register 2 #msgflow resume",
        "callback_start 1",
        "callback_end 1",
    ]


def test_of_too_many_functions_the_others_share_a_number(robot: Robot) -> None:
    said = robot.run("""
        import sys
        tracer = sys.modules["_msgflow_rclpy"]
        tracer._MOST_FUNCTIONS = 2

        def asking(message):
            for number in range(5):
                def later():
                    pass
                later.__qualname__ = "later%d" % number
                executor.create_task(later)

        executor.ready = [(subscription.Subscription(7, asking), [1])]
        executor.spin_once(); executor.spin_once()
        print(len(tracer._told))
    """)[1]
    # Two of their own, and one for the others: what a robot makes anew costs no memory.
    assert said == "3\nover\n"
    named = [line.rpartition(" ")[2] for line in robot.lines("#msgflow function")]
    assert named == ["__main__:later0", "__main__:later1", "(others)"]


JOBS = """
    import queue, threading, time
    from concurrent.futures import ThreadPoolExecutor
    results = queue.SimpleQueue()

    def work(*words):
        time.sleep(0.01)
        results.put(words)
        return words

    def hear(*callbacks):
        for number, callback in enumerate(callbacks, 1001):
            executor.ready.append((subscription.Subscription(number, callback), [number]))
        for _ in callbacks:
            executor.spin_once()

    channel = queue.Queue()

    def loop():
        while channel.get():
            work()

"""


def run_jobs(robot: Robot, code: str) -> list[str]:
    """Run code that works on threads; return what it printed, and check that it is as ever."""
    program = f"{JOBS.strip()}\n{textwrap.indent(textwrap.dedent(code), '    ')}"
    ended = robot.run(textwrap.dedent(f"    {program}"), traced=False)
    assert ended[0] == 0, ended[2]
    assert robot.run(textwrap.dedent(f"    {program}")) == ended
    return ended[1].splitlines()


def jobs(robot: Robot) -> list[tuple[str, str]]:
    """Return the name of each job, and the callback that it goes on for: these have 1001 and on."""
    lines = robot.traced()
    names = dict(re.findall(r"register (\d+) #msgflow function \S*:(\S+)", "\n".join(lines)))
    found = []
    for at, line in enumerate(lines):
        if (match := re.fullmatch(r"register (\d+) #msgflow job", line)) is not None:
            begin = lines.index(f"register {match[1]} #msgflow step")
            of = next(each for each in lines[begin::-1] if re.match(r"callback_start \d{4}", each))
            number = next(each for each in lines[at:] if re.match(r"callback_start \d{,3}$", each))
            found.append((names[number.split()[1]], of.split()[1]))
    return found


@pytest.mark.parametrize(
    "start",
    [
        "pool.submit(work, message)",
        "pool.submit(work, message).result()",
        "list(pool.map(work, [message]))",
        "threading.Thread(target=work, args=(message,)).start()",
        "threading.Timer(0.01, work, [message]).start()",
        "pool.submit(time.sleep, 0.1).add_done_callback(work)",
    ],
)
def test_a_job_goes_on_for_the_callback_that_started_it(robot: Robot, start: str) -> None:
    """Each begins and ends on its thread; what no callback starts is nobody's."""
    run_jobs(
        robot,
        f"""
        pool = ThreadPoolExecutor(2)
        message = 0
        {start}
        results.get()

        def heard(message):
            {start}

        hear(heard, lambda message: {start})
        results.get(), results.get()
        pool.shutdown()
        """,
    )
    assert sorted(job for job in jobs(robot) if job[0] != "sleep") == [
        ("work", "1001"),
        ("work", "1002"),
    ]
    lines = robot.lines()
    assert len(robot.lines("callback_start")) == len(robot.lines("callback_end"))
    assert lines.count("rclcpp_executor_execute 1001") == 1


def test_threads_are_as_they_were(robot: Robot) -> None:
    """Of any class, with their names, errors and attributes; a second start is an error."""
    out = run_jobs(
        robot,
        """
        class Worker(threading.Thread):
            def run(self):
                print(self.name, self.daemon, sorted(vars(self)) == before)
                1 / 0

        class Again(threading.Timer):
            def run(self):
                for _ in range(2):
                    self.function(*self.args)

        class Odd(threading.Thread):
            @property
            def run(self):
                return work

        class Bare(threading.Thread):
            def __init__(self):
                pass

        threading.excepthook = lambda args: print(args.exc_type.__name__)

        def heard(message):
            global before
            try:
                Bare().start()
            except RuntimeError as error:
                print(error)
            worker = Worker(name="mine", daemon=True)
            worker.run = worker.run
            del worker.run
            before = sorted(vars(worker))
            worker.start()
            worker.join()
            try:
                worker.start()
            except RuntimeError as error:
                print(error)
            for thread in (Again(0, work, [1]), Odd(), threading.Thread()):
                thread.start()
                thread.join()
            with ThreadPoolExecutor(1) as pool:
                print(repr(pool.submit(int, "x").exception()), pool.submit(None).exception())
                try:
                    pool.submit()
                except TypeError as error:
                    print("TypeError")

        hear(heard)
        """,
    )
    assert out[0] == "thread.__init__() not called"
    assert out[1:4] == ["mine True True", "ZeroDivisionError", "threads can only be started once"]
    assert [job[0] for job in jobs(robot)].count("work") == 2


def test_what_a_thread_gets_from_a_queue_goes_on_for_what_put_it_there(robot: Robot) -> None:
    """Also where a callback starts the thread, and where the program empties the queue itself."""
    run_jobs(
        robot,
        """
        channel, lazy, threads = queue.Queue(), queue.Queue(), []

        def loop(source, name):
            while (item := source.get()) is not None:
                work(name, item)

        def loop_later(source):
            loop(source, "later")

        threading.Thread(target=loop, args=(channel, "first"), daemon=True).start()
        channel.put("nobody's")
        results.get()

        def heard(message):
            channel.put("lost")
            with channel.mutex:
                channel.queue.clear()
            channel.put(message)
            lazy.put(message)
            if not threads:
                threads.append(threading.Thread(target=loop_later, args=[lazy], daemon=True))
                threads[0].start()
            results.get(), results.get()

        hear(heard, heard, heard)
        channel.put(None), lazy.put(None)
        threads[0].join()
        """,
    )
    assert sorted(set(jobs(robot))) == sorted(
        [*(("loop", number) for number in ("1001", "1002", "1003")), ("loop_later", "1001")]
    )
    assert len(robot.lines("callback_start")) == len(robot.lines("callback_end"))


def test_objects_that_answer_everything_are_called_as_ever(robot: Robot) -> None:
    """As proxies of remote calls, and mocks: what the tracer looks for is not theirs."""
    out = run_jobs(
        robot,
        """
        from unittest.mock import Mock

        class Method:
            def __init__(self, name):
                self.name = name

            def __getattr__(self, more):
                return Method(self.name + "." + more)

            def __call__(self, *args):
                print(self.name, *args)

        mock, pool = Mock(), ThreadPoolExecutor(1)

        def heard(message):
            pool.submit(Method("set"), message).result()
            pool.submit(mock, message).result()
            thread = threading.Thread(target=Method("stop"))
            thread.start()
            thread.join()
            print(mock.mock_calls)

        hear(heard)
        """,
    )
    assert out == ["set 1001", "stop", "[call(1001)]", "over"]


def test_a_thread_that_one_callback_starts_and_another_feeds(robot: Robot) -> None:
    """Also the first thing that it gets is for what put it there."""
    run_jobs(
        robot,
        """
        channel = queue.Queue()

        def loop():
            while (item := channel.get()) is not None:
                work(item)

        def started(message):
            threading.Thread(target=loop, daemon=True).start()

        def heard(message):
            channel.put(message)
            results.get()

        hear(started, heard, heard)
        """,
    )
    assert jobs(robot) == [("loop", "1001"), ("loop", "1002"), ("loop", "1003")]


@pytest.mark.parametrize("began", ["started by a callback", "got an item"])
def test_callbacks_of_a_thread_that_spins_are_in_no_job(robot: Robot, began: str) -> None:
    run_jobs(
        robot,
        f"""
        channel = queue.Queue()

        def loop():
            if {began == "got an item"}:
                channel.get()
            other = executors.SingleThreadedExecutor()
            for number in (2001, 2002):
                other.ready.append((subscription.Subscription(number, print), ["inside"]))
            other.spin_once(), other.spin_once()

        def heard(message):
            if {began != "got an item"}:
                thread.start()
            channel.put(message)
            thread.join()

        thread = threading.Thread(target=loop)
        if {began == "got an item"}:
            thread.start()
        hear(heard)
        """,
    )
    assert jobs(robot) == [("loop", "1001")]
    calls = [line for line in robot.traced() if re.match("callback_(start|end)", line)]
    (job,) = {line.split()[1] for line in calls} - {"1001", "2001", "2002"}
    assert calls == [
        "callback_start 1001",
        f"callback_start {job}",
        f"callback_end {job}",
        "callback_start 2001",
        "callback_end 2001",
        "callback_start 2002",
        "callback_end 2002",
        "callback_end 1001",
    ]


def numbers(robot: Robot, name: str) -> list[str]:
    """Return the numbers of a function that runs, in the order in which it first runs so."""
    lines = robot.traced()
    told = [line.split()[1] for line in lines if line.endswith(f"#msgflow function {name}")]
    assert len(robot.lines("#msgflow source")) >= len(told) == len(set(told))
    starts = [line.split()[1] for line in lines if line.startswith("callback_start")]
    return sorted(set(starts) & set(told), key=starts.index)


@pytest.mark.parametrize(
    ("start", "name"),
    [
        ("pool.submit(node.job).result()", "Node.job"),
        ("thread = threading.Thread(target=node.job); thread.start(); thread.join()", "Node.job"),
        ("tick(3); results.get()", "tick"),
        ("channel.put(node); results.get()", "loop"),
    ],
)
def test_jobs_of_two_nodes_of_one_class_are_told_apart(robot: Robot, start: str, name: str) -> None:
    """Each callback has a job of its own, and only one: also where a job starts itself again."""
    run_jobs(
        robot,
        f"""
        channel, pool = queue.Queue(), ThreadPoolExecutor(1)

        class Node:
            def heard(node, message):
                {start}

            def job(node):
                pass

        def tick(times):
            if times:
                threading.Timer(0, tick, [times - 1]).start()
            else:
                work()

        def loop():
            while channel.get():
                work()

        threading.Thread(target=loop, daemon=True).start()
        left, right = Node(), Node()
        hear(left.heard, right.heard)
        for number, node in ((1001, left), (1002, right)) * 2:
            executor.ready.append((subscription.Subscription(number, node.heard), [number]))
            executor.spin_once()
        """,
    )
    assert len(numbers(robot, f"__main__:{name}")) == 2


def test_each_job_of_a_later_step_is_told(robot: Robot) -> None:
    """What a job starts in turn is no other."""
    run_jobs(
        robot,
        """
        pool, future = ThreadPoolExecutor(1), executors.Future()

        def part():
            threading.Timer(0, work).start()

        async def slowly(message):
            await future
            pool.submit(part), pool.submit(part)

        hear(slowly)
        future.is_done = True
        executor.tasks.pop()()
        results.get(), results.get()
        """,
    )
    marks = [line.split()[1] for line in robot.lines("#msgflow job")]
    assert sorted(map(marks.count, set(marks))) == [2, 2]
    (resumed,) = {line.split()[1] for line in robot.lines("#msgflow resume")}
    assert resumed not in marks


def test_a_thread_that_callbacks_feed_has_a_job_of_each(robot: Robot) -> None:
    run_jobs(
        robot,
        """
        def started(message):
            threading.Thread(target=loop, daemon=True).start()

        def heard(message):
            channel.put(message)
            results.get()

        hear(started, heard, heard)
        """,
    )
    assert len(numbers(robot, "__main__:loop")) == 3


def test_steps_of_two_nodes_of_one_class_are_told_apart(robot: Robot) -> None:
    robot.run("""
        future = executors.Future()

        async def slowly(message):
            await future

        one, other = subscription.Subscription(7, slowly), subscription.Subscription(8, slowly)
        executor.ready = [(one, [1]), (other, [2])]
        executor.spin_once()
        later = executor.tasks.pop()
        executor.spin_once()
        future.is_done = True
        later(), executor.tasks.pop()()
    """)
    assert len(numbers(robot, "__main__:slowly (goes on)")) == 2


def test_what_its_program_takes_out_of_a_queue_leaves_the_later_ones(robot: Robot) -> None:
    """As a node that drops the oldest message. Whose those were that waited then is not known."""
    run_jobs(
        robot,
        """
        def heard(message):
            channel.put(message)

        def dropping(message):
            with channel.mutex:
                channel.queue.popleft()
            channel.put(message)

        hear(heard, heard, dropping, heard)
        threading.Thread(target=loop, daemon=True).start()
        results.get(), results.get(), results.get()
        """,
    )
    assert jobs(robot) == [("loop", "1003"), ("loop", "1004")]


def test_what_may_be_for_either_of_two_goes_on_for_none(robot: Robot) -> None:
    """A worker needs a buffer that another one has put back. What it put back itself is no work."""
    run_jobs(
        robot,
        """
        channel, buffers = queue.Queue(), queue.Queue()

        def loop():
            while True:
                buffer, item = buffers.get(), channel.get()
                work(buffer, item)
                buffers.put(buffer)

        def heard(message):
            channel.put(message)
            results.get()

        def other(message):
            buffers.put("other")
            heard(message)

        buffers.put("own")
        threading.Thread(target=loop, daemon=True).start()
        hear(heard, heard, other, heard)
        """,
    )
    assert ("loop", "1002") in jobs(robot)
    # The other buffer came from a callback of before.
    assert [line for line in robot.traced() if "callback" in line][-1] == "callback_end 1004"


def test_jobs_that_nobody_records(robot: Robot) -> None:
    run_jobs(
        robot,
        """
        import os
        session = os.environ["FAKE_SESSION"]
        channel = queue.Queue()
        pool = ThreadPoolExecutor(1)

        def heard(message):
            if os.path.exists(session):
                os.remove(session)
            pool.submit(work, message).result()
            channel.put(message)
            print(channel.get())

        hear(heard, heard)
        open(session, "w").close()
        """,
    )
    assert {of for _, of in jobs(robot)} == {"1001"}


def test_an_exception_ends_the_callback(robot: Robot) -> None:
    code, out, error = robot.run("""
        def failing(message):
            raise SystemExit(3)

        executor.ready = [(subscription.Subscription(7, failing), [1])]
        executor.spin_once()
    """)
    assert (code, out, error) == (3, "", "")
    assert robot.traced()[-1] == "callback_end 7"


def test_the_cpu_time_of_a_callback_is_that_of_its_thread(robot: Robot) -> None:
    """A callback that sleeps has none, one that spins has that of what it runs, and all end."""
    code, out, error = robot.run("""
        import time

        def computing(message):
            before = time.thread_time_ns()
            while time.thread_time_ns() - before < 30_000_000:
                pass
            print(time.thread_time_ns() - before)

        def spinning(message):
            executor.spin_once()

        def failing(message):
            time.sleep(0.03)
            raise SystemExit(3)

        callbacks = [spinning, computing, failing]
        for number, callback in enumerate(callbacks, 7):
            executor.ready.append((subscription.Subscription(number, callback), [1]))
        task = executor.wait_for_ready_callbacks()
        executor.tasks.clear()
        task()
        executor.spin_once()
    """)
    assert (code, error) == (3, "")
    told = [line for line in robot.lines() if re.search("callback_end|#msgflow cpu", line)]
    ends = [line for line in told if line.startswith("callback_end")]
    assert ends == ["callback_end 8", "callback_end 7", "callback_end 9"]
    # Each right behind its end.
    assert told[::2] == ends
    inner, outer, asleep = (int(line.split()[1]) for line in told[1::2])
    assert int(out.split()[0]) <= inner <= outer < inner + 10_000_000
    assert asleep < 10_000_000


def test_each_step_of_a_coroutine_has_its_cpu_time(robot: Robot) -> None:
    robot.run("""
        import threading
        future = executors.Future()

        async def slowly(message):
            await future

        executor.ready = [(subscription.Subscription(7, slowly), [1])]
        executor.spin_once()
        future.is_done = True
        # Its clock is another one.
        thread = threading.Thread(target=executor.tasks[0], name="second")
        thread.start()
        thread.join()
    """)
    assert len(robot.lines("#msgflow cpu")) == len(robot.lines("callback_end")) == 2
    assert all(int(line.split()[1]) < 100_000_000 for line in robot.lines("#msgflow cpu"))
    assert [line.split()[-1] for line in robot.lines("#msgflow thread")] == ["MainThread", "second"]


@pytest.mark.parametrize(
    "harm",
    ["del time.thread_time_ns", "time.thread_time_ns = lambda: 1 / 0"],
    ids=["none", "fails"],
)
def test_a_clock_that_is_missing_leaves_only_that_out(robot: Robot, harm: str) -> None:
    code = textwrap.dedent(ONE_MESSAGE)
    assert robot.run(f"import time\n{harm}\n{code}") == (0, "hello\nover\n", "")
    assert robot.traced()[-1] == "callback_end 7"
    assert not robot.lines("#msgflow cpu")


def test_a_callback_that_forks_has_its_cpu_time_once(robot: Robot) -> None:
    robot.run("""
        import os, time

        def forking(message):
            while time.thread_time_ns() < 100_000_000:
                pass
            child = os.fork()
            if child:
                os.waitpid(child, 0)

        executor.ready = [(subscription.Subscription(7, forking), [1])]
        executor.spin_once()
    """)
    assert len(robot.lines("callback_end")) == 2
    assert len(robot.lines("#msgflow cpu")) == 1


def test_collections_of_garbage_are_told_while_recorded(robot: Robot) -> None:
    robot.run("""
        import gc, os, time
        gc.disable()
        executor.ready = [(subscription.Subscription(7, heard), ["a"])] * 3
        begin = time.monotonic_ns()
        gc.collect(1)
        print(time.monotonic_ns() - begin)
        executor.spin_once()
        os.remove(os.environ["FAKE_SESSION"])
        executor.spin_once()
        gc.collect(2)
    """)
    (line,) = robot.lines("#msgflow collect")
    assert line.endswith(" #msgflow collect 1")
    assert int(line.split()[1]) > 0


def test_what_a_session_missed_of_a_collection_is_not_told(robot: Robot) -> None:
    """It begins while garbage is collected: by a finalizer, which runs the executor."""
    robot.run("""
        import gc, os
        gc.disable()
        session = os.environ["FAKE_SESSION"]
        one = subscription.Subscription(7, heard)
        executor.ready = [(one, ["a"]), (one, ["b"]), (one, ["c"])]

        class Node:
            def __del__(self):
                open(session, "w").close()
                executor.spin_once()

        gc.collect(0)
        os.remove(session)
        executor.spin_once()
        node = Node()
        node.itself = node
        del node
        gc.collect(1)
        gc.collect(2)
    """)
    assert [line.split()[-1] for line in robot.lines("#msgflow collect")] == ["0", "2"]


def test_a_tracer_that_turns_itself_off_sees_no_collections(robot: Robot) -> None:
    assert (
        robot.run("""
        import gc
        subscription.Subscription.handle = property(lambda self: 1 / 0, lambda self, to: None)
        before = len(gc.callbacks)
        one = subscription.Subscription(7, heard)
        print(before - len(gc.callbacks))
        gc.collect()
    """)[1]
        == "1\nover\n"
    )
    assert not robot.lines("#msgflow collect")


def test_what_another_tool_has_wrapped_since_stays(robot: Robot) -> None:
    code, out, _ = robot.run("""
        import queue, threading
        plain = threading.Thread.start

        def start(self):
            print("started")
            return plain(self)

        threading.Thread.start = start
        subscription.Subscription.handle = property(lambda self: 1 / 0, lambda self, to: None)
        one = subscription.Subscription(7, heard)
        threading.Thread(target=print, args=["runs"]).start()
        print(hasattr(plain, "__wrapped__"), hasattr(queue.Queue.get, "__wrapped__"))
    """)
    assert (code, out.split()) == (0, ["started", "runs", "True", "False", "over"])


def test_python_may_collect_garbage_while_it_ends(robot: Robot) -> None:
    code = """
        import gc
        gc.set_threshold(1)

        class Kept:
            def __del__(self):
                [[] for _ in range(1000)]
                gc.collect()

        kept = Kept()
        kept.itself = kept
        executor.kept = Kept()
    """
    assert robot.run(code) == (0, "over\n", "")


def test_threads_have_names_in_each_session(robot: Robot) -> None:
    """Python has no name for a thread that it did not start, and gets no object for it."""
    code, out, error = robot.run("""
        import _thread, os, threading
        session = os.environ["FAKE_SESSION"]
        one = subscription.Subscription(7, heard)
        executor.ready = [(one, ["a"])] * 5
        threading.current_thread().name = "first\\0 \\ud800"
        executor.spin_once()
        executor.spin_once()
        os.remove(session)
        executor.spin_once()
        threading.current_thread().name = "renamed"
        open(session, "w").close()
        executor.spin_once()
        lock = _thread.allocate_lock()
        lock.acquire()
        _thread.start_new_thread(lambda: (executor.spin_once(), lock.release()), ())
        lock.acquire()
        print(threading.active_count())
    """)
    assert (code, error) == (0, "")
    assert out.split()[-2:] == ["1", "over"]
    names = robot.lines("#msgflow thread")
    assert [name.partition("thread ")[2] for name in names] == ["first\\0 \\ud800", "renamed"]
    lines = robot.lines()
    assert lines.index(names[0]) < lines.index("callback_start 7")


def test_a_session_that_begins_later(robot: Robot) -> None:
    """Without one nothing is traced but what is there; then names come again."""
    robot.run("""
        import os
        session = os.environ["FAKE_SESSION"]
        os.remove(session)
        one = subscription.Subscription(7, heard)
        executor.ready = [(one, ["a"]), (one, ["b"])]
        executor.spin_once()
        open(session, "w").close()
        executor.spin_once(); executor.spin_once()
    """)
    traced = robot.traced()
    assert traced.count("register 7 __main__:heard") == 2
    assert traced.count("callback_start 7") == traced.count("callback_end 7") == 1


@pytest.mark.parametrize(
    "name", ["a\\0b", "\\ud800", "\\u00e4" * 1000, "%s%n", ""], ids=["nul", "lone", "long", "%", ""]
)
def test_hostile_names_change_nothing(robot: Robot, name: str) -> None:
    code = f"    heard.__qualname__ = '{name}'" + ONE_MESSAGE
    assert robot.run(code) == (0, "hello\nover\n", "")
    (line,) = [line for line in robot.traced() if line.startswith("register 7")]
    assert len(line) < 1100


HARM = {
    "no library": ("", {"FAKE_LIBRARY": "/nowhere"}, "libtracetools"),
    "another rclpy": (
        "",
        {"FAKE_RENAME": "1"},
        "this process runs without traced callbacks",
    ),
    "objects without handles": (
        "    subscription.Subscription.handle = property("
        "lambda self: 1 / 0, lambda self, to: None)\n",
        {},
        "division by zero",
    ),
}


@pytest.mark.parametrize("what", HARM)
def test_a_robot_runs_without_what_is_missing(robot: Robot, what: str) -> None:
    code, environment, reason = HARM[what]
    robot.environment |= environment
    if "FAKE_RENAME" in environment:
        changed = robot.directory / "changed"
        shutil.copytree(FAKE / "rclpy", changed / "rclpy")
        executors = changed / "rclpy" / "executors.py"
        executors.write_text(executors.read_text().replace("_make_handler", "_handle"))
        robot.environment["PYTHONPATH"] = str(changed)
    exit_code, out, error = robot.run(code + ONE_MESSAGE)
    assert (exit_code, out) == robot.run(code + ONE_MESSAGE, traced=False)[:2]
    assert (exit_code, out) == (0, "hello\nover\n")
    assert error.startswith("msgflow: this process runs without traced callbacks: ")
    assert reason in error
    assert error.count("\n") == 1
    assert "callback_start" not in "".join(robot.traced())


NAMELESS = {
    "coroutine": "async def later(): pass\n    executor.create_task(later())",
    "raises": """
    class Odd:
        def __getattribute__(self, name):
            return 1 / 0 if name == "__qualname__" else super().__getattribute__(name)
        def __call__(self, message): print(message)
    heard = Odd()
    """,
    "no string": "heard.__module__ = 5",
}


@pytest.mark.parametrize("what", NAMELESS)
def test_what_has_no_name_is_traced(robot: Robot, what: str) -> None:
    code = f"    {NAMELESS[what].strip()}\n{ONE_MESSAGE}"
    if what == "coroutine":
        code += "    executor.spin_once()\n"
    assert robot.run(code, traced=False) == (0, "hello\nover\n", "")
    assert robot.run(code) == (0, "hello\nover\n", "")
    assert [line for line in robot.traced() if "callback" in line][-2:] == [
        "callback_start 7",
        "callback_end 7",
    ]


@pytest.mark.parametrize("place", ["_number_of", "_turn_to", "_function", "_job"])
def test_what_a_signal_handler_raises_within_the_tracer_is_of_the_program(
    robot: Robot, place: str
) -> None:
    """The signal comes when the tracer looks for a name, as it may at any place."""
    code = f"""
        import signal, sys, threading

        class Late(Exception):
            pass

        def on_alarm(number, frame):
            raise Late("too late")

        def heard(message):
            timer = threading.Timer(9, print)
            timer.start(); timer.cancel()

        signal.signal(signal.SIGALRM, on_alarm)
        def alarm(frame, event, argument):
            if frame.f_code.co_name == "{place}":
                sys.setprofile(None)
                signal.raise_signal(signal.SIGALRM)

        entity = subscription.Subscription(7, lambda message: heard(message))
        executor.ready = [(entity, ["lost"]), (entity, ["heard"])]
        sys.setprofile(alarm)
        try:
            executor.spin_once()
        except Late as error:
            print(error)
        finally:
            sys.setprofile(None)
        executor.tasks.clear()
        executor.ready = [(entity, ["heard"])]
        executor.spin_once()
    """
    exit_code, out, errors = robot.run(code)
    assert (exit_code, out, errors) == (0, "too late\nover\n", "")
    assert robot.traced().count("callback_start 7") > 0


def test_a_tracer_that_turns_itself_off_says_so_in_the_trace(robot: Robot) -> None:
    robot.run("""
        import sys
        subscription.Subscription(7, heard)
        sys.modules["_msgflow_rclpy"]._turn_off(ValueError("a reason"))
    """)
    assert robot.lines("#msgflow off") == ["register 0 #msgflow off a reason"]


@pytest.mark.parametrize("name", ["_msgflow_rclpy.py", "sitecustomize.py"])
def test_a_robot_runs_although_the_tracer_raises(robot: Robot, name: str) -> None:
    robot.nodes = robot.directory / "nodes"
    shutil.copytree(PYTHON_NODES, robot.nodes, ignore=shutil.ignore_patterns("__pycache__"))
    text = (robot.nodes / name).read_text()
    place = "import ctypes" if name.startswith("_") else "    sys.path[:] ="
    (robot.nodes / name).write_text(
        text.replace(place, f"{place[: -len(place.lstrip())] or ''}1 / 0\n{place}")
    )
    assert robot.run(ONE_MESSAGE) == (
        0,
        "hello\nover\n",
        "msgflow: this process runs without traced callbacks: division by zero\n",
    )


def test_another_sitecustomize_runs_as_ever(robot: Robot) -> None:
    others = robot.directory / "others"
    others.mkdir()
    (others / "sitecustomize.py").write_text("import sys; sys.stdout.write('mine ')")
    robot.environment["PYTHONPATH"] = f"{others}{os.pathsep}{FAKE}"
    code = "import sys, sitecustomize; print(sitecustomize.__file__, *sys.path[1:4])"
    traced = robot.run(code)
    assert traced == robot.run(code, traced=False)
    assert traced[1].startswith(f"mine {others}/sitecustomize.py {others} {FAKE}")


@pytest.mark.parametrize("is_link", [True, False])
def test_a_process_has_one_tracer(robot: Robot, is_link: bool) -> None:
    """Two ways to it: by a link, as lib64, or in two installations."""
    second = robot.directory / "second"
    if is_link:
        second.symlink_to(PYTHON_NODES)
    else:
        shutil.copytree(PYTHON_NODES, second)
    assert robot.run(ONE_MESSAGE) == (0, "hello\nover\n", "")
    once = robot.traced()
    robot.trace.unlink()
    robot.environment["PYTHONPATH"] = f"{second}{os.pathsep}{FAKE}"
    assert robot.run(ONE_MESSAGE) == (0, "hello\nover\n", "")
    assert robot.traced() == once


def test_a_module_that_was_looked_for_is_traced_when_it_loads(robot: Robot) -> None:
    robot.environment["PYTHONPATH"] = f"{robot.directory}{os.pathsep}{FAKE}"
    (robot.directory / "usercustomize.py").write_text(
        "import importlib.util; [importlib.util.find_spec('rclpy.executors') for _ in 'abc']"
    )
    assert robot.run(ONE_MESSAGE) == (0, "hello\nover\n", "")
    assert "callback_start 7" in robot.traced()


# Of the versions that pyenv has.
OLD = [
    found
    for version in ("2.7", "3.6", "3.7")
    for found in Path.home().glob(f".pyenv/versions/{version}.*/bin/python{version}")
]


@pytest.mark.parametrize("python", OLD, ids=lambda path: path.name)
def test_a_python_that_is_too_old_runs_as_ever(tmp_path: Path, python: Path) -> None:
    (tmp_path / "sitecustomize.py").write_text("import sys; sys.stdout.write('mine ')")
    (tmp_path / "rclpy").mkdir()
    for name in ("__init__", "executors"):
        (tmp_path / "rclpy" / f"{name}.py").touch()
    code = "import json, rclpy.executors, sys; print(sys.path[1:3])"
    untraced, traced = (
        subprocess.run(
            [python, "-c", code],
            env={"PYTHONPATH": os.pathsep.join(path), "PYTHONDONTWRITEBYTECODE": "1"},
            capture_output=True,
            text=True,
        )
        for path in ([str(tmp_path)], [str(PYTHON_NODES), str(tmp_path)])
    )
    assert (untraced.returncode, untraced.stdout[:4]) == (0, "mine")
    assert (traced.returncode, traced.stdout, traced.stderr) == (0, untraced.stdout, "")


@pytest.mark.parametrize("option", ["-S", "-I"])
def test_python_may_be_told_not_to(robot: Robot, option: str) -> None:
    """-I means that PYTHONPATH does not count: that robot finds its modules elsewhere."""
    robot.words.append(option)
    code = f"import sys; sys.path.insert(0, {str(FAKE)!r})"
    program = robot.directory / "other.py"
    program.write_text(f"{code}\nimport rclpy.executors\nprint(list(map(type, sys.meta_path)))\n")
    environment = robot.environment | {"PYTHONPATH": str(PYTHON_NODES)}
    ended = subprocess.run(
        [*robot.words, program], env=environment, capture_output=True, text=True, timeout=60
    )
    assert ended.returncode == 0, ended.stderr
    assert "_Finder" not in ended.stdout
    assert robot.traced() == []


def test_processes_that_fork_are_traced_both(robot: Robot) -> None:
    robot.run("""
        import os
        executor.ready = [(subscription.Subscription(7, heard), ["a"])]
        child = os.fork()
        executor.spin_once()
        if child:
            os.waitpid(child, 0)
    """)
    assert robot.traced().count("callback_start 7") == 2
    # Both say so, and what they are made of.
    assert robot.trace.read_text().count("#msgflow python") == 2
    assert robot.traced().count("register 7 __main__:heard") == 2


@pytest.mark.thorough
@pytest.mark.parametrize("method", ["fork", "spawn", "forkserver"])
def test_nodes_in_processes_of_multiprocessing(robot: Robot, method: str) -> None:
    code, out, error = robot.run(f"""
        import multiprocessing

        def node():
            executor.ready = [(subscription.Subscription(7, heard), ["a"])]
            executor.spin_once()

        if __name__ == "__main__":
            child = multiprocessing.get_context("{method}").Process(target=node)
            child.start()
            child.join()
            assert child.exitcode == 0
    """)
    assert (code, error) == (0, "")
    assert "a\n" in out
    assert robot.traced().count("callback_start 7") == 1


@pytest.mark.thorough
def test_interpreters_within_a_process_run(robot: Robot) -> None:
    """What cannot be traced in one runs all the same."""
    (robot.directory / "robot_inside.py").write_text(
        textwrap.dedent("""
        from rclpy import executors, subscription
        executor = executors.SingleThreadedExecutor()
        executor.ready = [(subscription.Subscription(8, print), ["inside"])]
        executor.spin_once()
    """)
    )
    robot.environment["PYTHONPATH"] += f"{os.pathsep}{robot.directory}"
    code, out, _ = robot.run("""
        import _xxsubinterpreters as interpreters
        code = "import robot_inside, sys; sys.stdout.flush()"
        interpreters.run_string(interpreters.create(), code)
        executor.ready = [(subscription.Subscription(7, heard), ["outside"])]
        executor.spin_once()
    """)
    assert (code, out) == (0, "inside\noutside\nover\n")
    assert robot.traced().count("callback_start 7") == 1


@pytest.mark.skipif(os.geteuid() != 0, reason="only root may take another real user")
def test_a_program_with_rights_that_its_user_lacks_is_not_traced(robot: Robot) -> None:
    assert robot.run(ONE_MESSAGE, first=lambda: os.setresuid(1, 0, 0)) == (0, "hello\nover\n", "")
    assert robot.traced() == []
    assert robot.run(ONE_MESSAGE)[0] == 0
    assert robot.traced() != []


def test_programs_without_rclpy_see_nothing(tmp_path: Path) -> None:
    program = (
        "import sys; print('ctypes' in sys.modules, "
        "[each for each in sys.path if 'msgflow' in each])"
    )
    ended = subprocess.run(
        [sys.executable, "-c", program],
        env={"PYTHONPATH": str(PYTHON_NODES)},
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert (ended.returncode, ended.stderr) == (0, "")
    assert ended.stdout.startswith("False")
    assert str(PYTHON_NODES) not in ended.stdout


def test_the_oldest_python_of_a_robot_reads_it() -> None:
    for path in PYTHON_NODES.glob("*.py"):
        ast.parse(path.read_text(), feature_version=(3, 8))


Environment = Callable[[], tuple[dict[str, str], list[str]]]


@pytest.fixture
def environment() -> Environment:
    def told() -> tuple[dict[str, str], list[str]]:
        notes: list[str] = []
        return with_python_nodes(notes.append), notes

    return told


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the tracer that only its owner may write to, and so up to the root."""
    path = tmp_path / "with space" / "python_nodes"
    shutil.copytree(PYTHON_NODES, path)
    path.chmod(0o755)
    monkeypatch.setattr(module, "PYTHON_NODES", path)
    return path


@pytest.mark.parametrize(
    ("before", "after"),
    [(None, ""), ("", ""), ("/a b", ":/a b"), (":/a::/b:", "::/a::/b:")],
)
def test_python_path_gets_no_empty_entry(
    environment: Environment,
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    before: str | None,
    after: str,
) -> None:
    """An empty one is the current directory: only what was there stays."""
    monkeypatch.delenv("PYTHONPATH", raising=False)
    if before is not None:
        monkeypatch.setenv("PYTHONPATH", before)
    told, notes = environment()
    assert (told["PYTHONPATH"], notes) == (f"{folder}{after}", [])


@pytest.mark.parametrize("what", ["folder", "file", "compiled", "parent", "colon"])
def test_what_others_may_write_is_not_run(
    environment: Environment, folder: Path, monkeypatch: pytest.MonkeyPatch, what: str
) -> None:
    monkeypatch.delenv("PYTHONPATH", raising=False)
    if what == "colon":
        renamed = folder.with_name("a:b")
        folder.rename(renamed)
        monkeypatch.setattr(module, "PYTHON_NODES", renamed)
    else:
        file = folder / "sitecustomize.py"
        compiled = folder / "__pycache__"
        compiled.mkdir(exist_ok=True)
        {"folder": folder, "file": file, "compiled": compiled, "parent": folder.parent}[what].chmod(
            0o777
        )
    told, (note,) = environment()
    assert "PYTHONPATH" not in told
    assert note.startswith("callbacks of Python nodes are not traced: ")
