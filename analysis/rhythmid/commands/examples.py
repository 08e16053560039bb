"""Examples at the end of a command's help."""

from collections.abc import Sequence


def epilog(examples: Sequence[str]) -> str:
    """The end of a command's help: one example a line. The help joins lines that no empty one parts."""
    return "\n\n".join(["Examples:", *(f"  {line}" for line in examples)])
