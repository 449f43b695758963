"""What can be wrong with a recording; the text of each is one sentence for people."""


class RecordingError(Exception):
    """A recording cannot be read, written or replayed as asked."""
