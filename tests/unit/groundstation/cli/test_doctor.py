"""``groundstation doctor``: lines, JSON and exit code, over the files of machines that are made up."""

import json
from pathlib import Path

import pytest

RIG = Path(__file__).parents[4] / "examples" / "rigs" / "two_mock_ups.toml"
GOVERNOR = "sys/devices/system/cpu/cpu0/cpufreq/scaling_governor"
CAN = {"type": "280", "flags": "0x0", "statistics/rx_errors": "0", "statistics/tx_errors": "0"}


@pytest.fixture
def root(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # whose disk is looked at
    made = tmp_path / "root"
    (made / GOVERNOR).parent.mkdir(parents=True)
    (made / GOVERNOR).write_text("powersave\n")
    return made


def test_a_warning_is_exit_code_0_and_says_what_to_do(root, groundstation):
    shown = groundstation("doctor", "--root", root)
    assert shown.exit_code == 0
    assert "WARN  processor clock: the governor is powersave of 1" in shown.output
    assert "-> echo performance | sudo tee" in shown.output


def test_something_bad_is_exit_code_1(root, groundstation):
    for name, text in CAN.items():
        file = root / "sys/class/net/can0" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    shown = groundstation("doctor", "--root", root)
    assert shown.exit_code == 1
    assert "BAD   CAN: can0 is down" in shown.output


def test_as_json_each_finding_has_its_verdict(root, groundstation):
    found = json.loads(groundstation("doctor", "--root", root, "--json").output)
    assert {row["verdict"] for row in found} <= {"OK", "WARN", "BAD"}
    assert all(bool(row["advice"]) == (row["verdict"] != "OK") for row in found)


def test_an_emulated_rig_needs_no_devices(root, groundstation):
    shown = groundstation("doctor", RIG, "--root", root)
    assert shown.exit_code == 0
    assert "OK    alpha/star_camera: emulated" in shown.output


def test_it_looks_at_this_machine(groundstation):
    assert groundstation("doctor").exit_code in (0, 1)
