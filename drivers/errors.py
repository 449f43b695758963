"""What can go wrong with a device."""


class DeviceError(Exception):
    """A device did not do what it is for; the message is one sentence for its operator."""


class NotFound(DeviceError):  # noqa: N818
    """There is no such device at that address."""


class LinkLost(DeviceError, TimeoutError):  # noqa: N818
    """A device that was there fell silent or went away."""


class Refused(DeviceError):  # noqa: N818
    """The device is there and said no."""
