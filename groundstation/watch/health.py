"""What ports and nodes report about themselves: the newest of each, and what of it is news."""

from groundstation.parts.operation.messages import Diagnostics

_SOON_AGAIN = "; next try in "  # what differs from one failure of a port to its next


class Health:
    """Takes diagnostics.

    Attributes:
        ports: The newest report of each port, by channel.
        nodes: The newest report of each node, by its key.
    """

    def __init__(self) -> None:
        self.ports: dict[str, Diagnostics] = {}
        self.nodes: dict[str, Diagnostics] = {}

    def take(self, report: Diagnostics) -> str:
        """Account for a report; return its summary if that is news for people, else nothing."""
        is_port = bool(report.summary) and not report.keys
        known = self.ports if is_port else self.nodes
        before = known.get(report.node)
        known[report.node] = report
        what = report.summary.partition(_SOON_AGAIN)[0]
        is_new = before is None or before.summary.partition(_SOON_AGAIN)[0] != what
        # a port that was opened is always news
        return report.summary if is_new or (is_port and report.level == 0) else ""
