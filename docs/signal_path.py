"""Draw docs/signal_path.png, the picture of the README: `make picture`."""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.patches import FancyBboxPatch

INK, PAPER = "#22303c", "white"
NODES = {"excitation": "#fbe3c0", "delay injector": "#d8e5f3", "plant": "#dcefd9", "recorder": "#eadcf0"}


def main() -> None:
    figure, axes = plt.subplots(figsize=(11.0, 3.7), dpi=150, facecolor=PAPER)
    axes.set(xlim=(0, 110), ylim=(2, 39))
    axes.axis("off")

    def box(
        x: float, width: float, title: str, below: str, colour: str, y: float = 22, height: float = 9
    ) -> None:
        axes.add_patch(
            FancyBboxPatch(
                (x, y), width, height, boxstyle="round,pad=0.3", facecolor=colour, edgecolor=INK, lw=1.1
            )
        )
        axes.text(
            x + width / 2,
            y + height * 0.64,
            title,
            ha="center",
            va="center",
            size=10,
            color=INK,
            weight="bold",
        )
        axes.text(x + width / 2, y + height * 0.27, below, ha="center", va="center", size=8.5, color=INK)

    def arrow(start: tuple[float, float], end: tuple[float, float], name: str = "") -> None:
        axes.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "color": INK, "lw": 1.2})
        middle = ((start[0] + end[0]) / 2, (start[1] + end[1]) / 2 + (1.2 + 0.9 * name.count("\n")))
        axes.text(*middle, name, ha="center", va="center", size=7.5, color=INK, family="monospace")

    level = 26.5
    box(1, 12, "excitation", "u(t)", NODES["excitation"])
    box(26, 15, "delay injector", "u(t − τ$_u$)", NODES["delay injector"])
    box(53, 15, "plant", "a model file", NODES["plant"])
    box(81, 15, "delay injector", "ȳ(t − τ$_y$)", NODES["delay injector"])
    arrow((13.5, level), (25.5, level), "excitation")
    arrow((41.5, level), (52.5, level), "command")
    arrow((68.5, level), (80.5, level), "plant/joint_\nstates")
    arrow((96.5, level), (109, level), "joint_states")
    axes.text(
        60.5, 36.3, "f$_0$(t): the pumping force, generated on the robot", ha="center", size=8.5, color=INK
    )
    arrow((60.5, 35.3), (60.5, 31.6))

    box(
        14,
        94,
        "recorder",
        "a bag of excitation, forcing and joint_states",
        NODES["recorder"],
        y=10,
        height=5.5,
    )
    dotted = {"arrowstyle": "-|>", "color": INK, "lw": 0.9, "ls": ":"}
    for x, top, name in ((19.5, level, ""), (60.5, 21.5, "forcing"), (103, level, "")):
        axes.annotate("", (x, 15.9), (x, top), arrowprops=dotted)
        axes.text(x + 1, 18.6, name, va="center", size=7.5, color=INK, family="monospace")
    arrow((60.5, 9.7), (60.5, 6.0))
    axes.text(
        60.5, 3.6, "rhythmid identify: transfer functions, stiffness, damping, τ$_u$ and τ$_y$, from the bag alone",
        ha="center", size=10, color=INK, weight="bold",
    )  # fmt: skip
    figure.savefig(Path(__file__).with_suffix(".png"), bbox_inches="tight", facecolor=PAPER)


if __name__ == "__main__":
    main()
