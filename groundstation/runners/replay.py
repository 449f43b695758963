"""The replay runner: the recording's stamps are the clock, its journal is the order of things.

Each chosen node is built anew and told exactly what it was given then: started, handed the recorded
inputs at the recorded moments, ticked, stopped. What it publishes is compared with what was recorded. One
pass over the file in log order; memory holds what lies between a message and its journal entry.
"""

from collections import deque
from collections.abc import Callable, Collection

from groundstation.bus.journal import Journal, Kind, packed_entries, read_entries
from groundstation.declarations.errors import UsageError
from groundstation.declarations.node import Node
from groundstation.recording.policy import is_kept
from groundstation.recording.reader import Recorded, Recording
from groundstation.recording.writer import Recorder
from groundstation.runners.replay_comparison import Comparison
from groundstation.runners.replay_node import NodeFactory, ReplayedNode
from groundstation.runners.replay_report import ReplayReport
from groundstation.runners.tolerances import EXACT, Tolerances

LOOK_AHEAD_NS = 2_000_000_000
"""A recorder may log a message by so much later than the journal of the process that consumed it."""


def recorded_nodes(recording: Recording) -> tuple[str, ...]:
    """Keys of all nodes whose start is in the journal, sorted."""
    found: set[str] = set()
    for message in recording.messages([Journal]):
        journal = message.payload
        assert isinstance(journal, Journal)
        entries = packed_entries(journal)
        starts = entries["node"][entries["kind"] == Kind.START]
        found.update(journal.names[index] for index in starts.tolist())
    return tuple(sorted(found))


class ReplayRunner:
    """Replays nodes of one recording.

    Args:
        recording: Open recording.
        factory: Makes a node of its key; called once per start in the journal.
        nodes: Keys of the nodes to replay; None for every node whose inputs were recorded.
        tolerances: What may differ; nothing by default.
        output: Takes what the nodes publish now; messages published only now carry sequence 0.

    Raises:
        UsageError: A node asked for is not in the journal, its inputs were not recorded, or nothing is
            left to replay.
    """

    def __init__(
        self,
        recording: Recording,
        factory: NodeFactory,
        nodes: Collection[str] | None = None,
        tolerances: Tolerances = EXACT,
        output: Recorder | None = None,
    ) -> None:
        self._factory = factory
        self._policy = recording.info.images
        present = recorded_nodes(recording)
        prepared: dict[str, Node] = {}
        refused: dict[str, str] = {}
        for key in present if nodes is None else dict.fromkeys(nodes):
            if key not in present:
                known = ", ".join(present) or "none"
                raise UsageError(f"{recording.path}: no node {key!r} is in the journal (there: {known})")
            try:
                node = factory(key)
            except KeyError:
                if nodes is not None:
                    raise UsageError(f"{recording.path}: {key!r} is no node of the rig") from None
                refused[key] = f"{key} is no node of the rig: it ran beside it"
                continue
            reason = self._why_not(key, node)
            if reason is None:
                prepared[key] = node
            elif nodes is None:
                refused[key] = reason
            else:
                raise UsageError(f"{recording.path}: {reason}")
        if not prepared:
            reason = next(iter(refused.values()), "there is no start of a node in its journal")
            raise UsageError(f"{recording.path}: {reason}")
        self._replayed_nodes = {key: ReplayedNode(key, node) for key, node in prepared.items()}
        self._report = ReplayReport(tuple(prepared), refused)
        self._comparison = Comparison(tolerances, output)
        self._backlog: deque[tuple[Journal, int]] = deque()
        received = {kind for node in prepared.values() for kind in node.inputs}
        published = {kind for node in prepared.values() for kind in node.outputs}
        self._published = {kind.TOPIC.noun for kind in published}
        self._queues: dict[tuple[str, str], list[deque[Recorded]]] = {}
        self._stream = recording.messages(received | published | {Journal})
        self._log_ns = 0

    def run(self, progress: Callable[[int], None] | None = None) -> ReplayReport:
        """Replay the whole recording; call it once.

        Args:
            progress: Told the log time now and then.
        """
        given_ns = 0
        while self._pull():
            while self._backlog:
                self._follow(*self._backlog.popleft())
            if progress is not None and self._log_ns >= given_ns:
                progress(self._log_ns)
                given_ns = self._log_ns + 1_000_000_000
        for node in self._replayed_nodes.values():
            self._leave(node)
        self._report.results = self._comparison.finish()
        return self._report

    def _why_not(self, key: str, node: Node) -> str | None:
        for kind in node.inputs:
            if not is_kept(kind.TOPIC, self._policy):
                return (
                    f"{key} cannot be replayed: it receives {kind.TOPIC.noun}, which this recording "
                    f"does not keep (images = {self._policy.value!r})"
                )
        return None

    def _pull(self) -> bool:
        """Read one more message of the file and put it where it will be looked for."""
        message = next(self._stream, None)
        if message is None:
            return False
        self._log_ns = message.log_ns
        envelope = message.envelope
        if envelope.topic.noun == Journal.TOPIC.noun:
            journal = message.payload
            assert isinstance(journal, Journal)
            self._backlog.append((journal, message.log_ns))
        key = (envelope.topic.noun, envelope.owner)
        queues = self._queues.get(key)
        if queues is None:
            found = (node.queue_for(envelope) for node in self._replayed_nodes.values())
            queues = self._queues[key] = [queue for queue in found if queue is not None]
        for queue in queues:
            queue.append(message)
        if envelope.topic.noun in self._published:
            self._comparison.recorded(message)
        return True

    def _follow(self, journal: Journal, logged_ns: int) -> None:
        nodes = self._replayed_nodes
        for now_ns, kind, key, noun, owner, sequence, _ in read_entries(journal):
            node = nodes.get(key)
            if node is None or kind == Kind.DROP:
                continue
            if not node.is_started and kind != Kind.START:
                self._report.before_start += 1  # of an earlier life, whose start the recording missed
                continue
            if kind == Kind.OUTPUT:
                self._expect(node, noun, owner, sequence)
                continue
            self._leave(node)
            if kind == Kind.START:
                node.start(self._factory, journal.process, now_ns)
            elif kind == Kind.INPUT:
                self._hand_over(node, noun, owner, sequence, now_ns, logged_ns)
            elif kind == Kind.TICK:
                self._report.ticks += 1
                node.tick(now_ns)
            elif kind == Kind.STOP:
                node.stop(now_ns)

    def _hand_over(
        self, node: ReplayedNode, noun: str, owner: str, sequence: int, now_ns: int, logged_ns: int
    ) -> None:
        while (found := node.find(noun, owner, sequence)) is None:
            if self._log_ns > logged_ns + LOOK_AHEAD_NS or not self._pull():
                name = f"{node.key} <- {noun}"
                self._report.missing_inputs[name] = self._report.missing_inputs.get(name, 0) + 1
                return
        self._report.inputs += 1
        node.receive(found, now_ns)

    def _expect(self, node: ReplayedNode, noun: str, owner: str, sequence: int) -> None:
        """The journal states that the node published this next."""
        if node.published:
            payload, given_ns = node.published.popleft()
            self._comparison.replayed(noun, owner, sequence, payload, given_ns)
        else:
            self._comparison.missing(noun, owner)

    def _leave(self, node: ReplayedNode) -> None:
        """The node goes on to its next call: whatever of the last is not in the journal is new."""
        while node.published:
            payload, given_ns = node.published.popleft()
            self._comparison.extra(node.owner_of(payload), payload, given_ns)
