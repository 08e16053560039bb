"""A machine of several joints: a body, and for every joint a path of elements like that of a machine with one axis.

    body: {mjcf: leg.xml, base: rail, step: 0.00025, contacts: true}     # or urdf:; base: fixed | free | a joint
    joints:
      knee:
        command:  [{input_delay: {delay: 0.0}}, {position_control: {proportional: 60, derivative: 0.8}}]
        actuator: [{actuator_lag: {time_constant: 0.002}}]
        force:    [{coulomb_friction: {force: 0.3, transition: 0.02}}]
      hip: {}

A joint's path is a `Model` with the body's inertia: the effective inertia of the joint at the reference pose.
Damping and dry friction of a joint in the file become the elements of that name, where the path has none. `free:`
under `body:` names the inertial parameters to estimate: `free: {shank.mass: {prior: {mean: 0.4, std: 0.04}},
shank.payload: {}, knee.armature: {}}`. A payload is at the end of its link; `ends: {shank: [0, 0, -0.2]}` gives
another position [m] in the link's frame; `centres: {shank: [0, 0, -0.1]}` gives a link's centre of mass.
`inertials: {shank: {mass: 0.3, centre: [0, 0, -0.1], inertia: [xx, yy, zz, xy, xz, yz]}}` replaces the inertia of a link in the file, about the centre of mass.
`gravity: [9.81, 0, 0]` [m/s^2] under `body:` is gravity in the world frame of the file, for a base that is mounted otherwise than the file says.
"""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import yaml
from pydantic import ConfigDict, StrictBool, TypeAdapter
from pydantic import Field as Limits

from rhythmid.body.body import BODY, Array
from rhythmid.body.inertial_parameter import ARMATURE, MASS, PAYLOAD, TURNING, described, split
from rhythmid.body.link_inertia import about_centre, ten_of
from rhythmid.body.mujoco_body import HEAVIEST, MujocoBody
from rhythmid.body.robot_file import FIXED, FREE
from rhythmid.document import Node, parse, read
from rhythmid.elements.catalogue import Catalogue, load_catalogue
from rhythmid.elements.element import SLOTS, Element
from rhythmid.errors import InputError
from rhythmid.model import INERTIA, Model
from rhythmid.output import write_text
from rhythmid.units import ROTATIONAL, TRANSLATIONAL, Units
from rhythmid.validation import Number, validated
from rhythmid.value import Value, entry_of, value_of

KINDS = ("mjcf", "urdf")
LONGEST_STEP = 0.01  # [s] largest integration step: ten times the largest step for stable contacts
MOST_GRAVITY = 100.0  # [m/s^2] of a component: four times that of Jupiter (NASA, planetary fact sheet); more is another unit
# [rad/s or m/s] transition speed for the dry friction of a body's file, which is a jump in MuJoCo
TRANSITION = 0.01


@dataclass(frozen=True)
class Machine:
    """A body and the paths of its joints.

    Attributes
    ----------
    body : with the parameters in `inertial`.
    paths : by joint, in the order of the file; the inertia of each is borrowed from the body and fixed.
    inertial : inertial parameters in the file, by "link.mass", "link.inertia", "link.payload" or "joint.armature".
    kind : format of the body's file, "mjcf" or "urdf".
    """

    body: MujocoBody
    paths: Mapping[str, Model]
    inertial: Mapping[str, Value] = field(default_factory=dict)
    kind: str = "mjcf"

    @classmethod
    def load(cls, path: str | Path, catalogue: Catalogue | None = None) -> "Machine":
        """The machine in a YAML file. Raises InputError with line, parameter and unit of an error."""
        known = load_catalogue() if catalogue is None else catalogue
        return _machine(read(path), Path(path).resolve().parent, known)

    @classmethod
    def from_text(cls, text: str, folder: Path, catalogue: Catalogue, path: str = "model.yaml") -> "Machine":
        """The machine in a YAML text; `path` is the file name used in messages, `folder` its folder."""
        return _machine(parse(text, path), folder, catalogue)

    @property
    def joints(self) -> tuple[str, ...]:
        """The joints with a path, in the file's order."""
        return tuple(self.paths)

    @property
    def turning(self) -> frozenset[str]:
        """The joints whose positions are angles; "base" is the base's joint."""
        found = {name for name, one in self.body.joints.items() if one.rotational}
        return frozenset("base" if name == self.body.base else name for name in found)

    def controlled(self, joint: str) -> bool:
        """Whether a joint's command is a position reference for a controller in its path."""
        return any(term.element.name == "position_control" for term in self.paths[joint].terms)

    @cached_property
    def parameters(self) -> dict[str, Value]:
        """All parameters: "joint.element.parameter", and "body.link.mass", "body.link.inertia", "body.link.payload" and
        "body.joint.armature" for those in the file."""
        found = {f"{BODY}.{name}": value for name, value in self.inertial.items()}
        for joint, model in self.paths.items():
            found |= {f"{joint}.{n}": v for n, v in model.parameters.items() if n != INERTIA}
        return found

    @property
    def free(self) -> list[str]:
        """Names of the parameters that are estimated."""
        return [name for name, value in self.parameters.items() if not value.fixed]

    def value(self, name: str) -> float:
        """Value of one parameter. Raises InputError for an unknown name."""
        if name not in self.parameters:
            raise InputError(f"the machine has no parameter {name!r}; it has {', '.join(self.parameters)}")
        return self.parameters[name].value

    def with_parameters(self, changes: Mapping[str, Value]) -> "Machine":
        """A copy with some parameters replaced. Raises InputError for an unknown name."""
        for name in changes:
            self.value(name)
        own = {name.partition(".")[2]: v for name, v in changes.items() if name.startswith(f"{BODY}.")}
        body = self.body.with_parameters({n: v.value for n, v in own.items()}) if own else self.body
        paths = {}
        for joint, model in self.paths.items():
            begin = f"{joint}."
            path = model.with_parameters(
                {name.removeprefix(begin): v for name, v in changes.items() if name.startswith(begin)}
            )
            paths[joint] = _with_inertia(path, body.effective_inertia(joint)) if own else path
        return replace(self, body=body, paths=paths, inertial={**self.inertial, **own})

    def with_values(self, values: Mapping[str, float]) -> "Machine":
        """A copy with some values replaced; bounds and priors stay. Raises InputError for an unknown name."""
        for name in values:
            self.value(name)
        return self.with_parameters(
            {n: replace(self.parameters[n], value=float(v)) for n, v in values.items()}
        )

    def with_path(self, joint: str, model: Model) -> "Machine":
        """A copy with another path along a joint."""
        return replace(self, paths={**self.paths, joint: model})

    def with_element(
        self, joint: str, element: Element, values: Mapping[str, float] | None = None, fixed: bool = False
    ) -> "Machine":
        """A copy with one more element along a joint."""
        return self.with_path(joint, self.paths[joint].with_element(element, values, fixed))

    def with_inertial(self, values: Mapping[str, float]) -> "Machine":
        """A copy with these values of inertial parameters "link.mass", "link.inertia", "link.payload" or
        "joint.armature", which need not be in the file."""
        known = {name: self._inertial(name, value) for name, value in values.items()}
        mentioned = replace(self, inertial={**self.inertial, **known})
        return mentioned.with_values({f"{BODY}.{name}": value for name, value in values.items()})

    def with_payload(self, link: str, mass: float, place: Array) -> "Machine":
        """A copy whose link carries a point mass [kg] at a position (3,) [m] in its frame. Raises InputError for a
        link within a chain."""
        return replace(self, body=self.body.with_ends({link: place})).with_inertial(
            {f"{link}.{PAYLOAD}": mass}
        )

    def with_inertials(self, values: Mapping[str, Array]) -> "Machine":
        """A copy whose links have these ten numbers (10,), see `MujocoBody.with_inertials`. Raises InputError as that does."""
        body = self.body.with_inertials(values)
        paths = {
            joint: _with_inertia(path, body.effective_inertia(joint)) for joint, path in self.paths.items()
        }
        return replace(self, body=body, paths=paths)

    def with_gravity(self, gravity: Array) -> "Machine":
        """A copy on which gravity (3,) [m/s^2] acts in the frame of the file's world."""
        return replace(self, body=self.body.with_gravity(gravity))

    def with_centre(self, link: str, place: Array) -> "Machine":
        """A copy whose link has its centre of mass at a place (3,) [m] of its frame. Raises InputError for a link that does not exist."""
        body = self.body.with_centres({link: place})
        paths = {
            joint: _with_inertia(path, body.effective_inertia(joint)) for joint, path in self.paths.items()
        }
        return replace(self, body=body, paths=paths)

    def with_load(self, link: str, ten: Array) -> "Machine":
        """A copy whose link, without its payload, has these ten numbers (10,), in the file's mass and inertia, too, where it lists them. Raises
        InputError as `with_inertials` does."""
        made = self.with_inertials({link: ten})
        listed = [name for name in self.inertial if split(name) in ((link, MASS), (link, TURNING))]
        return made.with_inertial({name: made.body.parameters[name] for name in listed}) if listed else made

    def _inertial(self, name: str, value: float) -> Value:
        parameter = described(name)
        units = _units(self.body, name)
        fixed = self.inertial[name].fixed if name in self.inertial else True
        return Value(value, units.of(parameter.unit), fixed, parameter.bounds)

    def _loaded(self) -> list[str]:
        """The links with a payload in the file."""
        return [owner for owner, kind in map(split, self.inertial) if kind == PAYLOAD]

    def to_yaml(self, beside: Path | None = None) -> str:
        """The machine as YAML text for a file in the folder `beside`; `load` is the inverse."""
        path = self.body.path if beside is None else Path(os.path.relpath(self.body.path, beside))
        body: dict[str, Any] = {self.kind: str(path), "base": self.body.base}
        body |= {"step": self.body.step, "contacts": self.body.contacts}
        if self.body.hold:
            body["hold"] = dict(self.body.hold)
        if self.body.mounted:
            body["gravity"] = self.body.gravity.tolist()
        if self.body.replaced:
            body["inertials"] = {link: _written(ten) for link, ten in self.body.replaced.items()}
        if ends := {link: self.body.ends[link].tolist() for link in self._loaded()}:
            body["ends"] = ends
        if centres := {link: np.asarray(place).tolist() for link, place in self.body.centres.items()}:
            body["centres"] = centres
        if self.inertial:
            body["free"] = {
                name: entry_of(value, described(name)) | {"fixed": value.fixed}
                for name, value in self.inertial.items()
            }
        content: dict[str, Any] = {"body": body, "joints": {}}
        for joint, model in self.paths.items():
            content["joints"][joint] = {
                slot: entries
                for slot, entries in yaml.safe_load(model.to_yaml()).items()
                if slot in SLOTS and entries
            }
        return yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=110)

    def save(self, path: str | Path) -> None:
        """Write the machine, completely or not at all. Raises InputError when the location is not writable."""
        write_text(Path(path), self.to_yaml(Path(path).resolve().parent))


def describes_machine(path: str | Path) -> bool:
    """Whether a model file describes a machine of several joints. Raises InputError where it cannot be read."""
    value = read(path).value
    return isinstance(value, dict) and BODY in value


def _with_inertia(model: Model, inertia: float) -> Model:
    return replace(model, mass=replace(model.mass, value=inertia))


def _units(body: MujocoBody, name: str) -> Units:
    """Units of a parameter "owner.kind", which belongs to a joint or to a link."""
    owner, kind = split(name)
    return ROTATIONAL if kind == ARMATURE and body.joints[owner].rotational else TRANSLATIONAL


def _machine(document: Node, folder: Path, catalogue: Catalogue) -> Machine:
    keys = document.mapping([BODY, "joints"])
    for name in (BODY, "joints"):
        if name not in keys:
            document.fail(f"'{name}:' is missing")
    body, kind = _body(keys[BODY], folder)
    given = keys["joints"].mapping()
    if not given:
        keys["joints"].fail("names no joint")
    for name, node in given.items():
        if name not in body.joints:
            if name in body.idle:
                node.fail(
                    f"moves no mass in {body.path.name}; give its link a mass there, or leave the joint out here"
                )
            node.fail(f"{body.path.name} has no such joint; it has {', '.join(body.joints)}")
        if name == body.base:
            node.fail("is the joint of the base, which nothing drives; leave it out here")
    body = body.with_losses(name for name in body.joints if name not in given)
    free = keys[BODY].mapping().get("free")
    inertial = {} if free is None else _free(free, body)
    # a given inertia is independent of the mass
    changed = {
        n: v.value for n, v in inertial.items() if v.value != body.parameters[n] or split(n)[1] == TURNING
    }
    body = body.with_parameters(changed) if changed else body
    order = sorted(given, key=lambda name: body.joints[name].velocity)
    paths = {name: _path(given[name], name, body, catalogue) for name in order}
    return Machine(body, paths, inertial, kind)


def _written(ten: Array) -> dict[str, Any]:
    mass, centre, inertia = about_centre(ten)
    return {"mass": mass, "centre": centre.tolist(), "inertia": inertia.tolist()}


Gravity = Annotated[Number, Limits(ge=-MOST_GRAVITY, le=MOST_GRAVITY)]


@dataclass(frozen=True)
class _Inertial:
    """Inertia of a link as it is written: mass [kg], its centre [m] in the link's frame, and xx, yy, zz, xy, xz, yz [kg*m^2] about it."""

    __pydantic_config__ = ConfigDict(extra="forbid")
    mass: Annotated[Number, Limits(gt=0.0, le=HEAVIEST)]
    centre: tuple[Number, Number, Number]
    inertia: tuple[Number, Number, Number, Number, Number, Number]

    @property
    def ten(self) -> Array:
        """The ten numbers (10,)."""
        return ten_of(self.mass, np.array(self.centre), np.array(self.inertia))


@dataclass(frozen=True)
class _Body:
    """A body as written in the file."""

    __pydantic_config__ = ConfigDict(extra="forbid")
    mjcf: str | None = None
    urdf: str | None = None
    base: str = FIXED
    step: Annotated[Number, Limits(ge=1e-7, le=LONGEST_STEP)] | None = None
    contacts: StrictBool = True
    hold: list[str] | dict[str, Number] | None = None
    free: dict[str, Any] | None = None
    ends: dict[str, tuple[Number, Number, Number]] | None = None
    inertials: dict[str, _Inertial] | None = None
    gravity: tuple[Gravity, Gravity, Gravity] | None = None
    centres: dict[str, tuple[Number, Number, Number]] | None = None


_BODY: TypeAdapter[_Body] = TypeAdapter(_Body)


def _body(node: Node, folder: Path) -> tuple[MujocoBody, str]:
    given = validated(node, _BODY)
    named = {kind: name for kind in KINDS if (name := getattr(given, kind)) is not None}
    if len(named) != 1:
        node.fail("name one file: mjcf: leg.xml, or urdf: leg.urdf")
    kind, name = next(iter(named.items()))
    try:
        hold = given.hold if isinstance(given.hold, dict) else dict.fromkeys(given.hold or (), 0.0)
        body = MujocoBody.load(folder / name, given.base, given.step, given.contacts, hold)
        body = body if given.gravity is None else body.with_gravity(given.gravity)
        body = body.with_inertials({link: one.ten for link, one in (given.inertials or {}).items()})
        ends, centres = (
            {link: np.array(place) for link, place in (one or {}).items()}
            for one in (given.ends, given.centres)
        )
        return body.with_centres(centres).with_ends(ends), kind
    except InputError as error:
        raise InputError(f"{node.at(kind).place}: {error}") from None


def _free(node: Node, body: MujocoBody) -> dict[str, Value]:
    found, known = {}, body.parameters
    for name, entry in node.mapping().items():
        if name not in known:
            entry.fail(f"{body.path.name} has no such parameter; it has {', '.join(known)}")
        said = {} if entry.value is None else entry.mapping()
        value = {"value": Node(known[name], entry.place, entry.path), **said}
        made = value_of(replace(entry, value=value), described(name), _units(body, name))
        found[name] = made
    return found


def _path(node: Node, joint: str, body: MujocoBody, catalogue: Catalogue) -> Model:
    """The path of one joint, with the damping and dry friction of the body's file where it has none of its own."""
    sections = {} if node.value is None else node.mapping(SLOTS)
    units = ROTATIONAL if body.joints[joint].rotational else TRANSLATIONAL
    mass = {"value": body.effective_inertia(joint), "unit": units.mass, "fixed": True}
    inertia = {
        "mass": Node({k: Node(v, node.place, node.path) for k, v in mass.items()}, node.place, node.path)
    }
    model = Model.from_document(
        replace(node, value={"inertia": Node(inertia, node.place, node.path), **sections}), catalogue
    )
    names = {term.element.name for term in model.terms}
    said = body.passive[joint]
    if said.damping > 0.0 and "viscous_damper" not in names:
        model = model.with_element(catalogue["viscous_damper"], {"damping": said.damping})
    if (
        said.friction > 0.0
        and not {"coulomb_friction", *catalogue["coulomb_friction"].special_case_of} & names
    ):
        values = {"force": said.friction, "transition": TRANSITION}
        model = model.with_element(catalogue["coulomb_friction"], values)
    return model


__all__ = ["FIXED", "FREE", "Machine", "describes_machine"]
