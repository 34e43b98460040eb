"""`msgflow simulate`: the trace of a simulated ROS 2 system."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from msgflow.cli.options import output_option

_RECORDING = "How it is recorded"
_SECOND = 1_000_000_000


def _list(is_asked: bool) -> None:
    """Print each system with its description, then end."""
    if not is_asked:
        return
    from msgflow.cli.output import print_list
    from msgflow_sim import scenarios

    print_list([(name, scenario.description) for name, scenario in scenarios().items()])
    raise typer.Exit


def command(
    scenario: Annotated[
        str,
        typer.Argument(
            metavar="SCENARIO", help="Name of the system", autocompletion=lambda: _scenarios()
        ),
    ],
    _: Annotated[
        bool,
        typer.Option(
            "--list", callback=_list, is_eager=True, help="List the available systems and exit"
        ),
    ] = False,
    factor: Annotated[
        float,
        typer.Option("--factor", min=0, help="Length, as a multiple of the scenario's default"),
    ] = 1,
    seed: Annotated[int, typer.Option("--seed", help="Random seed")] = 0,
    layout: Annotated[
        str | None,
        typer.Option(
            "--layout",
            metavar="NAME",
            help="Release of ROS 2 to imitate, such as jazzy, or humble-fastdds for an instrumented"
            " DDS",
            show_default="that of the scenario",
            autocompletion=lambda: _layouts(),
        ),
    ] = None,
    start_late: Annotated[
        float,
        typer.Option(
            "--start-late",
            metavar="SECONDS",
            min=0,
            help="Start recording after SECONDS: no initialisation events",
            rich_help_panel=_RECORDING,
        ),
    ] = 0,
    dual_session: Annotated[
        bool,
        typer.Option(
            "--dual-session",
            help="Also record a snapshot session with the initialisation events that --start-late"
            " misses",
            rich_help_panel=_RECORDING,
        ),
    ] = False,
    pause: Annotated[
        tuple[float, float] | None,
        typer.Option(
            "--pause",
            metavar="START END",
            help="Record nothing between these two times, in seconds",
            rich_help_panel=_RECORDING,
        ),
    ] = None,
    rotate: Annotated[
        list[float] | None,
        typer.Option(
            "--rotate",
            metavar="SECONDS",
            help="Start a new chunk of the trace at this time; may be repeated",
            rich_help_panel=_RECORDING,
        ),
    ] = None,
    per_process: Annotated[
        bool,
        typer.Option("--per-process", help="One trace per process", rich_help_panel=_RECORDING),
    ] = False,
    lose_events: Annotated[
        float,
        typer.Option(
            "--lose-events",
            metavar="SHARE",
            min=0,
            max=1,
            help="Share of packets after which events are lost",
            rich_help_panel=_RECORDING,
        ),
    ] = 0,
    lose_packets: Annotated[
        float,
        typer.Option(
            "--lose-packets",
            metavar="SHARE",
            min=0,
            max=1,
            help="Share of packets that are missing",
            rich_help_panel=_RECORDING,
        ),
    ] = 0,
    cut: Annotated[
        int,
        typer.Option(
            "--cut",
            metavar="STREAMS",
            min=0,
            help="Number of streams per trace to truncate mid-packet",
            rich_help_panel=_RECORDING,
        ),
    ] = 0,
    perf: Annotated[
        bool,
        typer.Option(
            "--perf",
            help="perf, not LTTng, records the kernel, in systems with a kernel trace",
            rich_help_panel=_RECORDING,
        ),
    ] = False,
    slew: Annotated[
        float,
        typer.Option(
            "--slew",
            metavar="PPM",
            help="Drift of source stamps against the clock of the trace (positive: faster)",
            rich_help_panel=_RECORDING,
        ),
    ] = 0,
    clock_offset: Annotated[
        float,
        typer.Option(
            "--clock-offset",
            metavar="SECONDS",
            help="How far each host's clock is ahead of the previous host's",
            rich_help_panel=_RECORDING,
        ),
    ] = 0,
    clock_drift: Annotated[
        float,
        typer.Option(
            "--clock-drift",
            metavar="PPM",
            help="How much faster each host's clock runs than the previous host's",
            rich_help_panel=_RECORDING,
        ),
    ] = 0,
    output: Annotated[
        Path | None,
        output_option("DIR", "Folder to write the trace into", show_default="SCENARIO"),
    ] = None,
) -> None:
    """Write the trace of a simulated ROS 2 system, and the links that really happened."""
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
