"""The catalogue: a file becomes an element by lying there."""

import sys

import numpy as np
import pytest

from rhythmid.elements.catalogue import BUILT_IN, load_catalogue
from rhythmid.elements.element import SLOTS, Element, Parameter
from rhythmid.errors import InputError
from rhythmid.model import Model
from rhythmid.simulation.simulate import simulate

INERTER = '''\
"""Inerter: F = -b dv/dt, here driven by the actuator alone as F = -b/(m + b) f."""

from rhythmid.elements.element import Element, Parameter


def kernel(x, v, t, f, inertance, mass):
    return -inertance / (mass + inertance) * f


ELEMENT = Element(
    name="inerter",
    slot="force",
    title="Inerter",
    equation="F = -b/(m+b) f",
    parameters=(Parameter("inertance", "kg", "inertance b", bounds=(0.0, 1e9)),),
    borrows={"mass": ("inertia.mass", None)},
    kernel=kernel,
    size="inertance",
    reference="M. C. Smith, Synthesis of mechanical networks: the inerter, IEEE TAC 47(10), 2002",
)
'''
MODEL = """
inertia: {mass: 2.0}
force:
  - periodic_forcing: {amplitude: 6.0, frequency: 1.0}
  - inerter: {inertance: 1.0}
"""


def test_every_file_of_the_package_is_one_element_named_like_it():
    catalogue = load_catalogue()
    files = {path.stem: path.parent.name for slot in SLOTS for path in (BUILT_IN / slot).glob("[a-z]*.py")}
    assert {element.name: element.slot for element in catalogue.values()} == files
    assert {"gravity", "linear_spring", "switched_damper", "input_delay", "measurement_delay"} <= set(
        catalogue
    )


@pytest.mark.parametrize("folder", ["", "force"], ids=["beside each other", "in folders of slots"])
def test_a_new_element_is_one_file_in_a_folder_and_simulates(folder, tmp_path):
    (tmp_path / folder).mkdir(exist_ok=True)
    (tmp_path / folder / "inerter.py").write_text(INERTER, encoding="utf-8")
    model = Model.from_text(MODEL, catalogue=load_catalogue([tmp_path]))
    t = np.linspace(0.0, 3.0, 200)
    run = simulate(model, t)
    omega = 2 * np.pi
    np.testing.assert_allclose(run.position, 6.0 / 3.0 * (1 - np.cos(omega * t)) / omega**2, atol=1e-11)


def test_a_changed_element_file_is_compiled_anew(tmp_path):
    file = tmp_path / "inerter.py"
    last = []
    for sign in ("-inertance", "+inertance"):
        file.write_text(INERTER.replace("-inertance", sign), encoding="utf-8")
        model = Model.from_text(MODEL, catalogue=load_catalogue([tmp_path]))
        last.append(simulate(model, np.array([0.0, 0.5])).position[-1])
    assert last[0] == pytest.approx(2.0 * 2 / (2 * np.pi) ** 2)
    assert last[1] == pytest.approx(4.0 * 2 / (2 * np.pi) ** 2)


def test_an_installed_package_brings_elements_by_entry_point(tmp_path, monkeypatch):
    (tmp_path / "springs_and_things.py").write_text(INERTER, encoding="utf-8")
    described = tmp_path / "springs_and_things-1.0.dist-info"
    described.mkdir()
    (described / "METADATA").write_text(
        "Metadata-Version: 2.1\nName: springs-and-things\nVersion: 1.0\n", "utf-8"
    )
    (described / "entry_points.txt").write_text(
        "[rhythmid.elements]\ninerter = springs_and_things:ELEMENT\n", "utf-8"
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "springs_and_things", raising=False)
    catalogue = load_catalogue()
    assert catalogue["inerter"].source == "springs_and_things:ELEMENT"
    run = simulate(Model.from_text(MODEL, catalogue=catalogue), np.array([0.0, 0.5]))
    assert run.position[-1] == pytest.approx(4.0 / (2 * np.pi) ** 2)


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        ("x = 1\n", "defines no ELEMENT"),
        ("ELEMENT = 3\n", "defines no ELEMENT"),
        ("def kernel(:\n", "does not load: SyntaxError"),
        ("import nonsense_that_is_not_installed\n", "does not load: ModuleNotFoundError"),
        (INERTER.replace("    kernel=kernel,\n", ""), "needs exactly one of kernel, delay, sampler"),
        (INERTER.replace('slot="force"', 'slot="leg"'), "slot 'leg' is none of command, actuator, force"),
        (INERTER.replace('name="inerter"', 'name="gravity"'), "'gravity' is already defined in"),
    ],
)
def test_a_file_that_is_no_element_is_refused_by_name(content, problem, tmp_path):
    (tmp_path / "broken.py").write_text(content, encoding="utf-8")
    with pytest.raises(InputError) as refused:
        load_catalogue([tmp_path])
    message = str(refused.value)
    assert message.startswith(f"{tmp_path / 'broken.py'}: ") and problem in message and "\n" not in message


def test_a_folder_without_elements_is_refused(tmp_path):
    with pytest.raises(InputError, match="no such folder of elements"):
        load_catalogue([tmp_path / "missing"])
    with pytest.raises(InputError, match="holds no element files"):
        load_catalogue([tmp_path])


@pytest.mark.parametrize(
    ("kernel", "problem"),
    [
        ("lambda x, v, t, f, inertance, mass: 0.0", "a plain function written with def"),
        ("max", "source text cannot be read"),
    ],
)
def test_a_kernel_that_cannot_be_compiled_is_refused_by_name(kernel, problem, tmp_path):
    (tmp_path / "inerter.py").write_text(
        INERTER.replace("kernel=kernel", f"kernel={kernel}"), encoding="utf-8"
    )
    model = Model.from_text(MODEL, catalogue=load_catalogue([tmp_path]))
    with pytest.raises(InputError, match=f"element 'inerter': .*{problem}"):
        simulate(model, np.array([0.0, 1.0]))


@pytest.mark.parametrize(
    ("body", "problem"),
    [
        (
            "return undefined_name * x",
            "element inerter: its kernel does not compile: NameError: name 'undefined_name'",
        ),
        ("return [x, v]", "element inerter: its kernel does not compile: No implementation of function"),
        ("return -inertance / (mass + inertance)\n    syntax error", "does not load"),
    ],
)
def test_a_kernel_that_does_not_compile_is_refused_in_one_line(body, problem, tmp_path):
    text = INERTER.replace("return -inertance / (mass + inertance) * f", body)
    (tmp_path / "inerter.py").write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as refused:
        simulate(Model.from_text(MODEL, catalogue=load_catalogue([tmp_path])), np.array([0.0, 1.0]))
    assert problem in str(refused.value) and "\n" not in str(refused.value)


def test_an_unknown_element_is_refused_with_the_nearest_name():
    with pytest.raises(InputError, match="unknown element 'linear_sprung'; did you mean 'linear_spring'?"):
        load_catalogue()["linear_sprung"]


def test_a_catalogue_can_be_reduced():
    catalogue = load_catalogue()
    reduced = catalogue.without("gravity", "linear_spring")
    assert set(catalogue) - set(reduced) == {"gravity", "linear_spring"}


def test_an_element_declares_exactly_one_effect():
    with pytest.raises(TypeError, match="exactly one of kernel, delay, sampler"):
        Element("thing", "force", "Thing", "F = 0", (Parameter("size", "N", "size"),), "none")
