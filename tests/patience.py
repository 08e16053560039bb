"""How long tests wait. They assert on what the software guarantees, and not on when a busy machine gets round to it."""

PATIENCE = 120.0
"""Seconds for what is promised to happen at all."""

UNHURRIED = 1000.0
"""As `stale_after` [s]: how late measurements come on a busy machine is not what the test is about."""

LONG = 600.0
"""Seconds after which a test that starts processes is ended; each of its waits is bounded by less."""
