"""What can be wrong with a recording; the text of each is one sentence for people."""


class RecordingError(Exception):
    """A recording cannot be read, written or replayed as asked."""


class NoRoomError(RecordingError):
    """The disk of a recording is nearly full; what was written so far is whole."""


class UnknownTopicError(RecordingError, KeyError):
    """A recording has no topic of that name."""

    __str__ = Exception.__str__


class UnknownFieldError(RecordingError, KeyError):
    """A topic has no field of that name."""

    __str__ = Exception.__str__
