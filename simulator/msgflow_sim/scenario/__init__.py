"""Scenarios that come with msgflow: systems to simulate, as data.

Each module has those that show one idea.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

from msgflow_sim.scenario import (
    actions,
    agnocast,
    annotated,
    autoware,
    bursts,
    caret,
    channels,
    containers,
    delivery,
    executors,
    intra_process,
    layers,
    lives,
    nested,
    own_events,
    pipeline,
    rivals,
    robot,
    rtabmap,
    scheduling,
    services,
    starvation,
    traffic,
    transforms,
)

if TYPE_CHECKING:
    from msgflow_sim.system import Scenario


def scenarios() -> Mapping[str, Scenario]:
    """Every built-in scenario by name."""
    built_in = (
        pipeline.pipeline(),
        pipeline.fan_out(),
        pipeline.two_hosts(),
        pipeline.quiet(),
        pipeline.stall(),
        robot.demo(),
        executors.multi_threaded(),
        executors.executors(),
        executors.events_executors(),
        executors.busy_waiting(),
        executors.polled(),
        executors.timers(),
        nested.nested(),
        own_events.own_events(),
        intra_process.intra_process(),
        intra_process.mixed_intra_process(),
        intra_process.container(),
        intra_process.container_multi_threaded(),
        delivery.overload(),
        delivery.losses(),
        starvation.starved(),
        starvation.overwritten_copies(),
        transforms.transforms(),
        services.services(),
        services.calls(),
        actions.actions(),
        lives.restarts(),
        lives.container_restarts(),
        containers.containers_one_daemon(),
        containers.containers_one_hostname(),
        bursts.equal_stamps(),
        traffic.host_chain(),
        bursts.bursts(),
        bursts.bursts_two_hosts(),
        rivals.rivals(),
        channels.channels(),
        layers.python(),
        layers.python_timers(),
        layers.layers(),
        layers.polling(),
        annotated.periodic_async(),
        annotated.partial_sync(),
        annotated.approximate_sync(),
        annotated.reentrant(),
        autoware.autoware(),
        autoware.autoware_two_threads(),
        rtabmap.rtabmap(),
        scheduling.cpu_hog(),
        scheduling.real_time(),
        scheduling.shared_map(),
        scheduling.shared_memory(),
        scheduling.kernel_losses(),
        agnocast.agnocast(),
        caret.caret(),
    )
    return MappingProxyType({scenario.name: scenario for scenario in built_in})
