"""Compiles a model's structure, once for all models that differ only in parameter values.

`generated_source` writes the module; `machine_code` compiles it or loads it from the cache.
"""

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhythmid.model import Model, Term
from rhythmid.simulation.generated_source import Layout, generate, generate_rates
from rhythmid.simulation.machine_code import Module, load_run
from rhythmid.simulation.right_hand_side import InputKind, Variant


@dataclass(frozen=True)
class Compiled:
    """A compiled structure.

    `run(times, ku, cu, kw, cw, kd, cd, parameters, start, max_step, out)` integrates from times[0], where the state
    is `start`, and fills a row of `out` for each time; it returns the number of finite rows. Knots and cubic pieces
    belong to the command (ku, cu), the forcing (kw, cw) and, where compiled with `disturbed`, to a further force on
    the mass (kd, cd). `resume` takes one more argument, the history of signals (`NO_HISTORY` for none), and returns
    with the rows the history that the next run needs to continue. The global interpreter lock is released
    meanwhile.
    """

    layout: Layout
    run: Callable[..., int]
    resume: Callable[..., tuple[int, NDArray[np.float64]]]


NO_HISTORY = np.empty((0, 0))
USUAL = Variant()  # force input, position output


def _of(module: Module, layout: Layout) -> Compiled:
    run: Callable[..., Any] = load_run(module)
    if not layout.history:
        return Compiled(layout, run, lambda *given: (run(*given[:-1]), NO_HISTORY))

    def resume(*given: Any) -> tuple[int, NDArray[np.float64]]:
        *before, past = given
        return run(*before, past if past.size else np.empty((0, layout.history)))

    return Compiled(layout, lambda *given: resume(*given, NO_HISTORY)[0], resume)


def _key(terms: tuple[Term, ...]) -> Hashable:
    """Equal for terms that compile to the same code, whatever their values; kernels are compared by the content of
    their code."""
    return tuple(
        (
            term.label, term.element.name, term.element.slot, term.element.acts, term.element.family,
            term.element.states, term.element.memories, term.element.history, term.element.dead_time,
            tuple(term.element.borrows.items()),
            tuple(parameter.name for parameter in term.element.parameters),
            getattr(term.element.kernel, "__code__", None),
        )
        for term in terms
    )  # fmt: skip


@lru_cache(maxsize=512)
def _structure(key: Hashable, terms: "_Terms", variant: Variant) -> Compiled:
    return _of(*generate(terms.terms, variant))


@dataclass(frozen=True, eq=False)
class _Terms:
    """Terms that are not part of the cache's key: models that differ in values share one compiled function."""

    terms: tuple[Term, ...]

    def __hash__(self) -> int:
        return 0

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Terms)


def compile_model(model: Model, variant: Variant = USUAL) -> Compiled:
    """The compiled structure of a model, independent of parameter values."""
    terms = tuple(term for term in model.terms if term.element.kernel is not None)
    return _structure(_key(terms), _Terms(terms), variant)


@lru_cache(maxsize=256)
def _rates(key: Hashable, terms: "_Terms", excited: InputKind) -> Compiled:
    return _of(*generate_rates(terms.terms, excited))


def compile_rates(model: Model, excited: InputKind = "force") -> Compiled:
    """The model's right-hand side at given points, for its linearisation.

    `run(times (n,), command (n,), forcing (n,), states (n, q), parameters, out (n, q + 2))` fills rows of state
    rates, sensor output and total actuator force. The delays of the command path are ignored; dead times of
    elements are states (`rational`). The rate of a memory state is its change over a step whose length is the
    parameter `ELAPSED`.
    """
    terms = tuple(term for term in model.terms if term.element.kernel is not None)
    return _rates(_key(terms), _Terms(terms), excited)
