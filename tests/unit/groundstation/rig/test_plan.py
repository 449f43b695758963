"""Where nodes and ports live, and what cannot be placed."""

from pathlib import Path

import pytest

from groundstation.declarations.errors import RigError
from groundstation.rig.plan import (
    gives_way,
    laboratory_ports,
    make_node,
    nodes_of,
    ports_of,
    processes_of,
    resolved_ports,
)
from groundstation.rig.read import load_rig, parse_rig

RIGS = Path(__file__).parents[4] / "examples" / "rigs"
TWO = RIGS / "two_mock_ups.toml"
DRAWN = RIGS / "drawn_fixes.toml"


def rig_with(path, more="", **changes):
    text = path.read_text()
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    return parse_rig(f"{text}\n{more}", path)


def homes(rig):
    return {placed.key: placed.process for placed in nodes_of(rig)}


def test_urgent_nodes_of_a_vehicle_share_a_process_and_commands_have_their_own():
    found = homes(load_rig(TWO))
    assert found["alpha/imu_reader"] == found["alpha/fusion"] == found["alpha/controller"] == "alpha_flight"
    assert found["alpha/spot_finder"] == found["alpha/star_tracker"] == "alpha_sky"
    assert {found[f"{vehicle}/guard"] for vehicle in load_rig(TWO).vehicles} == {"commands"}


def test_nodes_of_one_process_come_in_the_order_of_the_tables():
    rig = load_rig(TWO)
    order = list(rig.tables.nodes)
    keys = [placed.row.name for placed in nodes_of(rig, "alpha_flight")]
    assert keys == sorted(keys, key=order.index)
    assert all(placed.vehicle == "alpha" for placed in nodes_of(rig, "alpha_flight"))
    assert nodes_of(rig, "nowhere") == []


def test_a_rig_may_give_a_node_another_process():
    rig = rig_with(TWO, '[nodes.spot_finder]\nprocess = "{vehicle}_eyes"\n')
    assert homes(rig)["alpha/spot_finder"] == "alpha_eyes"
    assert {port.channel: home for port, home in ports_of(rig)}["alpha/star_camera"] == "alpha_eyes"
    assert "alpha_eyes" in processes_of(rig)
    assert gives_way(rig, "alpha_eyes")


def test_nodes_of_several_vehicles_may_share_a_process():
    rig = rig_with(TWO, '[nodes.spot_finder]\nprocess = "eyes"\n')
    eyes = [placed.key for placed in nodes_of(rig, "eyes")]
    assert eyes == [f"{vehicle}/spot_finder" for vehicle in rig.vehicles]
    channels = {port.channel for port, home in ports_of(rig) if home == "eyes"}
    assert channels == {f"{vehicle}/star_camera" for vehicle in rig.vehicles}


@pytest.mark.parametrize(
    ("more", "sentence"),
    [
        ("[nodes.spot_finer]\nbusy_s = 0.1\n", "nodes.spot_finer: no such node (there are supervisor, "),
        (
            '[nodes.spot_finder]\nprocess = "{vehicle}_flight"\n',
            "process 'alpha_flight' holds spot_finder, which is heavy, beside ",
        ),
        ('[nodes.failure_desk]\nprocess = "alpha"\n', "'alpha' names both a vehicle and a process"),
        ("[nodes.fusion]\nbusy_s = 0.1\nlate_s = 0.1\n", "nodes.fusion: give either 'busy_s' or 'late_s'"),
    ],
)
def test_what_cannot_be_placed_is_refused_in_one_sentence(more, sentence):
    with pytest.raises(RigError) as refused:
        rig_with(TWO, more)
    assert sentence in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_node_is_made_from_its_key_and_only_where_the_rig_has_it():
    rig = load_rig(DRAWN)
    for placed in nodes_of(rig):
        assert make_node(rig, placed.key).vehicle == placed.vehicle
    for key in ("alpha/star_tracker", "bravo/fusion", "fusion", "alpha/nothing", ""):
        with pytest.raises(KeyError):
            make_node(rig, key)


def test_commands_come_first_and_every_port_has_a_process():
    rig = load_rig(TWO)
    processes = processes_of(rig)
    assert processes[0] == "commands"
    assert processes[1:] == sorted(processes[1:])
    assert {home for _, home in ports_of(rig)} <= set(processes)
    assert not gives_way(rig, "commands")


def test_addresses_of_a_laboratory_become_what_it_announced():
    rig = load_rig(DRAWN)
    channels = [port.channel for port, home in ports_of(rig) if home == "alpha_flight"]
    announced = {
        str(port.address).removeprefix("laboratory:"): f"at {port.channel}" for port, _ in ports_of(rig)
    }
    resolved = resolved_ports(rig, "alpha_flight", announced)
    assert [(port.channel, port.address) for port in resolved] == [(name, f"at {name}") for name in channels]


def test_a_channel_that_the_laboratory_lacks_is_named_with_those_that_it_has():
    rig = load_rig(DRAWN)
    sentence = r"the laboratory has no channel 'alpha/imu' \(it has: alpha/fixes, alpha/reference\)"
    has = ["alpha/reference", "alpha/fixes"]
    with pytest.raises(RigError, match=sentence):
        resolved_ports(rig, "alpha_flight", dict.fromkeys(has, "x"))
    with pytest.raises(RigError, match="the laboratory has no channel"):
        laboratory_ports(rig, has)


def test_virtual_time_takes_no_real_device():
    rig = rig_with(DRAWN, **{"laboratory:alpha/imu": "/dev/ttyUSB0"})
    with pytest.raises(RigError, match="alpha/imu: '/dev/ttyUSB0' is real hardware"):
        laboratory_ports(rig, ["valve_bus", "alpha/fixes", "alpha/reference"])


def test_a_channel_may_have_another_name_in_the_laboratory():
    rig = rig_with(DRAWN, **{"laboratory:alpha/imu": "laboratory:spare/imu"})
    names = ["valve_bus", "spare/imu", "alpha/fixes", "alpha/reference"]
    assert {port.channel for port in laboratory_ports(rig, names)} == set(names)


def test_a_channel_that_carries_something_else_is_refused():
    rig = load_rig(DRAWN.with_name("side_camera.toml"))
    kinds = {port.address.removeprefix("laboratory:"): port.carries for port, _ in ports_of(rig)}
    kinds["beta/side_camera"] = "bytes"
    with pytest.raises(
        RigError, match=r"beta/side_camera: .* carries bytes in this laboratory, expected camera"
    ):
        laboratory_ports(rig, kinds)
