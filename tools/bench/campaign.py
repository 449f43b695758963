"""A campaign of two mock-ups, fixes drawn: its time, what it costs beside the flights, and its rows."""

import contextlib
import os
import random
import signal
import subprocess
import sys
import time

from bench.rows import ROOT, Bench, CpuTime, Row
from groundstation.campaign.flying import fly_run, packed
from groundstation.campaign.plan import Plan
from groundstation.campaign.running import Means, run_campaign
from groundstation.runners.make_runner import make_runner
from groundstation.scenario.loading import load

SCENARIO = ROOT / "examples" / "scenarios" / "station_keeping.toml"
RUNS, LIMIT_S, AIM_S, UNIT_S = 200, 300.0, 120.0, 0.011
KILLS, KILLED_RUNS = 10, 24
TIMED = 3
RESTS_S = 8.75
"""Of a run before t = 0: the rest, and the start."""


def measure(bench: Bench) -> list[Row]:
    """Time of 200 runs, cost beside the flight, equal rows, kills."""
    return [_time(bench), _overhead(bench), *_rows(bench)]


def _time(bench: Bench) -> Row:
    folder = bench.folder / "campaign"
    begin_s = time.monotonic()
    run_campaign(
        load(SCENARIO),
        Plan(RUNS, 1),
        folder,
        Means(2),
        lambda done, total: bench.say(f"campaign: {done} of {total} runs"),
        resume=False,
    )
    took_s = time.monotonic() - begin_s
    scaled_s = took_s * UNIT_S / bench.unit_s
    limit = f"{LIMIT_S / 60:.0f} min, aim {AIM_S / 60:.0f}, where the unit is {1e3 * UNIT_S:.0f} ms"
    measured = f"{took_s / 60:.1f} min, {scaled_s / 60:.1f} min so scaled"
    return Row(f"{RUNS} runs of 60 s, two mock-ups, 2 workers", limit, measured, scaled_s <= LIMIT_S)


def _overhead(bench: Bench) -> Row:
    """CPU time of runs as a campaign flies them, over that of the bare flights."""
    bench.say("campaign: cost beside the flight")
    scenario = load(SCENARIO)
    package = packed(scenario, Plan(TIMED + 1, 1), "bench")
    fly_run(package, TIMED)  # a worker builds once
    with CpuTime() as whole:
        for run in range(TIMED):
            fly_run(package, run)
    flown_ns = round((RESTS_S + scenario.file.duration_s) * 1e9)
    with CpuTime() as bare:
        for run in range(TIMED):
            runner = make_runner(scenario.rig, run, [], journaled=False)
            runner.run(flown_ns)
            runner.close()
    share = whole.seconds / bare.seconds - 1.0
    return Row("cost of a run beyond the flight itself", "10 %, aim 3", f"{100 * share:.1f} %", share <= 0.1)


def _rows(bench: Bench) -> list[Row]:
    """Equal rows on one and two workers; killed and resumed."""
    path = bench.folder / "short.toml"
    path.write_text(_text(), encoding="utf-8")
    words = [sys.executable, "-m", "groundstation", "campaign", str(path), "--seed", "3"]
    texts = {}
    for workers in (1, 2):
        folder = bench.folder / f"workers_{workers}"
        bench.say(f"campaign: {KILLED_RUNS} runs on {workers} workers")
        _call([*words, "--runs", str(KILLED_RUNS), "--out", str(folder), "--workers", str(workers)])
        texts[workers] = (folder / "runs.csv").read_bytes()
    equal = texts[1] == texts[2]
    killed = bench.folder / "killed"
    rng = random.Random(1)
    kills = 0
    command = [*words, "--runs", str(KILLED_RUNS), "--out", str(killed), "--workers", "2"]
    while kills < KILLS:
        resume = ["--resume"] if (killed / "campaign.json").exists() else []
        bench.say(f"campaign: killed {kills} times")
        with subprocess.Popen(
            [*command, *resume], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        ) as run:
            with contextlib.suppress(subprocess.TimeoutExpired):
                run.wait(rng.uniform(1.0, 8.0))
            if run.poll() is None:
                os.kill(run.pid, signal.SIGKILL)
                kills += 1
            else:
                break
    _call([*command, "--resume"])
    same = (killed / "runs.csv").read_bytes() == texts[1]
    return [
        Row("rows on 1 and 2 workers, byte for byte", "equal", "equal" if equal else "different", equal),
        Row(
            f"killed at {kills} random moments and resumed: rows missing or double",
            "0",
            "0" if same else "some",
            same,
        ),
    ]


def _text() -> str:
    rig = (ROOT / "examples" / "rigs" / "two_mock_ups_drawn.toml").as_posix()
    return (
        f'name = "short"\nrig = "{rig}"\nduration_s = 10.0\n'
        '[[limits]]\nwhat = "gas_ns"\nvehicle = "all"\nbelow = 50.0\n'
        '[dispersions]\n"laboratory.*.mass_kg" = { normal = [11.0, 0.3] }\n'
    )


def _call(words: list[str]) -> None:
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
