"""What a calibration file that cannot be used raises."""


class CalibrationFileError(ValueError):
    """A file is missing, torn or says something impossible; the message is one sentence naming it."""
