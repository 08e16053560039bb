"""`rhythmid design`: a signal to play, and what it will tell, before the run."""

from pathlib import Path
from typing import Annotated

import typer

from rhythmid.commands import joint_design, machines
from rhythmid.commands.options import Elements, JsonFile, Quiet
from rhythmid.commands.terminal import Terminal
from rhythmid.errors import InputError
from rhythmid.output import require_new, write_json

EXAMPLES = (
    "rhythmid design model.yaml --duration 60 --band 0 7 --max-effort 0.02 --envelope 0.13 0.17 --noise-std 1e-5 --output plan",
    "rhythmid design axis.yaml --no-forcing --duration 20 --band 0.2 5 --max-effort 25 --envelope -0.1 0.1 --noise-std 1e-5 --output plan",
    "rhythmid design leg.yaml --duration 20 --band 0.2 5 --max-effort 25 --noise-std 0.05 --output plan",
)


def design(
    model: Annotated[Path, typer.Argument(help="Model file; its values are assumed to be true.")],
    duration: Annotated[float, typer.Option("--duration", help="Length of the run in s.")],
    band: Annotated[
        tuple[float, float], typer.Option("--band", help="Lowest and highest frequency of the command in Hz.")
    ],
    max_effort: Annotated[
        float, typer.Option("--max-effort", help="Largest effort of the command in N (or the model's unit).")
    ],
    noise_std: Annotated[
        float,
        typer.Option(
            "--noise-std",
            help="Standard deviation of a measured sample's noise in m (or the model's unit); for a machine with several joints, of a measured force in N*m.",
        ),
    ],
    output: Annotated[
        Path,
        typer.Option("--output", help="Folder to write: samples, model, experiment, figure, prediction."),
    ],
    envelope: Annotated[
        tuple[float, float] | None,
        typer.Option(
            "--envelope",
            help="Lowest and highest position that may be measured, in m (or the model's unit); for a machine with several joints, about "
            "the reference pose, of each joint whose file states no range.",
        ),
    ] = None,
    kind: Annotated[
        str | None,
        typer.Option(
            "--kind",
            help="multisine (interleaved, least crest factor) or comb (time-shifted chirps); multisine by default.",
        ),
    ] = None,
    rate: Annotated[int, typer.Option("--rate", help="Rate of command and measurement in Hz.")] = 1000,
    harmonics: Annotated[
        int | None,
        typer.Option(
            "--harmonics",
            help="Sidebands on either side of a spectral line whose responses are separated; 3 by default.",
        ),
    ] = None,
    forcing: Annotated[
        tuple[float, float] | None,
        typer.Option(
            "--forcing",
            help="Amplitude in N and frequency in Hz of the forcing on the robot; by default the model's, else 1 1, with a note.",
        ),
    ] = None,
    no_forcing: Annotated[
        bool, typer.Option("--no-forcing", help="No forcing acts: the machine rests without a command.")
    ] = False,
    delays: Annotated[
        tuple[float, float] | None,
        typer.Option("--delays", help="Expected input and measurement delay in s; the model's by default."),
    ] = None,
    longest_delay: Annotated[
        float | None,
        typer.Option(
            "--longest-delay",
            help="Longest that either delay may be, in s; longer ones may alias; 0.3 by default.",
        ),
    ] = None,
    max_distortion: Annotated[
        float | None,
        typer.Option(
            "--max-distortion", help="Largest nonlinear part of the response, as a share of the linear one."
        ),
    ] = None,
    shifts: Annotated[
        int | None,
        typer.Option(
            "--shifts",
            help="comb: number of chirps, each starting at another phase of the forcing; 2 harmonics + 3 by default.",
        ),
    ] = None,
    period: Annotated[
        float | None,
        typer.Option(
            "--period",
            help="multisine: period in s; by default the longest that fits twice into the duration.",
        ),
    ] = None,
    spacing: Annotated[
        float | None,
        typer.Option(
            "--spacing",
            help="multisine: spacing of its spectral lines in Hz; by default the closest that does not alias.",
        ),
    ] = None,
    seed: Annotated[
        int, typer.Option("--seed", help="multisine: seed of the omitted lines and of the starting phases.")
    ] = 0,
    elements: Elements = None,
    json: JsonFile = None,
    quiet: Quiet = False,
) -> None:
    """Design an experiment: a signal as large as the limits allow, and the predicted uncertainty of every parameter."""
    of_one_axis = {
        "kind": kind, "harmonics": harmonics, "longest_delay": longest_delay, "max_distortion": max_distortion, "shifts": shifts,
        "period": period, "spacing": spacing,
    }  # fmt: skip
    if machines.is_machine(model):
        machines.refuse(forcing=forcing, no_forcing=no_forcing, delays=delays, **of_one_axis)
        from rhythmid.design.joint_design import JointRequirements

        of_joints = JointRequirements(duration, band, max_effort, noise_std, rate, envelope, seed)
        joint_design.design_files(model, of_joints, output, elements or (), json, Terminal(quiet, json))
        return
    if envelope is None:
        raise InputError("--envelope: say which positions may be measured, lowest and highest")
    from rhythmid.design.design_folder import save_design
    from rhythmid.design.designer import design as make
    from rhythmid.design.requirements import Requirements
    from rhythmid.elements.catalogue import load_catalogue
    from rhythmid.model import Model
    from rhythmid.progress_bar import progress
    from rhythmid.settings import Forcing

    require_new(output, json)
    terminal = Terminal(quiet, json)
    catalogue = load_catalogue(elements or ())
    known = Model.load(model, catalogue)
    wanted = Requirements.of(
        known, duration, band, max_effort, envelope, noise_std, rate=rate, delays=delays, seed=seed,
        forcing=None if forcing is None else Forcing(*forcing), unforced=no_forcing,
        **{name: value for name, value in of_one_axis.items() if value is not None},
    )  # fmt: skip
    with progress(terminal.progress, log=False) as tell:
        found = make(known, wanted, catalogue, tell)
        tell("writing")
        save_design(found, model, output, elements or ())
    found.show(terminal.answer)
    if json is not None:
        write_json(json, found.to_dict())
    terminal.say(f"{output}: play it with `rhythmid run {output / 'experiment.yaml'}`")
