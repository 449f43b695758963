"""Two-line elements: published vectors of SGP4, the published lines and their defects, differences of two."""

import csv
import re
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from groundstation.declarations.errors import UsageError
from groundstation.files.errors import FileError
from groundstation.relative_navigation.hill import hill_transition
from groundstation.relative_navigation.two_line_elements import (
    ACCURACY,
    local_axes,
    moments,
    parse_elements,
    relative_state,
    teme_state,
)

PROGRESS = (
    "1 00181U 00181A   12025.08620288  .00013765  00000-0  17853-3 0  1018",
    "2 00181  51.6460 125.2012 0011831 248.0422 111.9298 15.21986026    37",
)
"""Of the publication on the Chibis-M; behind the second it has the full stop of its sentence."""
EXAMPLE = (
    "1 25063U 97074A   01065.47684936  .00084763  00000-0  56564-3 0  9843",
    "2 25063  34.9848 213.3710 0001408 234.2325 124.0029 15.74091534188368",
)
"""Its example; spaces are printed as asterisks there."""
VANGUARD = (
    "1 00005U 58002B   00179.78495062  .00000023  00000-0  28098-4 0  4753",
    "2 00005  34.2682 348.7242 1859667 331.7664  19.3264 10.82419157413667",
)
MOLNIYA = (
    "1 08195U 75081A   06176.33215444  .00000099  00000-0  11873-3 0   813",
    "2 08195  64.1586 279.0717 6877146 264.7651  20.2257  2.00491383225656",
)
"""Both of SGP4-VER.TLE, the verification of Vallado, Crawford, Hujsak and Kelso, AIAA 2006-6753."""


def text(*sets):
    return "\n".join(line for lines in sets for line in lines) + "\n"


def read(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def signed(line):
    """A line with its checksum."""
    body = line[:68]
    return body + str(sum(int(c) if c.isdigit() else c == "-" for c in body) % 10)


def changed(which, old, new):
    """The example with a field of other content."""
    assert EXAMPLE[which].count(old) == 1
    return signed(EXAMPLE[which].replace(old, new))


@pytest.mark.parametrize(
    ("lines", "minutes", "position_km", "velocity_km_s"),
    [
        (VANGUARD, 0.0, (7022.46529266, -1400.08296755, 0.03995155), (1.893841015, 6.405893759, 4.534807250)),
        (
            VANGUARD,
            360.0,
            (-7154.03120202, -3783.17682504, -3536.19412294),
            (4.741887409, -4.151817765, -2.093935425),
        ),
        (
            MOLNIYA,
            0.0,
            (2349.89483350, -14785.93811562, 0.02119378),
            (2.721488096, -3.256811655, 4.498416672),
        ),
    ],
)
def test_sgp4_gives_its_own_verification_vectors(lines, minutes, position_km, velocity_km_s):
    (elements,) = parse_elements(text(lines))
    position, velocity = teme_state(elements, elements.epoch + timedelta(minutes=minutes))
    # the epoch as a datetime is rounded to a microsecond: some millimetres of way
    np.testing.assert_allclose(position, 1e3 * np.array(position_km), atol=0.02)
    np.testing.assert_allclose(velocity, 1e3 * np.array(velocity_km_s), atol=2e-4)
    assert elements.is_deep_space == (lines is MOLNIYA)


def test_the_published_elements_give_what_the_publication_does_not_print():
    (progress,) = parse_elements(text(PROGRESS))
    assert progress.semi_major_axis_m == pytest.approx(6878.5e3, abs=50.0)  # not 600 km of height: 500
    assert progress.period_s == pytest.approx(5676.8, abs=0.05)
    assert progress.mean_motion_rad_s == pytest.approx(1.106819e-3, abs=1e-9)
    assert abs(progress.epoch - datetime(2012, 1, 25, 2, 4, 7, 930000, UTC)) < timedelta(seconds=0.01)
    assert relative_state(progress, progress, progress.epoch).height_m == pytest.approx(503.6e3, abs=50.0)
    assert not progress.notes


def test_the_full_stop_of_a_sentence_is_left_out_and_noted():
    (progress,) = parse_elements(text((PROGRESS[0], PROGRESS[1] + ".")))
    assert progress.lines == PROGRESS
    assert progress.notes == ("line 2: a full stop behind column 69 was left out",)


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ((EXAMPLE[0].replace(" ", "*"), EXAMPLE[1]), "line 1: column 2 holds an asterisk"),
        ((EXAMPLE[0] + "7", EXAMPLE[1]), "line 1: 70 characters, expected 69"),
        ((EXAMPLE[0][:-1], EXAMPLE[1]), "line 1: 68 characters, expected 69"),
        ((EXAMPLE[0][:-1] + "4", EXAMPLE[1]), "line 1: checksum is 4, the line adds up to 3"),
        ((EXAMPLE[0], EXAMPLE[1][:-1] + "x"), "line 2: checksum is x, the line adds up to 8"),
        ((EXAMPLE[0], PROGRESS[1]), "line 2: catalogue number '00181' is not that of line 1, '25063'"),
        ((EXAMPLE[0],), "line 1: line 2 of the element set is missing"),
        ((EXAMPLE[0], EXAMPLE[0]), "line 2: expected line 2"),
        ((EXAMPLE[1],), "line 1: expected line 1"),
        (("NAME", "OTHER"), "line 2: expected line 1"),
        (("NAME",), "line 1: an element set is missing behind 'NAME'"),
        (
            (EXAMPLE[0], signed(EXAMPLE[1].replace("34.9848", "34,9848"))),
            "line 2: columns 9 to 16 hold ' 34,98",
        ),
        ((EXAMPLE[0].replace("U 97", "u 97"), EXAMPLE[1]), "line 1: column 8 holds 'u', expected the class"),
        ((EXAMPLE[0].replace("74A", "74a"), EXAMPLE[1]), "line 1: columns 10 to 17 hold '97074a  '"),
        ((EXAMPLE[0].replace("A   0", "A  _0"), EXAMPLE[1]), "line 1: column 18 holds '_', expected a space"),
        (
            (changed(0, "065.47684936", "999.47684936"), EXAMPLE[1]),
            "line 1: day 999.477 (columns 21 to 32) is",
        ),
        ((changed(0, "065.47684936", "366.00000000"), EXAMPLE[1]), "is none of a year, here 2001"),
        ((changed(0, "065.47684936", "000.47684936"), EXAMPLE[1]), "is none of a year"),
        (
            (EXAMPLE[0], changed(1, " 34.9848", "180.9848")),
            "the inclination (columns 9 to 16) is 180.985 deg",
        ),
        (
            (EXAMPLE[0], changed(1, "213.3710", "361.0000")),
            "the ascending node (columns 18 to 25) is 361 deg",
        ),
        ((EXAMPLE[0], changed(1, "234.2325", "500.0000")), "the argument of the perigee (columns 35 to 42)"),
        (
            (EXAMPLE[0], changed(1, "124.0029", "999.9000")),
            "the mean anomaly (columns 44 to 51) is 999.9 deg",
        ),
        (
            (EXAMPLE[0], changed(1, "15.74091534", "00.00000000")),
            "the mean motion (columns 53 to 63) is 0 rev",
        ),
        ((EXAMPLE[0], changed(1, "15.74091534", "99.00000000")), "is 99 revolutions a day, expected 0.03 to"),
        ((EXAMPLE[0], changed(1, "0001408", "9999999")), "the eccentricity (columns 27 to 33) is 1: with"),
        ((EXAMPLE[0], changed(1, "0001408", "3000000")), "km below the ground"),
    ],
)
def test_wrong_lines_are_refused_in_words(lines, words):
    with pytest.raises(ValueError, match=r"^line") as refused:
        parse_elements(text(lines))
    assert words in str(refused.value)


def refusal(lines):
    try:
        (first,) = parse_elements(lines)
        relative_state(first, first, first.epoch + timedelta(days=1))
    except ValueError as error:
        return str(error)
    return ""


def test_lines_with_other_letters_are_carried_on_or_refused_by_line(rng):
    """Whatever stands in the columns: a state, or a sentence that names the line or the object."""
    letters = list("0123456789 .-+aZ")
    carried = 0
    for _ in range(3000):
        lines = [list(line[:68]) for line in PROGRESS]
        for _ in range(rng.integers(1, 4)):
            lines[rng.integers(2)][rng.integers(2, 68)] = rng.choice(letters)
        lines[1][2:7] = lines[0][2:7]
        refused = refusal(text([signed("".join(line)) for line in lines]))
        assert re.match(r"$|line [12]: |.+ at 20\d\d-", refused), refused
        carried += not refused
    assert carried > 100


def test_names_above_the_lines_are_taken():
    first, second = parse_elements("PROGRESS\n" + text(PROGRESS) + "0 EXAMPLE\n" + text(EXAMPLE))
    assert (first.name, second.name) == ("PROGRESS", "EXAMPLE")
    assert parse_elements("") == []


def test_local_axes_are_up_along_and_normal_and_turn_with_the_orbit():
    position, velocity = np.array([0.0, 7e6, 0.0]), np.array([-7e3, 0.0, 0.0])  # normal: +z
    axes, rate = local_axes(position, velocity)
    np.testing.assert_allclose(axes, [[0, 1, 0], [-1, 0, 0], [0, 0, 1]], atol=1e-15)
    assert rate == pytest.approx(1e-3)


def test_an_object_that_runs_ahead_lies_along_the_track_and_stays_there():
    """The same orbit, 0.01 degrees ahead by mean anomaly: 1.2 km along the track, little else."""
    ahead = signed(PROGRESS[1].replace("111.9298", "111.9398"))
    first, second = parse_elements(text(PROGRESS, (PROGRESS[0], ahead)))
    states = [relative_state(first, second, when) for when in moments(first.epoch, (0.0, 95.0, 5.0))]
    places = np.array([state.position_m for state in states])
    arc_m = np.radians(0.01) * 6878.5e3
    assert np.all(np.abs(places[:, 1] - arc_m) < 8.0)  # e = 0.0012 sways it by 2 e of itself
    assert np.abs(places[:, [0, 2]]).max() < 4.0
    state = states[0]
    assert np.abs(state.velocity_m_s).max() < 5e-3  # as seen in axes that turn; in space it is 1.3 m/s
    assert abs(state.constants.drift_m_rev) < 50.0
    # Hill's equations carry it on for a quarter of a revolution to within what e and J2 leave out
    carried = hill_transition(first.mean_motion_rad_s, 1200.0) @ np.r_[state.position_m, state.velocity_m_s]
    assert np.linalg.norm(carried[:3] - places[4]) < 10.0


def test_a_higher_object_falls_behind_by_its_first_constant():
    """C1 is twice the radial distance for an object at rest beside; drift -6 pi C1 a revolution."""
    slower = signed(PROGRESS[1].replace("15.21986026", "15.21900000"))
    first, second = parse_elements(text(PROGRESS, (PROGRESS[0], slower)))
    found = relative_state(first, second, first.epoch).constants
    lag = -np.pi * 2.0 * 6878.5e3 * (1.0 - 15.219 / 15.21986026)  # m of track in a revolution
    assert found.drift_m_rev == pytest.approx(lag, rel=0.03)


def test_a_retrograde_companion_has_no_hill_constants():
    """At one place, and twice the orbital velocity apart."""
    other = signed(PROGRESS[1][:8] + f"{180.0 - float(PROGRESS[1][8:16]):8.4f}" + PROGRESS[1][16:])
    first, second = parse_elements(text(PROGRESS, (PROGRESS[0], other)))
    states = [relative_state(first, second, first.epoch + timedelta(minutes=k)) for k in range(0, 95, 1)]
    near = min(states, key=lambda state: np.linalg.norm(state.position_m))
    assert all(state.constants is None for state in states)
    assert np.linalg.norm(near.velocity_m_s) > 1000.0


def test_elements_too_old_for_the_moment_are_refused():
    first, second = parse_elements(text(PROGRESS, PROGRESS))
    with pytest.raises(ValueError, match="31 days from the epoch"):
        relative_state(first, second, first.epoch + timedelta(days=30.6))


def test_moments_hold_both_ends():
    start = datetime(2012, 1, 25, tzinfo=UTC)
    found = moments(start, (0.0, 0.3, 0.1))
    assert [(each - start).total_seconds() for each in found] == pytest.approx([0.0, 6.0, 12.0, 18.0])
    for wrong in ((0.0, 1.0, 0.0), (1.0, 0.0, 1.0), (0.0, float("nan"), 1.0)):
        with pytest.raises(ValueError, match="FIRST:LAST:STEP"):
            moments(start, wrong)


@pytest.fixture
def files(tmp_path):
    ahead = signed(PROGRESS[1].replace("111.9298", "111.9398"))
    (tmp_path / "both.txt").write_text(
        "PROGRESS\n" + text((PROGRESS[0], PROGRESS[1] + ".")) + text((PROGRESS[0], ahead))
    )
    (tmp_path / "three.txt").write_text(text(PROGRESS, PROGRESS, PROGRESS))
    (tmp_path / "one.txt").write_text(text(PROGRESS))
    (tmp_path / "other.txt").write_text(text((PROGRESS[0], ahead)))
    return tmp_path


def test_the_command_writes_a_row_per_moment_and_states_its_accuracy(groundstation, files):
    out = files / "relative.csv"
    words = ("--at", "2012-01-25T02:18:00", "--minutes", "0:90:30", "--out", out)
    printed = groundstation("relative", "tle", files / "both.txt", *words).stdout
    assert ACCURACY in printed
    assert "a full stop behind column 69" in printed
    assert "a = 6878.5 km, period 5676.8 s, near Earth" in printed
    rows = read(out)
    assert [row["minutes"] for row in rows] == ["0", "30", "60", "90"]
    assert rows[0]["utc"] == "2012-01-25T02:18:00.000000Z"
    assert float(rows[2]["y_m"]) == pytest.approx(1200.0, abs=10.0)
    groundstation("relative", "tle", files / "one.txt", files / "other.txt", "--out", out)
    (row,) = read(out)
    assert row["utc"].startswith("2012-01-25T02:04:07.92")


def test_one_object_given_twice_is_named_and_zero_has_no_sign(groundstation, files):
    (files / "same.txt").write_text(text(PROGRESS, PROGRESS))
    out = files / "relative.csv"
    printed = groundstation("relative", "tle", files / "same.txt", "--out", out).stdout
    assert "both sets are of object 00181" in printed
    assert "wanders 0 m a revolution" in printed
    assert not any(zero in printed for zero in ("-0 ", "-0,", "-0.000"))
    assert not any(value == "-0" for value in read(out)[0].values())


@pytest.mark.parametrize(
    ("words", "error", "sentence"),
    [
        (("one.txt",), FileError, r"holds 1 element sets \(00181\), expected 2: leave those of the two"),
        (("both.txt", "one.txt"), FileError, "holds 2 element sets, expected 1 in each of two files"),
        (("both.txt", "--at", "today"), UsageError, "--at must be a moment"),
        (("both.txt", "--minutes", "0:1"), UsageError, "expected three numbers FIRST:LAST:STEP"),
        (
            ("both.txt", "--minutes", "0:1:x"),
            UsageError,
            "--minutes is '0:1:x': expected three numbers FIRST:LAST:STEP, found 'x'",
        ),
        (("both.txt", "--minutes", "1e12:1e12:1"), UsageError, "at most 30 days from the epoch"),
        (("both.txt", "--minutes", "0:1e300:1e299"), UsageError, "at most 30 days from the epoch"),
        (("both.txt", "--minutes", "0:60:1e-300"), UsageError, "at most 1000000 are taken"),
        (("both.txt", "--at", "9999-12-31T23:59:59", "--minutes", "0:1:1"), UsageError, "calendar"),
        (("both.txt", "--at", "0001-01-01T00:00:00+05:00"), UsageError, "--at must be a moment"),
        (("three.txt",), FileError, r"holds 3 element sets \(00181, 00181, 00181\), expected 2: leave"),
        (("both.txt", "--at", "2013-01-25T00:00:00"), UsageError, "days from the epoch"),
        (("nothing.txt",), FileError, "nothing.txt"),
    ],
)
def test_what_the_command_cannot_do_it_says(groundstation, files, words, error, sentence):
    given = [files / word if word.endswith(".txt") else word for word in words]
    with pytest.raises(error, match=sentence):
        groundstation("relative", "tle", *given, "--out", files / "out.csv")
    assert not (files / "out.csv").exists()


def test_constants_of_hill_are_left_out_where_the_equations_do_not_hold(groundstation, files):
    far = signed(PROGRESS[1].replace("111.9298", "291.9298"))
    (files / "far.txt").write_text(text(PROGRESS, (PROGRESS[0], far)))
    (files / "eccentric.txt").write_text(text(MOLNIYA, MOLNIYA))
    for name in ("far.txt", "eccentric.txt"):
        out = files / "relative.csv"
        printed = groundstation("relative", "tle", files / name, "--minutes", "0:2:1", "--out", out).stdout
        assert "c1_m to c6_m are nan at 3 of 3 moments: Hill's equations do not hold there" in printed
        assert "C1 =" not in printed
        assert all(row[f"c{k}_m"] == "nan" for row in read(out) for k in range(1, 7))
        assert all(np.isfinite(float(row["distance_m"])) for row in read(out))
