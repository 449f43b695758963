"""What a replay found, per topic and owner: counts, and the first field that differs."""

from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class Difference:
    """The first field in which a replayed payload is not the recorded one.

    Attributes:
        sequence: Of the recorded message.
        stamp_ns: Of the recorded payload.
        field: Name of the field; ``topic`` where another topic was reported.
        recorded: The recorded value.
        replayed: The replayed value.
    """

    sequence: int
    stamp_ns: int
    field: str
    recorded: str
    replayed: str

    def __str__(self) -> str:
        return (
            f"{self.field}: recorded {self.recorded}, replayed {self.replayed} "
            f"(sequence {self.sequence}, stamp {self.stamp_ns} ns)"
        )


@dataclass(slots=True)
class TopicResult:
    """How one topic of one owner compared.

    Attributes:
        noun: Of the topic.
        owner: Vehicle or process.
        equal: Payloads equal bit for bit.
        close: Payloads that differ within the tolerances.
        different: Payloads that differ beyond them.
        missing: Payloads recorded which the node did not state it in the replay.
        extra: Payloads the node reported only in the replay.
        unrecorded: Payloads reported in both, of which the recorder kept no copy to compare with.
        first: The first difference.
    """

    noun: str
    owner: str
    equal: int = 0
    close: int = 0
    different: int = 0
    missing: int = 0
    extra: int = 0
    unrecorded: int = 0
    first: Difference | None = None

    @property
    def agrees(self) -> bool:
        """Nothing differs, is missing or was added."""
        return not (self.different or self.missing or self.extra)


@dataclass(slots=True)
class ReplayReport:
    """What a replay did and found.

    Attributes:
        nodes: Keys of the nodes that were replayed.
        refused: Keys of nodes that could not be, with one sentence each.
        results: Per topic and owner, in the order of the topic table.
        inputs: Messages handed to nodes.
        ticks: Ticks told to nodes.
        before_start: Journal entries of nodes before their first recorded start: left out.
        missing_inputs: Messages a node had consumed that are not in the recording, by ``node <- topic``.
    """

    nodes: tuple[str, ...]
    refused: dict[str, str]
    results: list[TopicResult] = field(default_factory=list)
    inputs: int = 0
    ticks: int = 0
    before_start: int = 0
    missing_inputs: dict[str, int] = field(default_factory=dict)

    @property
    def agrees(self) -> bool:
        """Everything that could be compared is equal or within the tolerances."""
        return not self.missing_inputs and all(result.agrees for result in self.results)
