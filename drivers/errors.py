"""What can go wrong with a device, as one small tree.

::

    DeviceError
    ├── NotFound    nothing is there under that name
    ├── LinkLost    it was there and went away, or fell silent (also a TimeoutError)
    └── Refused     it is there and refuses: busy, locked, no permission, bad setting

Every error carries one sentence that an operator can act on. Line noise is not an error: it is counted.
"""


class DeviceError(Exception):
    """Base of everything a driver raises on purpose."""


class NotFound(DeviceError):  # noqa: N818 - the tree reads as a sentence
    """No device answers to the given name."""


class LinkLost(DeviceError, TimeoutError):  # noqa: N818
    """A device that was there has gone away or fallen silent."""


class Refused(DeviceError):  # noqa: N818
    """A device is there but does not let us in or does not accept a setting."""
