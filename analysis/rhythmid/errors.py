"""The error class for messages to the user."""

LONGEST_MESSAGE = 1000  # characters of a message: about ten lines of a terminal
HEAD = 700  # of them from the beginning, if a longer message is shortened


class InputError(ValueError):
    """Bad input: one line that says what is wrong, where, and what to do. The command line exits with code 2.

    Messages may quote files, so line breaks and control characters become spaces, and messages longer than LONGEST_MESSAGE are shortened in the middle.
    """

    def __init__(self, problem: object = "") -> None:
        line = "".join(letter if letter.isprintable() else " " for letter in str(problem))
        if len(line) > LONGEST_MESSAGE:
            line = f"{line[:HEAD]} … {line[HEAD + 3 - LONGEST_MESSAGE :]}"
        super().__init__(line)
