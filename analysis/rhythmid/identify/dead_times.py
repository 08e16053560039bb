"""Dead times inside the machine, and where a search for them begins.

They move the poles of a controller's loop. A search that begins far off may therefore end where damping and another
dead time stand in for the true ones, and a linearised search ends there, too.
"""

from collections.abc import Iterator, Sequence

from rhythmid.model import Model

# dead times from which a search begins, in units of 1/ω of the motion: from none to a phase of half a radian, beyond which a
# controller's loop is hardly stable
STARTS = (0.0, 0.05, 0.2, 0.5)


def dead_times(model: Model) -> dict[str, str]:
    """Parameters that are dead times inside the machine, with their elements' labels."""
    return {f"{t.label}.{t.element.dead_time}": t.label for t in model.terms if t.element.history}


def with_dead_times(model: Model, names: Sequence[str], omega: float) -> Iterator[Model]:
    """The model's own values with the dead times `names` at several places, for a motion of `omega` [rad/s]; nothing
    without such names."""
    for share in STARTS if names else ():
        yield model.with_values(dict.fromkeys(names, share / omega))
