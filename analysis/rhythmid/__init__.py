"""rhythmid identifies rhythmic robots: harmonic transfer functions, parameters, delays and missing physics, from bags."""

__version__ = "0.1.0"
