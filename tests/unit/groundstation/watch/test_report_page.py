"""The page of a report, of a short lockstep flight with a failure, faults and requests."""

import json
import re
import xml.etree.ElementTree as ET
from html.parser import HTMLParser
from pathlib import Path

import pytest

from groundstation.bus.envelope import Delivered, Envelope
from groundstation.declarations.errors import UsageError
from groundstation.declarations.request import Request
from groundstation.parts.operation.messages import Latency
from groundstation.recording.info import RecordingInfo
from groundstation.recording.writer import Recorder
from groundstation.rig.provenance import recording_info
from groundstation.rig.read import parse_rig
from groundstation.runners.make_runner import make_runner
from groundstation.watch.ledger import Ledger
from groundstation.watch.report import write_report
from groundstation.watch.verdict import LimitOutcome, RunEvent, Verdict

RIGS = Path(__file__).parents[4] / "examples" / "rigs"
SECOND_NS = 1_000_000_000
FAILURE = """
[mock_ups.standard.fusion]
rest_s = 1.0
{fusion}
[[laboratory.failures]]
kind = "stuck_gyro"
vehicle = "alpha"
start_s = 6.0
end_s = 7.5
"""
VOID = {"meta", "br", "hr", "img", "input", "link"}
LIMITS = (
    LimitOutcome("position_error_rms_mm", ("alpha",), 12.34, 8.0, None, held=False, at_s=4.0),
    LimitOutcome("least_distance_mm", ("alpha", "beta"), 312.0, None, 200.0, held=True, at_s=1.5),
    LimitOutcome("settling_s", ("alpha",), float("inf"), 50.0, None, held=False, at_s=9.0),
    LimitOutcome("gas_ns", (), float("nan"), 50.0, None, held=False, at_s=float("nan")),
)
VERDICT = Verdict(
    "failed",
    "position_error_rms_mm of alpha is 12.34, expected below 8",
    LIMITS,
    (RunEvent(1.25, "note", "", "alpha <has> settled"), RunEvent(2.0, "fault", "alpha", "told twice")),
    zero_s=2.5,
    title="a rehearsal",
    obstacles=((0.5, 0.5, 0.15),),
)


def request(t_s, number, action, arguments):
    return Request(round(t_s * SECOND_NS), "alpha", number, "a student", action, arguments)


def fly(path, *, fusion="", seconds=9.0, seed=1):
    rig_path = RIGS / "drawn_fixes.toml"
    text = rig_path.read_text() + FAILURE.format(fusion=fusion)
    rig = parse_rig(text, rig_path)
    requests = [
        request(4.0, 1, "go_to", '{"x_m": 0.3, "y_m": 0.1, "heading_rad": 0.5}'),
        request(4.5, 2, "go_to", '{"x_m": 30.0, "y_m": 0.1, "heading_rad": 0.5}'),
    ]
    ledger, end_ns = Ledger(), round(seconds * SECOND_NS)
    with Recorder(path, recording_info(rig, text, rig_path, seed, None)) as recorder:
        observers = [recorder.record, lambda delivered, now_ns: ledger.take_delivered(delivered)]
        runner = make_runner(rig, seed, observers, requests=requests)
        runner.run(end_ns)
        runner.close()
        ages = ledger.summary("alpha", end_ns)
        recorder.record(Delivered(Envelope(Latency.TOPIC, "alpha", 1, end_ns), ages), end_ns)
    return path


class Page(HTMLParser):
    """What is in a page; every element has to be closed where it was opened."""

    def __init__(self, text):
        super().__init__(convert_charrefs=True)
        self.open, self.attributes, self.words = [], [], []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        self.attributes += [(tag, name, value) for name, value in attributes]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.attributes += [(tag, name, value) for name, value in attributes]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.words.append(data)

    @property
    def text(self):
        return " ".join(self.words)


def report(recording, folder, **known):
    written = write_report(recording, folder, lambda text, done: None, **known)
    assert {path.name for path in written} == {"report.html", "report.json"}
    return (folder / "report.html").read_text(), json.loads((folder / "report.json").read_text())


def pictures(page):
    """Every SVG of a page by its label, parsed."""
    found = [ET.fromstring(text) for text in re.findall(r"<svg.*?</svg>", page, re.DOTALL)]
    return {picture.get("aria-label"): picture for picture in found}


def of_class(picture, *words):
    return [each for each in picture.iter() if set(words) <= set((each.get("class") or "").split())]


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return fly(tmp_path_factory.mktemp("flown") / "first.mcap")


@pytest.fixture(scope="module")
def judged(recording, tmp_path_factory):
    return report(recording, tmp_path_factory.mktemp("judged"), verdict=VERDICT)


def test_the_page_is_whole_and_asks_for_nothing_else(judged):
    page, _ = judged
    parsed = Page(page)
    for _, name, value in parsed.attributes:
        assert name not in {"src", "href", "srcset", "data", "action", "xlink:href"}
        assert "://" not in (value or "") or name == "xmlns"
    assert not {"script", "link", "img", "iframe", "object"} & {tag for tag, *_ in parsed.attributes}
    assert "<script" not in page
    assert "@import" not in page
    assert "url(" not in page
    assert not re.search(r"\bnan\b", page, re.IGNORECASE)


def test_the_page_suits_light_dark_and_paper(judged):
    page, _ = judged
    assert "prefers-color-scheme: dark" in page
    assert "@media print" in page
    assert "size: A4" in page
    style, body = page.split("</style>")
    assert not re.search(r"#[0-9a-fA-F]{3,6}\b|rgb\(", body), "colours stand in the style alone"
    used = set(re.findall(r"var\((--[\w-]+)\)", style))
    dark = style.split("prefers-color-scheme: dark")[1].split("} }")[0]
    assert used <= set(re.findall(r"(--[\w-]+):", dark)), "a colour without a dark one"


def test_verdict_and_every_limit_stand_in_the_page(judged):
    page, _ = judged
    text = Page(page).text
    for words in ("a rehearsal", "failed", VERDICT.reason, "below 8", "above 200", "12.34", "alpha, beta"):
        assert words in text
    assert ">never<" in page
    for outcome in LIMITS:
        assert outcome.what in text


def test_the_numbers_have_the_keys_that_programs_read(judged):
    _, numbers = judged
    assert numbers["verdict"] == "failed"
    assert numbers["limits"] == [
        {"what": "position_error_rms_mm", "vehicle": "alpha", "value": 12.34, "below": 8.0, "held": False,
         "at_s": 4.0},
        {"what": "least_distance_mm", "vehicles": ["alpha", "beta"], "value": 312.0, "above": 200.0,
         "held": True, "at_s": 1.5},
        {"what": "settling_s", "vehicle": "alpha", "value": None, "below": 50.0, "held": False, "at_s": 9.0},
        {"what": "gas_ns", "vehicles": [], "value": None, "below": 50.0, "held": False, "at_s": None},
    ]  # fmt: skip
    assert numbers["seed"] == 1
    assert numbers["versions"]["recorded_by"].startswith("groundstation ")
    alpha = numbers["vehicles"]["alpha"]
    assert alpha["gas_ns"] > 0.0
    assert alpha["imu_frames"] > 800
    assert len(numbers["sha256"]) == 64


def test_what_happened_is_listed_from_the_recording_and_from_the_verdict(judged):
    page, numbers = judged
    rows = {(row["kind"], row["text"]): row for row in numbers["events"]}
    failure = next(row for (kind, text), row in rows.items() if kind == "failure" and "stuck_gyro" in text)
    assert (failure["t_s"], failure["until_s"]) == pytest.approx((3.5, 5.0), abs=0.05)
    asked = [text for kind, text in rows if kind == "request"]
    assert any("go_to (x_m = 0.3" in text and text.endswith(": accepted") for text in asked)
    assert any("x_m = 30" in text and "refused: " in text for text in asked)
    assert any(kind == "fault" and text.startswith("imu_") for kind, text in rows)
    assert rows["note", "alpha <has> settled"]["t_s"] == 1.25
    assert not any(text == "told twice" for _, text in rows), "faults are read from the recording"
    moments = [row["t_s"] for row in numbers["events"]]
    assert moments == sorted(moments)
    for _, text in rows:
        assert text in Page(page).text


def test_failures_faults_requests_and_marks_stand_on_every_time_axis(judged):
    page, numbers = judged
    expected = [row["kind"] for row in numbers["events"]]
    found = pictures(page)
    over_time = {label: picture for label, picture in found.items() if of_class(picture, "marks")}
    assert set(found) - set(over_time) == {"The table from above", "Latency by stage"}
    panels = 0
    for label, picture in over_time.items():
        for marks in of_class(picture, "marks"):
            panels += 1
            for kind in ("failure", "fault", "request", "note"):
                assert len(of_class(marks, "mark", kind)) == expected.count(kind), (label, kind)
            assert len(of_class(marks, "span", "failure")) == 1
    assert panels == 1 + 2 + 3 + 3 + 4


def test_the_setpoint_is_the_controllers_own(judged):
    """After a go-to of 0.1 m the error against it grows to that; against where the rig holds it would not."""
    page, _ = judged
    line = of_class(pictures(page)["Errors against the setpoint"], "line", "v0")[0]
    heights = [float(y) for y in re.findall(r"[ML][\d.]+ ([\d.]+)", line.get("d"))]
    assert len(heights) > 100
    assert min(heights) < max(heights) - 10.0


def test_the_plan_is_to_scale(judged):
    plan = pictures(judged[0])["The table from above"]
    (table,) = of_class(plan, "table")
    (obstacle,) = of_class(plan, "obstacle")
    width, height = float(table.get("width")), float(table.get("height"))
    assert width / height == pytest.approx(4.0 / 3.0, rel=1e-3)
    assert float(obstacle.get("r")) / width == pytest.approx(0.15 / 4.0, rel=2e-3)
    x_m = (float(obstacle.get("cx")) - float(table.get("x"))) / width * 4.0 - 2.0
    y_m = 1.5 - (float(obstacle.get("cy")) - float(table.get("y"))) / height * 3.0
    assert (x_m, y_m) == pytest.approx((0.5, 0.5), abs=2e-3)
    assert len(of_class(plan, "hull")) == 2


def test_a_second_run_is_drawn_beneath_and_its_numbers_stand_beside(recording, tmp_path):
    second = fly(tmp_path / "second.mcap", seed=2, seconds=7.0)
    page, numbers = report(recording, tmp_path / "out", compare=second)
    Page(page)
    assert numbers["compared"]["recording"] == "second.mcap"
    assert numbers["compared"]["seed"] == 2
    assert numbers["compared"]["vehicles"]["alpha"]["imu_frames"] < numbers["vehicles"]["alpha"]["imu_frames"]
    for label, picture in pictures(page).items():
        assert of_class(picture, "other") or label == "Modes and events", label
    assert "alpha, first.mcap" in Page(page).text
    assert "alpha, second.mcap" in Page(page).text
    assert numbers["zero_s"] > 1.0, "both count from when they fly"


def test_without_a_verdict_the_axes_begin_with_the_recording(recording, tmp_path):
    page, numbers = report(recording, tmp_path / "new" / "out")
    assert "verdict" not in numbers
    assert numbers["zero_s"] == 0.0
    assert 'class="verdict' not in page


def test_the_published_estimator_gives_a_page_without_a_warning(tmp_path):
    page, numbers = report(
        fly(tmp_path / "run.mcap", fusion='method = "reintegration"', seconds=5.0), tmp_path / "out"
    )
    Page(page)
    assert pictures(page)["Fixes against the filter"] is not None
    assert numbers["vehicles"]["alpha"]["fix_nis_mean"] is None


def test_the_same_recording_gives_the_same_page(recording, judged, tmp_path):
    assert report(recording, tmp_path, verdict=VERDICT) == judged


def test_a_recording_without_a_state_is_refused_and_leaves_nothing(tmp_path):
    path = tmp_path / "empty.mcap"
    with Recorder(path, RecordingInfo()):
        pass
    with pytest.raises(UsageError, match="holds no vehicle state"):
        report(path, tmp_path / "out")
    assert not (tmp_path / "out").exists()
