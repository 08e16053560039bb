"""What is told of rests: there friction takes any value up to the breakaway force, and no law of the motion tells which effort that balances."""

TOLD = 0.1  # of the samples, from which it is told that they are left out: a tenth widens intervals by 1/sqrt(0.9), a twentieth


def told(share: float) -> str | None:
    """That the machine rests at a share of the samples, or close to them, where this is of practical size."""
    if share < TOLD:
        return None
    return f"{share:.0%} of the samples are in or beside rests, at which friction balances any effort: they are left out"
