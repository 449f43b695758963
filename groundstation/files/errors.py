"""What a file that cannot be used raises."""


class FileError(ValueError):
    """A file is missing, torn or says something impossible; the message is one sentence naming it."""
