"""The hypotheses of a diagnosis on a Matplotlib axis."""

import math
from textwrap import fill

from matplotlib.axes import Axes

from rhythmid.diagnose.answer.result import Diagnosis
from rhythmid.diagnose.constants import FALSE_ALARM
from rhythmid.report.hypotheses import most_weighed
from rhythmid.report.quantity import NONE, number, pretty_name, probability

CHOSEN, OTHER = "tab:blue", "0.45"
LETTERS = 24  # characters a line of a hypothesis' name


def draw_hypotheses(axis: Axes, diagnosis: Diagnosis, most: int) -> None:
    """Draw a dot with its standard error for each of the `most` best hypotheses.

    The axis is linear up to 1 and logarithmic beyond. The probability stands at the right, or a dash where the
    hypothesis has no share in the evidence.
    """
    shown = diagnosis.hypotheses[:most]
    weighed = most_weighed([(one.elements, one.probability) for one in diagnosis.hypotheses])
    chosen = {effect.element for effect in diagnosis.missing}
    for place, one in enumerate(shown):
        taken = set(one.elements) == chosen
        colour = CHOSEN if taken else OTHER
        axis.errorbar(
            one.score_difference, place, xerr=one.standard_error or 0.0, fmt="o", color=colour, capsize=3.0
        )
        axis.annotate(
            probability(one.probability) if len(one.elements) <= weighed else NONE,
            (1.02, place), xycoords=("axes fraction", "data"), va="center", color=colour, annotation_clip=False,
        )  # fmt: skip
    names = [" + ".join(map(pretty_name, one.elements)) or "nominal model alone" for one in shown]
    axis.set_yticks(range(len(shown)), [fill(name, LETTERS) for name in names])
    axis.set_ylim(len(shown) - 0.5, -0.5)
    axis.set_xscale("symlog", linthresh=1.0)
    farthest = max(one.score_difference + (one.standard_error or 0.0) for one in shown)
    least = -math.log(FALSE_ALARM)
    axis.set_xlim(-0.3, 2.0 * max(farthest, least))
    axis.xaxis.set_major_formatter(lambda value, _: number(value, 3))
    axis.axvline(least, color="black", linestyle=":", linewidth=1.0)
    axis.annotate(
        f"{1.0 / FALSE_ALARM:.0f} to 1",
        (least, 1.01),
        xycoords=("data", "axes fraction"),
        ha="center",
        fontsize="small",
    )
    axis.annotate("probability", (1.02, 1.01), xycoords="axes fraction", fontsize="small")
    axis.grid(axis="x", alpha=0.3)
    axis.set_xlabel("predicts worse than the best by\n(difference of log density)")
