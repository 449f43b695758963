"""A campaign is the same rows on one worker, on two, on a cluster, and however often it is killed."""

import contextlib
import csv
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from groundstation.campaign.errors import CampaignError
from groundstation.campaign.flying import died
from groundstation.campaign.known_rows import row_check
from groundstation.campaign.plan import Plan
from groundstation.campaign.running import Means, run_campaign
from groundstation.cli.main import call
from groundstation.scenario.loading import load

RIG = Path(__file__).parents[2] / "examples" / "rigs" / "two_mock_ups_drawn.toml"
SCENARIO = f"""
name = "small campaign"
rig = "{RIG.as_posix()}"
duration_s = 2.0
changes = {{ "mock_ups.standard.fusion.rest_s" = 0.5 }}

[[limits]]
what = "position_error_rms_mm"
vehicle = "alpha"
from_s = 1.0
below = 8.0
[[limits]]
what = "least_distance_mm"
vehicles = ["alpha", "beta"]
above = 300.0

[dispersions]
"laboratory.*.mass_kg" = {{ normal = [11.0, 0.5] }}
"laboratory.alpha.valves.spread" = {{ choice = [0.0, 0.1] }}
"""
RUNS, SEED = 6, 4


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("campaign") / "scenario.toml"
    path.write_text(SCENARIO)
    return path


@pytest.fixture(scope="module")
def rows(file, tmp_path_factory):
    """What one worker makes of it."""
    return flown(file, tmp_path_factory.mktemp("one"), Means(1))


def flown(file, folder, means, *, resume=False):
    run_campaign(load(file), Plan(RUNS, SEED), folder, means, lambda done, total: None, resume=resume)
    return (folder / "runs.csv").read_bytes()


def test_two_workers_make_the_same_rows_as_one(file, rows, tmp_path):
    assert flown(file, tmp_path, Means(2)) == rows
    assert sorted(path.name for path in tmp_path.iterdir() if path.suffix != ".parquet") == [
        "campaign.json", "report.html", "runs.csv",
    ]  # fmt: skip
    page = (tmp_path / "report.html").read_text()
    assert "of 6 passed" in page
    assert "laboratory.*.mass_kg" in page


def test_a_longer_campaign_begins_with_the_same_rows(file, rows, tmp_path):
    run_campaign(load(file), Plan(2, SEED), tmp_path, Means(1), lambda done, total: None, resume=False)
    assert rows.startswith((tmp_path / "runs.csv").read_bytes())
    assert flown(file, tmp_path, Means(1), resume=True) == rows


@pytest.mark.slow
@pytest.mark.parametrize("victim", ["parent", "worker"])
def test_killed_again_and_again_no_row_is_missing_or_double(file, rows, tmp_path, victim):
    words = [
        sys.executable, "-m", "groundstation", "campaign", str(file), "--runs", str(RUNS),
        "--seed", str(SEED), "--out", str(tmp_path / "c"), "--workers", "2",
    ]  # fmt: skip
    for kill_at in range(1, RUNS):
        resume = ["--resume"] if (tmp_path / "c" / "campaign.json").exists() else []
        with subprocess.Popen([*words, *resume], stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL) as run:
            while run.poll() is None and rows_in(tmp_path / "c") < kill_at:
                os.sched_yield()
            for pid in [run.pid] if victim == "parent" else workers_of(run.pid)[:1]:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
            if victim == "worker":
                assert run.wait(120) == 0
                break
    if victim == "parent":
        assert (
            subprocess.run([*words, "--resume"], check=False, capture_output=True, timeout=120).returncode
            == 0
        )
    assert (tmp_path / "c" / "runs.csv").read_bytes() == rows


def rows_in(folder):
    found = 0
    for name in ("runs.csv", "unordered.jsonl"):
        with contextlib.suppress(FileNotFoundError):
            found += (folder / name).read_bytes().count(b"\n")
    return found - 1


def workers_of(pid):
    """Workers of a campaign; multiprocessing's resource tracker is none."""
    children = [
        int(child)
        for task in Path(f"/proc/{pid}/task").glob("*/children")
        for child in task.read_text().split()
    ]
    return [child for child in children if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes()]


@pytest.fixture
def cluster(tmp_path):
    """A scheduler and two workers as processes of their own, on loopback."""
    base = [sys.executable, "-m"]
    with contextlib.ExitStack() as stack:
        file = tmp_path / "scheduler.json"
        options = ["--host", "tcp://127.0.0.1:0", "--no-dashboard", "--scheduler-file", str(file)]
        scheduler = stack.enter_context(
            ended(subprocess.Popen([*base, "distributed.cli.dask_scheduler", *options], **QUIET))
        )
        joined = ["--scheduler-file", str(file), "--nthreads", "1", "--no-nanny", "--no-dashboard",
                  "--host", "tcp://127.0.0.1:0", "--local-directory", str(tmp_path)]  # fmt: skip
        workers = [
            stack.enter_context(
                ended(subprocess.Popen([*base, "distributed.cli.dask_worker", *joined], **QUIET))
            )
            for _ in range(2)
        ]
        from distributed import Client

        with Client(scheduler_file=str(file), timeout=60, set_as_default=False) as client:
            client.wait_for_workers(2, timeout=60)
            address = client.scheduler.address
        yield address, workers, scheduler


QUIET = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}


@contextlib.contextmanager
def ended(process):
    try:
        yield process
    finally:
        process.kill()
        process.wait(20)


@pytest.mark.slow
def test_a_cluster_makes_the_same_rows_though_a_worker_is_killed(file, rows, tmp_path, cluster):
    address, workers, _ = cluster
    folder = tmp_path / "c"

    def kill_one(done, total):
        del total
        if done == 2:
            workers[0].kill()

    run_campaign(load(file), Plan(RUNS, SEED), folder, Means(1, address), kill_one, resume=False)
    assert (folder / "runs.csv").read_bytes() == rows


@pytest.mark.slow
def test_a_cluster_that_goes_away_is_one_sentence_and_what_it_flew_stays(
    file, rows, tmp_path, cluster, capfd
):
    address, _, scheduler = cluster
    folder = tmp_path / "c"

    def kill_it(done, total):
        del total
        if done == 2:
            scheduler.kill()

    with pytest.raises(CampaignError, match="the cluster went away; --resume"):
        run_campaign(load(file), Plan(RUNS, SEED), folder, Means(1, address), kill_it, resume=False)
    assert "Traceback" not in capfd.readouterr().err
    assert rows_in(folder) >= 2
    assert flown(file, folder, Means(2), resume=True) == rows


def test_a_cluster_that_is_not_there_is_one_sentence(file, tmp_path, capsys):
    words = [
        "campaign",
        str(file),
        "--runs",
        "1",
        "--out",
        str(tmp_path / "c"),
        "--scheduler",
        "tcp://127.0.0.1:9",
    ]
    assert call(words) == 2
    assert "no cluster answers there" in capsys.readouterr().err
    assert not (tmp_path / "c").exists()


@pytest.mark.parametrize(
    ("column", "cell"),
    [("seed", "abc"), ("verdict", "great"), ("laboratory.alpha.mass_kg", "12"), ("alpha.gas_ns", "lots")],
)
def test_a_row_that_somebody_has_edited_is_flown_again(file, rows, tmp_path, column, cell):
    plan = load(file)
    is_right = row_check(plan, Plan(RUNS, SEED))
    found = list(csv.DictReader(rows.decode().splitlines()))
    assert all(map(is_right, found))
    assert not is_right({**found[2], column: cell})
    assert is_right(died(tuple(found[2]), Plan(RUNS, SEED), 2))


def test_ctrl_c_while_workers_begin_is_one_sentence(file, tmp_path):
    words = [sys.executable, "-m", "groundstation", "campaign", str(file), "--runs", "9", "--workers", "2"]
    with subprocess.Popen(
        [*words, "--out", str(tmp_path / "c")], stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as run:
        while run.poll() is None and not workers_of(run.pid):
            os.sched_yield()
        os.killpg(run.pid, signal.SIGINT)  # as a terminal does: the workers get it, too
        assert run.stderr.read().splitlines() == [
            f"groundstation: ended by hand; --resume goes on with what {tmp_path / 'c'} holds"
        ]
        assert run.wait(60) == 130


def test_a_campaign_is_not_continued_on_another_rig(file, tmp_path):
    rig = tmp_path / "rig.toml"
    rig.write_text(RIG.read_text())
    path = tmp_path / "scenario.toml"
    path.write_text(file.read_text().replace(RIG.as_posix(), rig.name))
    words = ["campaign", str(path), "--runs", "1", "--workers", "1", "--out", str(tmp_path / "c")]
    assert call(words) == 0
    rig.write_text(rig.read_text().replace("0.0003, -0.0001", "0.0004, -0.0001"))
    assert call([*words, "--resume"]) == 2


def test_a_run_that_raises_is_a_row_and_not_the_end(file, tmp_path):
    path = tmp_path / "scenario.toml"
    path.write_text(SCENARIO + '"vehicles.alpha.start.x_m" = { normal = [-0.9, 1.0] }\n')
    run_campaign(load(path), Plan(4, 2), tmp_path / "c", Means(1), lambda done, total: None, resume=False)
    text = (tmp_path / "c" / "runs.csv").read_text()
    assert text.count("\n") == 5
    assert ",error," in text
    assert "vehicles.alpha.start: (" in text
    assert ",passed," in text


def test_one_run_is_flown_again_and_recorded(file, rows, tmp_path, capsys):
    words = [
        "campaign",
        str(file),
        "--runs",
        str(RUNS),
        "--seed",
        str(SEED),
        "--out",
        str(tmp_path),
        "--only",
        "3",
    ]
    assert call(words) == 0
    assert (tmp_path / "run_3.mcap").exists()
    assert (tmp_path / "run_3" / "report.html").exists()
    verdict = rows.decode().splitlines()[4].split(",")[2]
    assert f"run 3: {verdict}" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("sweep", "words"),
    [("laboratory.alpha.mas_kg=10:12:2", "--sweep laboratory.alpha.mas_kg = 10: "),
     ("laboratory.alpha.mass_kg=12:-1:2", "--sweep laboratory.alpha.mass_kg = -1: "),
     ("laboratory.beta.mass_kg=10:12:600000", "1200000 runs are too many")],
)  # fmt: skip
def test_a_sweep_that_cannot_be_flown_is_one_sentence(file, tmp_path, capsys, sweep, words):
    asked = ["--runs", "2", "--out", str(tmp_path / "c"), "--sweep", sweep]
    assert call(["campaign", str(file), *asked]) == 2
    sentence = capsys.readouterr().err
    assert words in sentence
    assert sentence.count("\n") == 1
    assert not (tmp_path / "c").exists()


@pytest.mark.parametrize("option", [["--resume"], ["--scheduler", "tcp://127.0.0.1:9"]])
def test_one_run_is_flown_here_and_alone(file, tmp_path, capsys, option):
    asked = ["--runs", "2", "--only", "1", "--out", str(tmp_path / "c"), *option]
    assert call(["campaign", str(file), *asked]) == 2
    assert "--only flies one run here and alone" in capsys.readouterr().err
    assert not (tmp_path / "c").exists()


def test_a_sweep_gives_its_key_a_column(file, tmp_path):
    words = ["campaign", str(file), "--runs", "1", "--out", str(tmp_path / "c"), "--workers", "1"]
    assert call([*words, "--sweep", "laboratory.beta.mass_kg=10:12:2"]) == 0
    with (tmp_path / "c" / "runs.csv").open(newline="") as file_of_rows:
        assert [row["laboratory.beta.mass_kg"] for row in csv.DictReader(file_of_rows)] == ["10", "12"]
