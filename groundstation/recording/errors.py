"""What can be wrong with a recording; the text of each is one sentence for people."""


class RecordingError(Exception):
    """A recording cannot be read, written or replayed as asked."""


class NoRoomError(RecordingError):
    """The disk of a recording is full, or nearly so."""


class LostFileError(RecordingError):
    """What was written to a file cannot be reached by any name; it is noticed while it is written."""


class DeletedFileError(LostFileError):
    """A file has no name any more: what was written to it is lost."""


class UnreachableFileError(LostFileError):
    """A file lies on a disk that was unmounted, or over which another lies: what it holds is there."""


class NothingRecoveredError(RecordingError):
    """A damaged recording holds no message that can be read."""


class UnknownTopicError(RecordingError, KeyError):
    """A recording has no topic of that name."""

    __str__ = Exception.__str__


class UnknownFieldError(RecordingError, KeyError):
    """A topic has no field of that name."""

    __str__ = Exception.__str__
