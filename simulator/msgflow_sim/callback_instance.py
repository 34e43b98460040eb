"""Callback instances that are under way, and where the flows that lead to them began."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(slots=True)
class Root:
    """A run of a timer's callback, where flows begin."""

    callback_instance_id: int
    hostname: str
    pid: int
    tid: int
    start: int
    start_ns: int


# Where a flow began, and the topics since then.
Origin = tuple[Root, tuple[str, ...]]


@dataclass(slots=True)
class CallbackInstance:
    """A run of a callback that is going on; what it publishes is caused by it.

    Without `callback_instance_id`, what is done with something that was taken without a callback:
    a message, a request or a response.

    Attributes:
        origins: where the flows that lead to it began, or begin with it.
        start: time of callback_start, or of the take.
        causes: what else its next publication is made of.
        request_id: the request that was taken, or answered by the response that was.
        is_response: it was a response.
        header_ns: stamp in the header of the message that it got, or when the timer was called.
            What it publishes has the same.
        polled: by topic, the message that was taken last in the callback itself.
    """

    callback_instance_id: int | None
    start_ns: int | None
    origins: tuple[Origin, ...]
    take_id: int | None
    take_rmw_ns: int | None
    tid: int
    start: int = 0
    causes: tuple[Cause, ...] = ()
    request_id: int | None = None
    is_response: bool = False
    header_ns: int | None = None
    polled: dict[str, CallbackInstance] = field(default_factory=dict)

    @property
    def is_filtered(self) -> bool:
        """Whether its next publication is made of a set, which its own message may not be in."""
        return any(cause.kind == "approximate_sync" for cause in self.causes)


@dataclass(frozen=True, slots=True)
class Cause:
    """A run of the callback of an input that an indirect link leads from.

    `is_reuse`: an earlier publication by the same link has used its message already.
    """

    kind: str
    instance: CallbackInstance
    is_reuse: bool


def origins_on(instance: CallbackInstance, topic: str) -> tuple[Origin, ...]:
    """The flows that a message is part of; a timer is no begin where it uses messages."""
    if not instance.causes and not instance.polled:
        return tuple((root, (*path, topic)) for root, path in instance.origins)
    inputs = [cause.instance.origins for cause in instance.causes]
    inputs += [polled.origins for polled in instance.polled.values()]
    if instance.take_id is not None and not instance.is_filtered:
        inputs.insert(0, instance.origins)
    origins = {
        (root.callback_instance_id, path): (root, (*path, topic))
        for each in inputs
        for root, path in each
    }
    return tuple(origins.values())
