"""A nominal model to start with: elements that the records suggest, with first guesses of all values."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rhythmid.elements.catalogue import Catalogue
from rhythmid.elements.force.pendulum_gravity import LEAST_SWING
from rhythmid.errors import InputError
from rhythmid.identify.record_scales import scales
from rhythmid.identify.series import prepare
from rhythmid.model import INERTIA, MASS, Model
from rhythmid.record.record import Channel, Record
from rhythmid.start.balance import LATEST_ACTION, Law, Rows
from rhythmid.start.balanced import UNEXPLAINED, balance_of, rest_of, restoring
from rhythmid.start.correction import Correction, offset_of
from rhythmid.start.meaning import is_measured_effort, tells_unit
from rhythmid.start.own_zeros import own_zeros_of
from rhythmid.start.roles import Roles
from rhythmid.units import ROTATIONAL, TRANSLATIONAL, Units, mass_unit
from rhythmid.value import Prior, Value

LAW_KEPT = 0.5  # largest unexplained share of an effort for which a controller is taken as its cause
CHANNELS_APART = 3.0  # samples by which channels of one recording may be apart because of filters and buses; see `direction`
# ratio to inertia times the motion's angular frequency, used where the balance shows no damping
LEAST_DAMPING = 0.01
# least relative standard deviation of gains by least squares: a controller's filters, and the sample by which its effort lags, shift them
# by a few per cent
LEAST_SPREAD = 0.05


@dataclass(frozen=True)
class Nominal:
    """A model to start with, the reason for its inertia and each of its terms (by label), what could not be
    guessed, and doubts (by label). `explained` is the share of the driving signal that a balance of forces explains, None without
    one. The values are those of the channels with the `corrections`. `massless` says that a spring and a damper explain as
    much without the inertia."""

    model: Model
    reasons: dict[str, str]
    remarks: tuple[str, ...]
    doubts: dict[str, str] = field(default_factory=dict)
    explained: float | None = None
    corrections: tuple[Correction, ...] = ()
    massless: bool = False


def nominal_of(records: Sequence[Record], roles: Roles, units: Units, catalogue: Catalogue) -> Nominal:
    """The nominal model of records with assigned roles; `units` are those of its force, position and inertia."""
    if roles.input_kind == "reference":
        return _servo(records, roles, units, catalogue)
    first = records[0]
    driven = first.input is not None or first.effort is not None
    if not driven or roles.input_kind != "force":
        return _alone(
            records, units, catalogue, "its base moves" if driven else "nothing that drives it was recorded"
        )
    return _forced(records, roles, units, catalogue)


def units_of(roles: Roles, force: str) -> Units:
    """Units of the machine: of its position by the kind of its motion, of its force as recorded, where stated."""
    usual = ROTATIONAL if roles.rotary else TRANSLATIONAL
    if force in ("", usual.force):
        return usual
    return Units(force, usual.position, mass_unit(force, usual.position))


def per_inertia(units: Units) -> Units:
    """Units of a machine with unknown forces: forces are accelerations."""
    return Units(f"{units.position}/s^2", units.position, "1")


def _bare(units: Units, mass: float = 1.0, fixed: bool = False) -> Model:
    return Model(Value(mass, units.mass, fixed, MASS.bounds), (), units)


def _forced(records: Sequence[Record], roles: Roles, units: Units, catalogue: Catalogue) -> Nominal:
    """Model from recorded force and motion, by the force balance."""
    driver = "effort" if "effort" in roles.choices else "input"
    few = CHANNELS_APART * max(record.output.period for record in records)
    acts_at_once = driver == "effort" or is_measured_effort(roles.choices[driver].recorded)
    latest = few if acts_at_once else LATEST_ACTION
    output = roles.choices["output"]
    unit_told = tells_unit(output.recorded) or output.scale != 1.0
    try:
        found = balance_of(records, _bare(units), roles.rotary, driver, unit_told, latest)
    except InputError as error:
        return _by_size(records, units, catalogue, str(error))
    law, kind, rows = found.law, found.kind, found.rows
    inertia, doubts = _shown(law, rows)
    doubts |= {INERTIA: "; ".join(found.doubts)} if found.doubts else {}
    if inertia <= 0.0:
        found_none = "the balance of forces shows no inertia"
        return replace(_by_size(records, units, catalogue, found_none), explained=0.0)
    if law.left > UNEXPLAINED:
        share = max(0.0, 1.0 - law.left)
        why = f"the balance of forces explains {f'only {share:.0%}' if share >= 0.005 else 'nothing'} of what drives, and is not used"
        return replace(_by_size(records, units, catalogue, why), explained=share)
    told = f"by the balance of forces, which explains {max(0.0, 1.0 - law.left):.0%} of what drives"
    model = _bare(units, _short(inertia))
    reasons = {INERTIA: told}
    remarks: list[str] = []
    if "reference" in roles.choices:
        model, reasons, remark = _controller(records, model, reasons, catalogue)
        remarks += [remark] if remark else []
    elif law.delay > 0.0:
        model = model.with_element(catalogue["input_delay"], {"delay": _short(law.delay)})
        reasons["input_delay"] = "the balance is better when what drives acts so much later"
        doubts |= _doubt_of_delay(law.delay, few)
    model, more = _forces(model, law, kind, rows, catalogue)
    remarks += _friction(law, units)
    corrections = found.corrections
    if not corrections and not rows.steady:
        shifted = offset_of(records, driver, units.force, kind)
        corrections = () if shifted is None else (shifted,)
    rest = [name for name in law.coefficients if name != "acceleration"]
    massless = kind == "spring" and not law.earns_place(rows.fit(rest, law.delay))
    return Nominal(model, reasons | more, tuple(remarks), doubts, 1.0 - law.left, corrections, massless)


def _doubt_of_delay(delay: float, few: float) -> dict[str, str]:
    """What is doubtful about a delay [s] that is longer than a `few` samples [s]; empty of a shorter one."""
    if delay <= few:
        return {}
    doubt = (
        f"only the balance of forces shows these {1e3 * delay:.3g} ms, and friction, ripple and lags look like a delay, too: put in what is known "
        "of the bus or the drive, or delete it"
    )
    return {"input_delay": doubt}


def _shown(law: Law, rows: Rows) -> tuple[float, dict[str, str]]:
    """The inertia of a balance, and doubts about it. An inertia is not identifiable if it follows damper and spring
    within one interval of the filtered motion: a sample, or a tenth of the shortest period above the noise."""
    found, period = law.coefficients, max(rows.period)
    doubts: list[str] = []
    if rows.steady:
        doubts.append(
            "what drives never changes: all values are by how far from its zero it holds the machine, so that this has to be the place where "
            "nothing drives it"
        )
    least = max(found["velocity"] * period, found.get("position", 0.0) * period**2)
    if found["acceleration"] < least:
        doubts.append(
            f"the records do not determine the inertia, which the balance estimates at {found['acceleration']:.1g}: the value written is the largest that "
            f"follows the other forces within {1e3 * period:.3g} ms, the interval at which the motion is known once noise is filtered "
            "out; put in what is known, and fix it"
        )
    inertia = max(found["acceleration"], least)
    return inertia, {INERTIA: "; ".join(doubts)} if doubts else {}


def _forces(
    model: Model, law: Law, kind: str, rows: Rows, catalogue: Catalogue
) -> tuple[Model, dict[str, str]]:
    """The model with the elements besides the inertia that the balance shows."""
    found, reasons, rest = law.coefficients, {}, rest_of(law, kind) or 0.0
    if kind == "spring":
        values = {"stiffness": _short(found["position"]), "rest_length": _short(rest)}
        model = model.with_element(catalogue["linear_spring"], values)
        reasons["linear_spring"] = "a force proportional to the position brings it back"
        if model.units.position == "rad" and rows.span >= 2.0 * LEAST_SWING:
            reasons["linear_spring"] += (
                "; it explains more than a pendulum's gravity, which is pendulum_gravity: {moment: …}"
            )
        elif model.units.position == "rad":
            small = "; at so small an angle a pendulum's gravity does the same: pendulum_gravity: {moment: …}"
            reasons["linear_spring"] += small
    elif kind == "pendulum":
        moment = math.hypot(found["sine"], found.get("cosine", 0.0))
        model = model.with_element(
            catalogue["pendulum_gravity"], {"moment": _short(moment), "reference": _short(rest)}
        )
        reasons["pendulum_gravity"] = (
            "a torque proportional to the sine of the angle explains more than a spring; reference: hanging"
        )
    elif kind == "constant":
        model = model.with_element(catalogue["constant_force"], {"force": _short(-found["constant"])})
        reasons["constant_force"] = (
            "a constant part is needed for the balance: gravity, or an offset of what drives"
        )
    damping, why = found["velocity"], "every machine loses energy; the value is by the balance"
    if damping <= 0.0:
        inertia = found.get("acceleration", model.mass.value)
        damping = LEAST_DAMPING * inertia * 2.0 * math.pi * rows.bandwidth.dominant
        why = "every machine loses energy; the balance shows no damping, so a small one is guessed"
    model = model.with_element(catalogue["viscous_damper"], {"damping": _short(damping)})
    return model, reasons | {"viscous_damper": why}


def _friction(law: Law, units: Units) -> list[str]:
    """A remark on dry friction that the balance needs and that the model is left without, for `diagnose` to name; none of less."""
    force = law.coefficients.get("friction", 0.0)
    if force <= 0.0:
        return []
    told = f"{force:.3g} {units.force} against the motion is needed for the balance"
    if "constant" in law.coefficients:
        told = f"No dry friction: beside the constant part {told}"
    else:
        told = f"No constant force: {told}, dry friction or a weight that it works against"
    return [f"{told}. `diagnose` looks for it; put in what is known."]


def _controller(
    records: Sequence[Record], model: Model, reasons: dict[str, str], catalogue: Catalogue
) -> tuple[Model, dict[str, str], str]:
    """The model with the position controller that computes the recorded effort from reference and motion, if there
    is one."""
    law = _control_law(records)
    if law is None or law.left > LAW_KEPT:
        left = "" if law is None else f" (a proportional and a derivative gain leave {law.left:.0%} of it)"
        return (
            model,
            reasons,
            f"No controller: the recorded effort is not what the reference would make{left}.",
        )
    gains = {
        "proportional": _short(law.coefficients["gain"]),
        "derivative": _short(law.coefficients["velocity"]),
    }
    made = model.with_element(catalogue["position_control"], gains)
    # without a prior, gains, mass and forces would have no common scale in closed loop
    spread = max(math.sqrt(law.left), LEAST_SPREAD)
    known = {name: made.parameters[f"position_control.{name}"] for name in gains}
    made = made.with_parameters({
        f"position_control.{name}": replace(one, prior=Prior(one.value, _short(spread * one.value)))
        for name, one in known.items() if one.value > 0.0
    })  # fmt: skip
    reason = (
        f"reference and effort were recorded, and these gains explain {1.0 - law.left:.0%} of the effort; their priors keep the scale of all "
        "forces"
    )
    return made, reasons | {"position_control": reason}, ""


def _control_law(records: Sequence[Record]) -> Law | None:
    """Gains of  effort = k_p (reference − position) − k_d velocity + constant."""
    sides, matrices = [], []
    for record in records:
        if record.reference is None or record.effort is None or record.output_kind != "position":
            return None
        grid = replace(record, input=None).uniform()
        assert grid.effort is not None and grid.reference is not None
        velocity = np.gradient(grid.output, grid.period)
        kept = grid.valid
        sides.append(grid.effort[kept])
        matrices.append(
            np.column_stack([grid.reference - grid.output, -velocity, np.ones(len(grid.output))])[kept]
        )
    side, matrix = np.concatenate(sides), np.vstack(matrices)
    solution = np.linalg.lstsq(matrix, side, rcond=None)[0]
    left = float(np.mean((side - matrix @ solution) ** 2) / max(float(np.var(side)), 1e-300))
    if solution[0] <= 0.0:
        return None
    return Law({"gain": float(solution[0]), "velocity": max(float(solution[1]), 0.0)}, left)


def _servo(records: Sequence[Record], roles: Roles, units: Units, catalogue: Catalogue) -> Nominal:
    """Model where only reference and motion are known: a controller, per unit of inertia."""
    model = _bare(units, 1.0, fixed=True)
    reasons = {INERTIA: "no force is known, so all is per unit of inertia"}
    law = _servo_law(records, roles.reference_of)
    late = dict[str, str]()
    if law.delay > 0.0:
        model = model.with_element(catalogue["input_delay"], {"delay": _short(law.delay)})
        reasons["input_delay"] = "the balance is better when the reference acts so much later"
        late = _doubt_of_delay(law.delay, CHANNELS_APART * max(record.output.period for record in records))
    told, doubts = "the reference drives; gains by ", late
    if law.left > UNEXPLAINED:
        told += "the frequency of the motion only"
        doubt = (
            f"a balance with the motion explains only {max(0.0, 1.0 - law.left):.0%} of the reference: see that both are what they are taken "
            "for, and put in what is known"
        )
        doubts = doubts | {f"{roles.reference_of}_control": doubt}
    else:
        told += f"a balance with the motion, which explains {1.0 - law.left:.0%} of the reference"
    gain = _short(law.coefficients["gain"])
    model, scaled, doubtful = _scaled(model, law, roles, catalogue)
    reasons, doubts = reasons | scaled, doubts | doubtful
    if roles.reference_of == "velocity":
        model = model.with_element(catalogue["velocity_control"], {"gain": gain})
        return Nominal(model, reasons | {"velocity_control": told}, (), doubts)
    derivative = _short(law.coefficients["velocity"])
    model = model.with_element(
        catalogue["position_control"], {"proportional": gain, "derivative": derivative}
    )
    remark = "No viscous damper: without a recorded effort it does what the derivative gain does."
    return Nominal(model, reasons | {"position_control": told}, (remark,), doubts)


def _scaled(
    model: Model, law: Law, roles: Roles, catalogue: Catalogue
) -> tuple[Model, dict[str, str], dict[str, str]]:
    """The model with the gain and the offset between reference and measurement that a balance shows, with reasons and doubts."""
    if "scale" not in law.coefficients:
        return model, {}, {}
    scale, offset = law.coefficients["scale"], law.coefficients["offset"]
    model = model.with_element(catalogue["sensor_gain"], {"gain": _short(scale)})
    model = model.with_element(catalogue["sensor_offset"], {"offset": _short(offset)})
    reasons = {
        "sensor_gain": "the measurement settles at a multiple of the reference",
        "sensor_offset": "and at a constant distance from that multiple",
    }
    units = [roles.choices[role].recorded.unit for role in ("input", "output") if role in roles.choices]
    if len(units) == 2 and units[0] == units[1] != "":
        doubt = f"both are stated in {units[0]}, so a load, friction or a wrong scale keeps the machine from its reference"
        return model, reasons, {"sensor_gain": doubt}
    return model, reasons, {}


def _servo_law(records: Sequence[Record], of: str) -> Law:
    """Gains of  acceleration = k_p (reference − position) − k_d velocity, by size alone where the fit is negative
    or explains almost nothing.

    The balance is solved for the reference: r = x + (a + k_d v) / k_p. Reference and measurement need not have one unit or one
    zero: `scale` and `offset` of the measurement y = scale x + offset are among the coefficients where the balance is clearly
    better with them.
    """
    as_force = [
        replace(one, input_kind="force", reference=None, effort=None, forcing=None) for one in records
    ]
    frequency = scales(prepare(as_force), _bare(TRANSLATIONAL)).frequency
    usual = (
        2.0 * math.pi * max(frequency, 1.0)
    ) * 3.0  # three times that of the motion: a servo follows its reference
    fallback = Law({"gain": usual**2 if of == "position" else usual, "velocity": 1.4 * usual}, 1.0)
    try:
        rows = Rows.of(as_force, _bare(TRANSLATIONAL))
        names = ["acceleration", "velocity", *(["position"] if of == "position" else [])]
        names += [] if rows.steady else ["constant"]  # a constant alone balances a constant reference
        law = rows.fit(names, rows.delay(names))
        tied = rows.fit([name for name in names if name not in (of, "constant")], law.delay, followed=of)
    except InputError:
        return fallback
    found, period = law.coefficients, max(rows.period)
    follows = found[of]  # r = y / scale − offset / scale + …
    if rows.steady or follows <= 0.0 or not law.earns_place(tied):
        follows, apart = 1.0, {}
    else:
        apart = {"scale": 1.0 / follows, "offset": -found["constant"] / follows}
    lag = found["velocity"]
    # an inertia that follows within one interval of the filtered motion is not identifiable and would only make the
    # model stiff
    inertial = max(found["acceleration"], lag * period)
    if inertial <= 0.0 or law.left > UNEXPLAINED:
        return replace(fallback, left=law.left)
    return Law({"gain": follows / inertial, "velocity": lag / inertial, **apart}, law.left, law.delay)


def _alone(records: Sequence[Record], units: Units, catalogue: Catalogue, why: str) -> Nominal:
    """Model of a free decay, or of a machine on a moving base: all per unit of inertia."""
    model = _bare(units, 1.0, fixed=True)
    reasons = {INERTIA: f"{why}, so all is per unit of inertia"}

    def balance(some: Sequence[Record]) -> tuple[Rows, Law, str]:
        rows = Rows.of([_as_driven(one) for one in some], model)
        return rows, *restoring(some, rows, units.position == "rad", inertial=False)

    try:
        rows, law, kind = balance(records)
    except InputError as error:
        return _by_size(records, units, catalogue, str(error), fixed=True)
    made, more = _forces(model, law, kind, rows, catalogue)
    zeros = own_zeros_of(records, law, lambda some: balance(some)[1:])
    return Nominal(made, reasons | more, tuple(_friction(law, units)), corrections=zeros)


def _as_driven(record: Record) -> Record:
    """A free decay as a motion driven by its own inertial force −a, as by a moving base."""
    if record.input is not None:
        return record
    resting = Channel(record.output.time, np.zeros(len(record.output)), record.output.unit)
    return replace(record, input=resting, input_kind="base_displacement", hold="linear", reference=None)


def _by_size(
    records: Sequence[Record], units: Units, catalogue: Catalogue, why: str, fixed: bool = False
) -> Nominal:
    """Guess without a balance: the inertia for which such a force gives such an acceleration."""
    found = scales(prepare(records), _bare(units, 1.0, fixed))
    inertial = found.position * (2.0 * math.pi * found.frequency) ** 2
    mass = 1.0 if fixed else _short(found.effort / max(inertial, 1e-12))
    model = _bare(units, mass, fixed)
    damping = 0.1 * mass * 2.0 * math.pi * found.frequency
    model = model.with_element(catalogue["viscous_damper"], {"damping": _short(damping)})
    reasons = {
        INERTIA: f"by the sizes of force and motion at {found.frequency:.3g} Hz only",
        "viscous_damper": "every machine loses energy; a damping ratio of a twentieth is a guess",
    }
    return Nominal(model, reasons, (), {INERTIA: f"{why}; put in what is known"})


def _short(value: float) -> float:
    """A first guess rounded to its significant digits."""
    return float(f"{value:.3g}") + 0.0  # no negative zero
