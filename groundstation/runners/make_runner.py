"""A lockstep run of a rig, made by one call: for examples, tests, scenarios, campaigns."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from numbers import Integral
from types import MappingProxyType

from pydantic import ValidationError

from drivers.errors import NotFound
from drivers.laboratory import Laboratory, load_laboratory
from groundstation.bus.journal import JournalWriter, NoJournal
from groundstation.declarations.errors import RigError
from groundstation.declarations.node import Node
from groundstation.declarations.request import Request
from groundstation.declarations.rig import Rig
from groundstation.declarations.validation import first_sentence
from groundstation.rig.plan import laboratory_ports
from groundstation.runners.lockstep import PROCESS, LockstepRunner, Observer
from groundstation.runners.requests import RequestPlayer
from groundstation.runners.slot import Sequences, Slot
from groundstation.runners.step import build_slots

DEFAULT_SEED = 1


def make_runner(
    rig: Rig,
    seed: int | None = None,
    observers: Iterable[Observer] = (),
    *,
    extra_nodes: Iterable[Node] = (),
    requests: Iterable[Request] = (),
    journaled: bool = True,
    replaced: Mapping[str, Node] = MappingProxyType({}),
) -> LockstepRunner:
    """Build everything that a rig names, on one thread and in virtual time.

    Args:
        rig: The rig.
        seed: Of the laboratory; None takes the rig's, else ``DEFAULT_SEED``.
        observers: Called for each published message.
        extra_nodes: Nodes beside those of the rig, the last to receive.
        requests: What is asked of vehicles, each at its stamp.
        journaled: Whether the run can be replayed and its causes named.
        replaced: Nodes that stand in the place of the rig's, by key: ``alpha/controller``.

    Raises:
        RigError: The rig has no laboratory, its laboratory refuses its table, or a node its configuration.
    """
    journal, sequences = JournalWriter() if journaled else NoJournal(), Sequences()
    laboratory = open_laboratory(rig, seed)
    try:
        slots = build_slots(rig, None, journal, sequences, name=PROCESS, measure=False, replaced=replaced)
    except ValueError as error:  # a file of our calibration
        raise RigError(str(error)) from error
    extra = list(extra_nodes)
    asked = list(requests)
    if asked:
        extra.append(RequestPlayer(asked))
    for number, node in enumerate(extra):
        key = f"extra/{type(node).__name__}_{number}"
        slots.append(Slot(key, node, PROCESS, journal, sequences, False, vehicles=rig.vehicles))
    ports = laboratory_ports(rig, laboratory.channels())
    return LockstepRunner(slots, laboratory, ports, observers, journal, sequences)


def open_laboratory(rig: Rig, seed: int | None) -> Laboratory:
    """The laboratory of a rig, in virtual time.

    Raises:
        RigError: The rig has none, or it refuses its table.
    """
    if rig.laboratory is None:
        raise RigError("lockstep needs a [laboratory]: real hardware runs in real time")
    try:
        return load_laboratory(rig.laboratory.name, rig.laboratory.table, seed_of(rig, seed))
    except ValidationError as error:
        table = rig.laboratory.table
        sentence = first_sentence(error, lambda way: ("laboratory", *_named(way, table)))
        raise RigError(sentence) from error
    except (NotFound, ValueError) as error:  # or a file of the laboratory
        raise RigError(str(error)) from error


def seed_of(rig: Rig, seed: int | None) -> int:
    """The seed asked for, else the rig's, else ``DEFAULT_SEED``.

    Raises:
        RigError: It is no whole number from 0 up.
    """
    table = rig.laboratory.table if rig.laboratory is not None else {}
    found = table.get("seed", DEFAULT_SEED) if seed is None else seed
    if not isinstance(found, Integral) or isinstance(found, bool) or found < 0:
        key = "laboratory.seed" if seed is None else "seed"
        raise RigError(f"{key}: expected a whole number from 0 up, found {found!r}")
    return int(found)


def _named(way: Sequence[object], table: object) -> Iterator[str]:
    """The keys of a way; an entry of a list of tables by its name, as the rig's people know it."""
    for step in way:
        if isinstance(table, list) and isinstance(step, int) and step < len(table):
            table = table[step]
            yield str(table.get("name", step) if isinstance(table, dict) else step)
        else:
            table = table.get(step) if isinstance(table, dict) else None
            yield str(step)
