"""Every fix that fusion was shown is accounted for: recorded, shown while running, and in the report."""

import json

from groundstation.bus.envelope import Delivered, Envelope
from groundstation.launch.lockstep_run import run_lockstep
from groundstation.parts.fusion.messages import FixAccount
from groundstation.parts.stars.messages import StarFix
from groundstation.parts.table import installed_tables
from groundstation.rig.read import parse_rig
from groundstation.watch.monitor import Monitor
from groundstation.watch.report import write_report

WRONG = (
    '\n[[laboratory.faults]]\nkind = "false_lights"\nvehicle = "alpha"\nstart_s = 4.0\nend_s = 6.0\n'
    '\n[[laboratory.faults]]\nkind = "stuck_gyro"\nvehicle = "alpha"\nstart_s = 8.0\nend_s = 99.0\n'
    "parameters = { code = 0.0 }\n"
)


def test_each_fix_is_accounted_for_even_if_its_packets_never_come(fly):
    flight = fly(WRONG, changes=[("rate_hz = 1.5", "rate_hz = 5.0")]).run(10.0)
    fixes = [fix.stamp_ns for fix in flight.of(StarFix, stop_s=8.7) if fix.fix]
    accounts = flight.of(FixAccount)
    assert set(fixes) <= {account.stamp_ns for account in accounts}
    # the first, too, which waited for a second one before it began the estimate
    assert len(accounts) == len({account.stamp_ns for account in accounts})
    assert min(accounts, key=lambda account: account.stamp_ns).reason == "starts the estimate"
    reasons = {account.reason for account in accounts if not account.used}
    assert "outside the gate" in reasons
    assert "no packets come" in reasons  # the gyro had died
    assert all(account.reason for account in accounts)
    assert all(account.nis > 25.0 for account in accounts if account.reason == "outside the gate")


def test_accounts_are_shown_and_reported(fly, tmp_path):
    flight = fly(WRONG).run(7.0)
    monitor, topic = Monitor(installed_tables(), ("alpha",)), FixAccount.TOPIC
    for number, account in enumerate(flight.of(FixAccount)):
        monitor.take_delivered(
            Delivered(Envelope(topic, "alpha", number, 7_000_000_000), account), 7_000_000_000
        )
    view = monitor.vehicles["alpha"]
    cells = dict(zip(view.labels(), view.rows(7_000_000_000), strict=True))
    assert "x outside the gate" in cells["  not used"].text
    assert "mean" in cells["  innovation, NIS"].text

    rig_path = tmp_path / "rig.toml"
    example = (flight.rigs / "drawn_fixes.toml").read_text()
    text = example + WRONG + "\n[mock_ups.standard.fusion]\nrest_s = 1.0\n"
    rig_path.write_text(text)
    run_lockstep(parse_rig(text, rig_path), text, rig_path, tmp_path / "run.mcap", 7.0, 1, lambda *_: None)
    written = write_report(tmp_path / "run.mcap", tmp_path / "report", lambda *_: None)
    assert tmp_path / "report" / "report.html" in written
    page = (tmp_path / "report" / "report.html").read_text()
    assert "Innovations of used fixes" in page
    assert "outside the gate" in page
    reported = json.loads((tmp_path / "report" / "report.json").read_text())["vehicles"]["alpha"]
    assert reported["fixes"]["outside the gate"] >= 1
    assert 0.1 < reported["fix_nis_mean"] < 12.0
