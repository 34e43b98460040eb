"""`msgflow simulate`: the trace of a simulated ROS 2 system."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from msgflow.cli.operation import operation

_SECOND = 1_000_000_000


def _list(is_asked: bool) -> None:
    """Print each system with its description, then end."""
    if not is_asked:
        return
    from msgflow.cli.output import print_list
    from msgflow_sim import scenarios

    print_list([(name, scenario.description) for name, scenario in scenarios().items()])
    raise typer.Exit


@operation
def command(
    scenario: Annotated[str, typer.Argument(autocompletion=lambda: _scenarios())],
    *,
    _: Annotated[bool, typer.Option("--list", callback=_list, is_eager=True)] = False,
    factor: Annotated[float, typer.Option(min=0)] = 1,
    seed: int = 0,
    layout: Annotated[str | None, typer.Option(autocompletion=lambda: _layouts())] = None,
    start_late: Annotated[float, typer.Option(min=0)] = 0,
    dual_session: bool = False,
    pause: tuple[float, float] | None = None,
    rotate: list[float] | None = None,
    per_process: bool = False,
    lose_events: Annotated[float, typer.Option(min=0, max=1)] = 0,
    lose_packets: Annotated[float, typer.Option(min=0, max=1)] = 0,
    cut: Annotated[int, typer.Option(min=0)] = 0,
    perf: bool = False,
    slew: float = 0,
    clock_offset: float = 0,
    clock_drift: float = 0,
    output: Path | None = None,
) -> None:
    """Write the trace of a simulated ROS 2 system, and the links that really happened.

    Args:
        scenario (SCENARIO): Name of the system.
        _: List the available systems and exit.
        factor: Length, as a multiple of the scenario's default.
        seed: Random seed.
        layout (NAME): Release of ROS 2 to imitate, such as jazzy, or humble-fastdds for an
            instrumented DDS; by default that of the scenario.
        start_late (SECONDS): Start recording after SECONDS: no initialisation events.
        dual_session: Also record a snapshot session with the initialisation events that
            --start-late misses.
        pause (START END): Record nothing between these two times, in seconds.
        rotate (SECONDS): Start a new chunk of the trace at this time; may be repeated.
        per_process: One trace per process.
        lose_events (SHARE): Share of packets after which events are lost.
        lose_packets (SHARE): Share of packets that are missing.
        cut (STREAMS): Number of streams per trace to truncate mid-packet.
        perf: perf, not LTTng, records the kernel, in systems with a kernel trace.
        slew (PPM): Drift of source stamps against the clock of the trace (positive: faster).
        clock_offset (SECONDS): How far each host's clock is ahead of the previous host's.
        clock_drift (PPM): How much faster each host's clock runs than the previous host's.
        output (DIR): Folder to write the trace into; by default SCENARIO.
    """
    from msgflow.cli.output import print_status
    from msgflow.text.values import count
    from msgflow_sim import Buffers, Recording, simulate

    directory = output or Path(scenario)
    recording = Recording(
        start_ns=_nanoseconds(start_late),
        is_dual_session=dual_session,
        pauses=() if pause is None else ((_nanoseconds(pause[0]), _nanoseconds(pause[1])),),
        rotations=tuple(sorted(_nanoseconds(time) for time in rotate or ())),
        buffers=Buffers.PER_PROCESS if per_process else Buffers.PER_USER,
        lost_event_share=lose_events,
        lost_packet_share=lose_packets,
        cut_streams=cut,
        slew_ppm=slew,
        kernel_tracer="perf" if perf else "lttng",
    )
    done = simulate(
        scenario,
        directory,
        factor=factor,
        seed=seed,
        clock_offset_ns=_nanoseconds(clock_offset),
        clock_drift_ppm=clock_drift,
        layout=layout,
        recording=None if recording == Recording() else recording,
    )
    traces = count(len(done.trace_directories), "trace")
    print_status(f"{traces}, {count(done.event_count, 'event')} written to {directory}")


def _nanoseconds(seconds: float) -> int:
    return round(seconds * _SECOND)


def _scenarios() -> list[str]:
    from msgflow_sim import scenarios

    return list(scenarios())


def _layouts() -> list[str]:
    from msgflow_sim import layouts

    return list(layouts())
