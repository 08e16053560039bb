"""Message about samples at rest: there friction takes any value up to the breakaway force, so no law of the motion
predicts the effort. They count only against a model that would move the machine."""

# least share of samples at rest for a message: leaving out a tenth widens intervals by 1/sqrt(0.9), a twentieth
TOLD = 0.1


def told(share: float) -> str | None:
    """Message that the machine is at rest, or close to it, in a share of the samples; None where this share is small."""
    if share < TOLD:
        return None
    return f"{share:.0%} of the samples are in or beside rests, at which friction balances any effort: they are no rows of the fit, and count only against a model that would move the machine there"
