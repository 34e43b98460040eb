"""Runs what is in `ready`, one after the other."""

import inspect

import rclpy.service
import rclpy.subscription
import rclpy.timer
from rclpy import _core as _rclpy


async def await_or_execute(callback, *args):
    if inspect.iscoroutinefunction(callback):
        return await callback(*args)
    return callback(*args)


class Future:
    def __init__(self):
        self.is_done = False

    def done(self):
        return self.is_done

    def cancelled(self):
        return False

    def __await__(self):
        while not self.is_done:
            yield


class Task:
    def __init__(self, handler, args):
        self.handler = handler(*args) if inspect.iscoroutinefunction(handler) else handler
        self.args = args
        self.is_done = False

    def __call__(self):
        if inspect.iscoroutine(self.handler):
            try:
                self.handler.send(None)
            except StopIteration:
                self.is_done = True
        else:
            self.handler(*self.args)
            self.is_done = True


class Executor:
    def __init__(self):
        self.ready = []
        self.tasks = []

    def create_task(self, callback, *args, **kwargs):
        self.tasks.append(Task(callback, args))
        return self.tasks[-1]

    def _make_handler(self, entity, node, take_from_wait_list):
        async def handler(entity):
            run = take_from_wait_list(entity)
            await run()

        return Task(handler, (entity,))

    def wait_for_ready_callbacks(self, *args, **kwargs):
        self.tasks = [task for task in self.tasks if not task.is_done]
        if self.tasks:
            return self.tasks[0]
        _rclpy.WaitSet().wait(-1)
        entity, message = self.ready.pop(0)

        def take(entity):
            async def run():
                await await_or_execute(entity.callback, *message)

            return run

        self.tasks.append(self._make_handler(entity, None, take))
        return self.tasks[0]

    def spin_once(self):
        task = self.wait_for_ready_callbacks()
        task()
        # Others have their turn.
        self.tasks.append(self.tasks.pop(0))


class SingleThreadedExecutor(Executor):
    pass
