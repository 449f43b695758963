"""What can be wrong with a recording; the text of each is one sentence for people."""


class RecordingError(Exception):
    """A recording cannot be read, written or replayed as asked."""


class NoRoomError(RecordingError):
    """The disk of a recording is nearly full; what was written so far is whole."""
