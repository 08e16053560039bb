"""Effects concealed at one joint of machines of several joints, and diagnosed from untidy logs.

    python benchmarks/legs.py [--cases N] [--seed S] [--bodies leg,arm,quadruped] [--computed] [--json FILE]

Every case draws a body, and a joint and an effect or none; the plant has the effect, the diagnosis has not. Logs have stamps that jitter by
0.3 ms, an encoder's steps, noise of 1 % on the torque and lost messages. In half of the cases the reference is held from stamp to stamp and the
torque is sampled at the instant; in the others the reference is smooth. The diagnosis is not told which. With --computed only
references and positions are recorded: the torque is computed from the controllers, and effects of the command path are concealed as well. Counted with Wilson's 95 % intervals: joint right
(something is named there; marked: named, undecided or unknown), joint and effect right (the effect, one that the answer lists as
indistinguishable from it, or one of its family), 95 % intervals of the values of effects that are named as they are, both also where the effect's share of what the refitted nominal path misses of the joint's effort, by power, is above 10 %, and joints without an
effect at which something was named.
"""

import argparse
import json
import math
import sys
import time as clock
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from legged import MODELS, hop, recorded, references

from rhythmid.body.machine import Machine
from rhythmid.diagnose.joints.joint_diagnosis import diagnose_machine
from rhythmid.elements.catalogue import load_catalogue
from rhythmid.errors import InputError
from rhythmid.identify.inverse_dynamics.estimate import fit_effort
from rhythmid.identify.joints.held_reference import balances_of, likely_readings
from rhythmid.record.joint_record import JointRecord

BODIES = ("leg", "arm", "quadruped")
NULLS = 0.15  # share of cases without any effect
HELD = 0.5  # share of cases whose references are held
SHARE = 0.1  # of the mismatch, above which an effect has to be named
# [s]: steps of 1 ms, as the models have them, change the masses that an effort balance finds by 0.6 %, these by less than 0.1 %
STEP = 1e-4
LASTS = {"leg": 18.0, "arm": 20.0, "quadruped": 16.0}  # [s]
# sizes as shares of the rms of the joint's effort (N m), or of what they multiply
EFFECTS = ("coulomb_friction", "actuator_lag", "actuator_gain", "actuator_delay", "constant_force", "linear_spring",
           "link_mass", "payload", "armature", "actuator_deadband", "stribeck_friction")  # fmt: skip
# effects of the command path, which are not visible in a recorded torque
COMMANDS = ("input_delay", "command_lag", "command_hold", "reference_rate_limit")
DELAYS = ("actuator_delay", "input_delay")
RATES = (30.0, 40.0, 50.0, 60.0)  # Hz, of drives that hold their commands: round ones, as drives have


@dataclass(frozen=True)
class Case:
    """One case and its answer."""

    number: int
    body: str
    joint: str
    effect: str
    size: float
    held: bool
    share: float
    verdict: str
    named: tuple[tuple[str, str], ...]
    joints: int
    right_joint: bool
    right_effect: bool
    marked: bool
    false: int
    unknown: int
    lead: bool
    seconds: float
    intervals: tuple[tuple[str, float, float, float], ...]  # value, its true one, value and std of the answer

    @property
    def within(self) -> int:
        """How many of the 95 % intervals have the true value."""
        return sum(abs(value - true) <= 1.96 * std for _, true, value, std in self.intervals)


def concealed(
    machine: Machine, joint: str, effect: str, effort: float, speed: float, rng: np.random.Generator
):
    """The plant with the effect at the joint, its size drawn, and its values by the answer's names, the size first; `effort` is the rms of the joint's, `speed` the largest of its
    reference."""
    catalogue = load_catalogue()
    share = float(rng.uniform(0.08, 0.25))
    if effect == "input_delay":
        late = float(rng.uniform(0.008, 0.015))
        return machine.with_values({f"{joint}.input_delay.delay": late}), {"delay": late}
    if effect == "link_mass":
        links = [name for name in machine.body.links if machine.body.joint_of(name) == joint]
        name = f"{links[-1]}.mass"
        factor = 1.0 + float(rng.choice([-1.0, 1.0]) * rng.uniform(0.25, 0.5))
        size = factor * machine.body.parameters[name]
        return machine.with_inertial({name: size}), {"mass": size}
    if effect == "payload":  # its place differs from the end of the link that the diagnosis assumes
        link = carried_at(machine, joint)[0]
        place = machine.body.ends[link] * float(rng.uniform(0.8, 1.2))
        size = float(rng.uniform(0.2, 0.6)) * machine.body.parameters[f"{link}.mass"]
        beyond = replace(machine, body=replace(machine.body, ends={link: place}))
        values = {"mass": size, **dict(zip("xyz", place.tolist(), strict=True))}
        return beyond.with_inertial({f"{link}.payload": size}), values
    if effect == "armature":
        own = f"{joint}.armature"
        factor = float(rng.uniform(1.5, 2.5))
        more = (factor - 1.0) * machine.body.parameters[own]
        return machine.with_inertial({own: more + machine.body.parameters[own]}), {"inertia_error": more}
    values = {
        "coulomb_friction": {"force": share * effort, "transition": 0.03},
        "stribeck_friction": {
            "force": share * effort, "static_ratio": 2.0, "stribeck_speed": 0.3, "transition": 0.03
        },
        "actuator_lag": {"time_constant": float(rng.uniform(0.006, 0.012))},
        "actuator_gain": {"gain": 1.0 - share},
        "actuator_delay": {"delay": float(rng.uniform(0.006, 0.01))},
        "constant_force": {"force": share * effort},
        "linear_spring": {"stiffness": 4.0 * share * effort, "rest_length": float(rng.uniform(-0.5, 0.5))},
        "actuator_deadband": {"threshold": share * effort},
        "command_lag": {"time_constant": float(rng.uniform(0.008, 0.015))},
        "command_hold": {"period": 1.0 / float(rng.choice(RATES))},
        "reference_rate_limit": {"rate": float(rng.uniform(0.4, 0.6)) * speed},
    }[effect]  # fmt: skip
    element = catalogue[effect]
    return machine.with_element(joint, element, values), values


def carried_at(machine: Machine, joint: str) -> list[str]:
    """The links that may carry a payload and that the joint itself moves."""
    return [link for link in machine.body.ends if machine.body.joint_of(link) == joint]


def asked(body: str, machine: Machine, time, rng: np.random.Generator):
    """References of a body."""
    if body == "leg":
        return hop(time, rng)
    if body == "arm":
        middles = {joint: (float(rng.uniform(-0.4, 0.4)), 0.35) for joint in machine.joints}
        return references(middles, time, rng, (0.15, 1.6))
    middles = {j: ((-1.5 if "calf" in j else 0.8 if "thigh" in j else 0.0), 0.25) for j in machine.joints}
    return references(middles, time, rng, (0.3, 4.0))


def family(name: str) -> str:
    """The family of an element; its own name where it is none."""
    catalogue = load_catalogue()
    return (catalogue[name].family if name in catalogue else "") or name


def share_of(
    machine: Machine, plant: Machine, joint: str, effect: str, record: JointRecord, without: JointRecord
) -> float:
    """Share of the power of the nominal path's effort error that adding the effect to the path removes, both refitted.

    A delay cannot be evaluated from the motion: there the reference is the nominal path's error on a record `without` the effect.
    """

    def missed(one: Machine, of: JointRecord) -> float:
        balances = likely_readings(balances_of(one, [of]), [of])[0]
        return fit_effort(balances.balance(joint), balances.models[joint]).error

    least = missed(machine, without) if effect in DELAYS else missed(plant, record)
    return 1.0 - (least / missed(machine, record)) ** 2


def simulated(body: str) -> Machine:
    """The machine of a body at short steps; they are also the time for which its controllers hold their commands."""
    machine = Machine.load(MODELS / f"{body}.yaml")
    machine.body.model.opt.timestep = STEP
    return replace(machine, body=replace(machine.body, step=STEP))


def run(number: int, seed: int, bodies: Sequence[str], computed: bool = False) -> Case:
    """One case; with `computed` no effort is recorded."""
    rng = np.random.default_rng([seed, number])
    body = bodies[number % len(bodies)]
    machine = simulated(body)
    time = np.arange(0.0, LASTS[body], 0.002)
    given = asked(body, machine, time, rng)
    joint = str(rng.choice(machine.joints))
    there = {family(term.element.name) for term in machine.paths[joint].terms}
    lacking = [
        name for name in (*EFFECTS, *(COMMANDS if computed else ())) if family(name) not in there
    ]  # a fit absorbs what a path already has
    if not carried_at(machine, joint):
        lacking.remove("payload")
    effect = "none" if rng.uniform() < NULLS else str(rng.choice(lacking))
    plain = recorded(machine, given, time, np.random.default_rng(0))
    channel = plain.joints[joint].effort
    assert channel is not None
    plant, values = machine, {}
    if effect != "none":
        speed = float(np.abs(np.gradient(given[joint], time)).max())
        plant, values = concealed(machine, joint, effect, float(np.std(channel.value)), speed, rng)
    held = bool(rng.uniform() < HELD) or effect == "command_hold"  # which holds what is held
    record = recorded(plant, given, time, rng, held=held, with_effort=not computed)
    without = recorded(
        machine, given, time, np.random.default_rng([seed, number, 1]), held=held, with_effort=not computed
    )
    share = 0.0 if effect == "none" else share_of(machine, plant, joint, effect, record, without)
    began = clock.process_time()
    answer = diagnose_machine([record], machine).diagnosis
    named = tuple((one.place, one.element) for one in answer.missing)
    here = [one for one in answer.missing if one.joint == joint]
    intervals = tuple(
        (name, true, found.value, found.std)
        for one in here
        if one.element == effect
        for name, true in values.items()
        if (found := one.parameters.get(name)) is not None and found.std
    )
    alike = {family(effect), effect}
    groups = [
        {name.split(": ")[1] for name in group}
        for group in answer.indistinguishable
        if group[0].startswith(joint)
    ]
    right = any(
        family(one.element) in alike or any({one.element, effect} <= group for group in groups)
        for one in here
    )
    false = sum(
        1
        for other in machine.joints
        if other != joint or effect == "none"
        if any(j == other for j, _ in named)
    )
    return Case(
        number, body, joint, effect, next(iter(values.values()), 0.0), held, share, answer.verdict, named, len(machine.joints), bool(here) if effect != "none" else not named,
        right if effect != "none" else not named, bool(here) or joint in (*answer.unknown, *answer.undecided), false, len(answer.unknown),
        bool(answer.notes), clock.process_time() - began, intervals,
    )  # fmt: skip


def wilson(hits: int, count: int) -> str:
    """A share with its 95 % interval (E. B. Wilson, J. Am. Stat. Assoc. 22 (1927) 209)."""
    if not count:
        return "none"
    z, p = 1.96, hits / count
    middle = (p + z * z / (2 * count)) / (1 + z * z / count)
    half = z * math.sqrt(p * (1 - p) / count + z * z / (4 * count * count)) / (1 + z * z / count)
    return f"{hits} of {count} = {100 * p:.1f} % [{100 * max(middle - half, 0):.1f}, {100 * min(middle + half, 1):.1f}]"


def told(cases: Sequence[Case]) -> None:
    """Print the counts."""
    for body in (*dict.fromkeys(one.body for one in cases), "all"):
        some = [one for one in cases if body in (one.body, "all")]
        real = [one for one in some if one.effect != "none"]
        nulls = sum(one.joints - (one.effect != "none") for one in some)
        large = [one for one in real if one.share > SHARE]
        for which, cases_of in (("all", real), (f"share above {100 * SHARE:.0f} %", large)):
            print(f"{body}, {which}: joint marked {wilson(sum(o.marked for o in cases_of), len(cases_of))}")
            print(
                f"{body}, {which}: joint named {wilson(sum(o.right_joint for o in cases_of), len(cases_of))}"
            )
            print(
                f"{body}, {which}: effect named {wilson(sum(o.right_effect for o in cases_of), len(cases_of))}"
            )
        for held in (True, False):
            of = [one for one in real if one.held == held]
            print(
                f"{body}, {'held' if held else 'smooth'}: effect named {wilson(sum(o.right_effect for o in of), len(of))}"
            )
        ends = sum(len(one.intervals) for one in some)
        print(f"{body}: 95 % intervals with the true value {wilson(sum(one.within for one in some), ends)}")
        print(f"{body}: null joints falsely named {wilson(sum(o.false for o in some), nulls)}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=30)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--bodies", default=",".join(BODIES))
    parser.add_argument("--computed", action="store_true")
    parser.add_argument("--json", type=Path)
    given = parser.parse_args()
    cases: list[Case] = []
    for number in range(given.first, given.first + given.cases):
        try:
            cases.append(run(number, given.seed, given.bodies.split(","), given.computed))
        except InputError as error:
            print(f"{number}: {error}", flush=True)
            continue
        one = cases[-1]
        found = "; ".join(f"{joint}: {name}" for joint, name in one.named) or one.verdict
        mark = "" if one.right_effect and not one.false else " *"
        mark += "".join(
            f" {name} {value:.4g} ± {std:.2g} for {true:.4g}"
            for name, true, value, std in one.intervals
            if abs(value - true) > 1.96 * std
        )
        print(
            f"{number} {one.body} {one.joint}: {one.effect} {one.size:.3g}{' held' * one.held}{' lead' * one.lead} {100 * one.share:.0f} % -> {found}  ({one.seconds:.0f} s){mark}",
            flush=True,
        )
        if given.json is not None:
            given.json.write_text(json.dumps([asdict(c) for c in cases], indent=1))
    told(cases)


if __name__ == "__main__":
    main()
