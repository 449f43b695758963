"""Who holds control shows it by a token."""

import hashlib
import hmac
import secrets


class Tokens:
    """Who holds control shows it by a token, which no console has to remember: another one accepts it, too.

    Args:
        secret: Of this run.
    """

    def __init__(self, secret: bytes) -> None:
        self._secret = secret

    def of(self, name: str) -> str:
        """The token of a name."""
        mark = hmac.new(self._secret, name.encode(), hashlib.sha256).hexdigest()
        return f"{name.encode().hex()}.{mark}"

    def name(self, token: str) -> str:
        """The name of a token; empty for one that is none."""
        try:
            name = bytes.fromhex(token.partition(".")[0]).decode()
            given = token.encode()
        except ValueError:  # JSON can carry letters that no text has
            return ""
        return name if secrets.compare_digest(given, self.of(name).encode()) else ""
