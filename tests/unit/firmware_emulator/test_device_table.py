"""Contract of the table of devices, and a device that an installed package brings."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from pydantic import ValidationError

from drivers.errors import NotFound
from drivers.imu_block.port import SerialPort
from drivers.laboratory import ChannelKind
from firmware_emulator import device_table
from firmware_emulator.device_kind import Camera, DeviceKind, Receiver, named
from firmware_emulator.device_table import OWN, device_kinds, read_config
from firmware_emulator.laboratory import EmulatedLaboratory
from firmware_emulator.live.served import TcpServed
from firmware_emulator.scenario import Scenario
from firmware_emulator.settings import Positive, Settings

MS = 1_000_000
S = 1_000_000_000


class BeeperConfig(Settings):
    period_s: Positive
    count: int = 1


class Beeper:
    """Sends a byte drawn at random every period, and says again what it was sent."""

    def __init__(self, start_ns, config, rng):
        self.period_ns = round(config.period_s * S)
        self.next_ns = start_ns + self.period_ns
        self.rng = rng
        self.pending = []

    @property
    def next_output_ns(self):
        return self.pending[0][0] if self.pending else self.next_ns

    def run(self, now_ns):
        self.pending.append((now_ns, self.rng.bytes(1)))
        self.next_ns += self.period_ns

    def take(self, until_ns):
        taken = [item for item in self.pending if item[0] <= until_ns]
        self.pending = [item for item in self.pending if item[0] > until_ns]
        return taken

    def receive(self, stamp_ns, data):
        self.pending.append((stamp_ns, data.upper()))


def build_carried(mock_up, config):
    return Beeper(mock_up.start_ns, config, mock_up.random("beeper"))


def build_shared(site, config):
    return Beeper(site.scenario.start_ns, config, site.scenario.random("horn"))


CARRIED = DeviceKind(
    name="beeper",
    channel=ChannelKind.BYTES,
    per_vehicle=build_carried,
    section="beeper",
    settings=BeeperConfig,
    accepts=bytes,
    served_by="firmware_emulator.live.served:TcpServed",
)
SHARED = DeviceKind(
    name="horn",
    channel=ChannelKind.BYTES,
    per_laboratory=build_shared,
    section="horn",
    settings=BeeperConfig,
    served_by="firmware_emulator.live.served:TcpServed",
)


@pytest.fixture
def install(monkeypatch):
    """Makes kinds look like entry points of installed packages."""

    def offer(**kinds):
        points = [
            SimpleNamespace(
                name=name,
                value=f"somewhere:{name}",
                module="somewhere",
                dist=None,
                load=lambda kind=kind: kind,
            )
            for name, kind in kinds.items()
        ]
        monkeypatch.setattr(device_table, "entry_points", lambda group: points)
        device_kinds.cache_clear()

    yield offer
    monkeypatch.undo()
    device_kinds.cache_clear()


def scenario(**changes):
    return {"vehicles": [{"name": "alpha"}, {"name": "beta", "start_m": [1.0, 0.0]}], **changes}


def comparable(arrivals, without=()):
    return [(a.stamp_ns, a.channel, repr(a.data)) for a in arrivals if a.channel not in without]


@pytest.mark.parametrize("kind", device_kinds(), ids=lambda kind: kind.name)
def test_every_kind_can_be_served_or_drawn(kind):
    if kind.served_by:
        assert callable(named(kind.served_by))
    else:
        assert kind.channel is ChannelKind.CAMERA
    assert kind.is_shared == (kind.per_laboratory is not None)


def test_the_emulators_own_devices_come_first_and_names_are_unique():
    kinds = device_kinds()
    assert kinds[: len(OWN)] == OWN
    assert len({kind.name for kind in kinds}) == len(kinds)


def test_what_stands_in_the_laboratory_can_do_what_its_kind_says():
    for row in EmulatedLaboratory(scenario()).installed:
        assert isinstance(row.device, Receiver) == (row.kind.accepts is not None), row.channel
        assert isinstance(row.device, Camera) == (row.kind.pictures is not None), row.channel


def test_a_kind_that_accepts_data_needs_a_device_that_receives(install):
    def build_deaf(mock_up, config):
        beeper = build_carried(mock_up, config)
        return SimpleNamespace(
            next_ns=beeper.next_ns, next_output_ns=beeper.next_ns, run=beeper.run, take=beeper.take
        )

    install(beeper=replace(CARRIED, per_vehicle=build_deaf))
    carrying = {"vehicles": [{"name": "alpha", "beeper": {"period_s": 0.5}}]}
    with pytest.raises(TypeError, match="'beeper' accepts data but has no method receive"):
        EmulatedLaboratory(carrying)


def test_a_device_of_an_installed_package_has_channels_arrivals_and_an_ear(install):
    install(beeper=CARRIED, horn=SHARED)
    config = scenario(horn={"period_s": 0.3})
    config["vehicles"][1]["beeper"] = {"period_s": 0.1}
    laboratory = EmulatedLaboratory(config, seed=4)
    assert laboratory.channels()["beta/beeper"] is ChannelKind.BYTES
    assert laboratory.channels()["horn"] is ChannelKind.BYTES
    assert "alpha/beeper" not in laboratory.channels()
    arrivals = laboratory.advance(S)
    assert [a.stamp_ns for a in arrivals if a.channel == "beta/beeper"] == [
        k * 100 * MS for k in range(1, 11)
    ]
    assert [a.stamp_ns for a in arrivals if a.channel == "horn"] == [300 * MS, 600 * MS, 900 * MS]
    laboratory.deliver(S, "beta/beeper", b"hello")
    assert laboratory.next_arrival_ns() == S
    assert [a.data for a in laboratory.advance(S) if a.channel == "beta/beeper"] == [b"HELLO"]
    with pytest.raises(ValueError, match="'horn'"):
        laboratory.deliver(S, "horn", b"x")
    with pytest.raises(ValueError, match="type str"):
        laboratory.deliver(S, "beta/beeper", "x")


def test_a_device_more_leaves_the_numbers_of_all_others_alone(install):
    before = comparable(EmulatedLaboratory(scenario(), seed=4).advance(2 * S))
    install(beeper=CARRIED, horn=SHARED)
    config = scenario(horn={"period_s": 0.3})
    config["vehicles"][0]["beeper"] = {"period_s": 0.01}
    after = EmulatedLaboratory(config, seed=4).advance(2 * S)
    assert comparable(after, without=("horn", "alpha/beeper")) == before


def test_named_parts_draw_their_own_numbers():
    made = Scenario(read_config(scenario()), seed=3)
    draws = {
        name: random.bytes(8)
        for name, random in {
            "laboratory": made.random("horn"),
            "other part": made.random("bell"),
            "alpha": made.random_of_vehicle(0, "horn"),
            "beta": made.random_of_vehicle(1, "horn"),
            "numbered": made.random_of_vehicle(1, "line"),
            "other seed": Scenario(read_config(scenario()), seed=4).random("horn"),
        }.items()
    }
    assert len(set(draws.values())) == len(draws)
    assert made.random("horn").bytes(8) == draws["laboratory"]


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"horn": {"period_s": 0.3, "colour": 1}}, "horn.colour"),
        ({"horn": {"period_s": -0.3}}, "horn.period_s"),
        ({"horn": {}}, "horn.period_s"),
        ({"beeper": {"period_s": 0.3}}, "beeper"),  # a thing of vehicles
        ({"hron": {"period_s": 0.3}}, "hron"),
    ],
)
def test_a_wrong_section_of_an_installed_device_names_its_key(install, change, key):
    install(beeper=CARRIED, horn=SHARED)
    with pytest.raises(ValidationError) as raised:
        EmulatedLaboratory(scenario(**change))
    assert ".".join(map(str, raised.value.errors()[0]["loc"])) == key


def test_a_section_without_its_package_is_an_unknown_key(install):
    install()
    with pytest.raises(ValidationError) as raised:
        EmulatedLaboratory(scenario(horn={"period_s": 0.3}))
    assert raised.value.errors()[0]["loc"] == ("horn",)


def rival(name, section):
    return DeviceKind(
        name=name,
        channel=ChannelKind.BYTES,
        per_vehicle=build_carried,
        section=section,
        settings=BeeperConfig,
        served_by="firmware_emulator.live.served:TcpServed",
    )


@pytest.mark.parametrize(
    ("kind", "complaint"),
    [
        (rival("imu", "beeper"), "there is another kind 'imu'"),
        (rival("beeper", "imu"), "the key 'imu' means something else"),
        (rival("beeper", "mass_kg"), "the key 'mass_kg' means something else"),
        (TcpServed, "is a type, no DeviceKind"),
    ],
)
def test_a_device_that_collides_with_another_is_refused_by_name(install, kind, complaint):
    install(rival=kind)
    with pytest.raises(NotFound, match=complaint):
        EmulatedLaboratory(scenario())


def test_a_device_that_cannot_be_loaded_is_named(install, monkeypatch):
    def broken():
        raise ImportError("no module named gone")

    points = [SimpleNamespace(name="gone", value="gone:GONE", module="gone", dist=None, load=broken)]
    monkeypatch.setattr(device_table, "entry_points", lambda group: points)
    device_kinds.cache_clear()
    with pytest.raises(NotFound, match=r"'gone' of the package gone \(gone:GONE\) cannot be loaded"):
        EmulatedLaboratory(scenario())
    device_kinds.cache_clear()


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"name": "Loud Beeper"}, "lower case"),
        ({"per_laboratory": build_shared}, "one builder"),
        ({"per_vehicle": None}, "one builder"),
        ({"settings": None}, "section without settings"),
        ({"served_by": ""}, "needs served_by, or pictures"),
    ],
)
def test_a_declaration_that_contradicts_itself_is_refused(changes, complaint):
    fields = {
        "name": "beeper", "channel": ChannelKind.BYTES, "per_vehicle": build_carried, "section": "beeper",
        "settings": BeeperConfig, "served_by": "firmware_emulator.live.served:TcpServed",
    }  # fmt: skip
    with pytest.raises(ValueError, match=complaint):
        DeviceKind(**{**fields, **changes})


def test_a_device_of_an_installed_package_is_served_live(install, serving):
    install(horn=SHARED)
    with (
        serving(scenario(horn={"period_s": 0.02})) as addresses,
        SerialPort(str(addresses["horn"])) as port,
    ):
        _, chunk = port.read_chunk(5.0)
    assert chunk
