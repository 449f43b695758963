"""What goes wrong with a table map."""


class TableMapError(ValueError):
    """A map cannot be read, written or made; the message is one sentence that names the file or key."""
