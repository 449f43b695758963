"""What a file that cannot be used raises."""


class FileError(ValueError):
    """A file is missing, torn or states something impossible; the message is one sentence naming it."""
