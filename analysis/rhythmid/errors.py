"""The one error that a user is meant to read."""


class InputError(ValueError):
    """Bad input: one line that says what is wrong, where, and what to do. The command line exits with code 2."""
