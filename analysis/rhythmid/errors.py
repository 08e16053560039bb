"""The one error that a user is meant to read."""

LONGEST_MESSAGE = 1000  # characters of a message: some ten lines of a terminal
HEAD = 700  # of them from the beginning, where a longer message is shortened


class InputError(ValueError):
    """Bad input: one line that says what is wrong, where, and what to do. The command line exits with code 2.

    Messages quote files: line breaks and control characters become spaces, and what is longer than LONGEST_MESSAGE is shortened in the middle.
    """

    def __init__(self, problem: object = "") -> None:
        line = "".join(letter if letter.isprintable() else " " for letter in str(problem))
        if len(line) > LONGEST_MESSAGE:
            line = f"{line[:HEAD]} … {line[HEAD + 3 - LONGEST_MESSAGE :]}"
        super().__init__(line)
