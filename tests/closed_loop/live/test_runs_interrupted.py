"""A run that ends, or is paused, under somebody who needs it."""

import os
import signal
import subprocess
import sys
import time

import pytest

pytestmark = pytest.mark.slow

PAUSED_S = 3.0

SCENARIO = """
name = "paused"
rig = "{rig}"
duration_s = 8.0
ready_s = 60.0

[[timeline]]
at_s = 1.0
vehicle = "alpha"
request = "go_to"
arguments = {{ x_m = -0.4, y_m = 0.1, heading_deg = 30.0 }}
[[timeline]]
at_s = 6.0
mark = "late"

[[limits]]
what = "contacts"
vehicle = "all"
below = 1.0
"""


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_a_guided_calibration_whose_run_ends_says_so_and_writes_nothing(launch, two_drawn, tmp_path, number):
    run = launch(two_drawn)
    run.wait_until_flying()
    out = tmp_path / "imu.toml"
    words = ["calibrate", "guided", "imu", str(two_drawn), "--drive", "--out", str(out)]
    guided = subprocess.Popen(
        [sys.executable, "-m", "groundstation", *words],
        env=run._env, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    try:
        said = [guided.stdout.readline()]  # it has begun
        run.process.send_signal(number)
        said += guided.communicate(timeout=60)[0].splitlines()
    finally:
        guided.kill()
    text = "\n".join(said)
    assert guided.returncode in (1, 2), text
    assert "Traceback" not in text
    assert "its run has ended or hangs; nothing was written" in said[-1]
    assert not out.exists()


def test_a_scenario_that_is_paused_and_continued_has_a_verdict_and_no_process_was_killed(
    launch, two_drawn, tmp_path
):
    scenario = tmp_path / "scenario.toml"
    scenario.write_text(SCENARIO.format(rig=two_drawn))
    run = launch(scenario)
    run.wait_for("scenario running, 1 rows done")
    before = run.pids()
    pids = run.every_pid()
    for pid in pids:  # as Ctrl-Z does, of all of them; fg continues them
        os.kill(pid, signal.SIGSTOP)
    time.sleep(PAUSED_S)
    for pid in pids:
        os.kill(pid, signal.SIGCONT)
    run.wait_for("alpha: FAULT clock_jumped")
    assert run.pids() == before
    code, said = run.ends_by_itself()
    assert code in (0, 1), said
    assert "verdict: " in said
    assert "the run stood still for" in said
    assert "Traceback" not in said
    assert "starting it again" not in said
    assert "no sign of life" not in said
