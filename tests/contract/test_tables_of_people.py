"""Every table that a person hands over is read by one reader: what one file may look like, all may."""

import json
from pathlib import Path

import numpy as np
import pytest

from calibration.imu.tilt import load_tilts
from calibration.overhead.board_views import _read_places
from calibration.sky.survey.anchors import read_anchors
from calibration.sky.turns import read_turns
from firmware_emulator.sky.scene import read_ceiling
from groundstation.data_sets.fusion_folder import read_folder
from groundstation.data_sets.star_folder import load_sky
from groundstation.files.errors import FileError
from groundstation.star_tracking.star_catalogue import StarCatalogue

RIG = Path(__file__).parents[2] / "calibration" / "rigs" / "emulated"
CEILING = (RIG / "ceiling.csv").read_text()
IMU = "t_s,omega_rad_s,ax_m_s2,ay_m_s2,temperature_C\n" + "".join(
    f"{0.01 * k:.2f},0.001,{0.01 * (k % 3):.2f},0.02,25.5\n" for k in range(1, 9)
)
STARS = "t_exposure_s,t_arrival_s,x_m,y_m,heading_rad\n0.01,0.03,0.1,0.2,0.3\n0.05,0.07,0.1,0.2,0.4\n"
KNOWN = {
    "run_start_s": 0.02, "duration_s": 0.1, "imu_rate_hz": 100.0, "poll_rate_hz": 1000.0,
    "imu_offset_m": [0.0, 0.0], "imu_offset_sigma_m": 1e-3, "star_sigma_xy_m": 1e-3,
    "star_sigma_heading_rad": 1e-3, "gyro_noise_poll_rad_s": 1e-3, "acc_noise_poll_m_s2": 1e-3,
    "gyro_lsb_rad_s": 1e-3, "acc_lsb_m_s2": 1e-3, "gyro_tempco_rad_s_C": 0.0, "acc_tempco_m_s2_C": 0.0,
    "gyro_bandwidth_hz": 0.0, "acc_bandwidth_hz": 0.0,
}  # fmt: skip


def _flight(path):
    (path.parent / "meta.json").write_text(json.dumps({"known": KNOWN}))
    (path.parent / "stars.csv").write_text(STARS)
    return read_folder(path.parent).imu


def _fixes(path):
    (path.parent / "meta.json").write_text(json.dumps({"known": KNOWN}))
    (path.parent / "imu.csv").write_text(IMU)
    return read_folder(path.parent).stars


def _turns(path):
    (path.parent / "stars.csv").write_text(STARS)
    return read_turns(path.parent, None).rate_rad_s


def _anchors(path):
    return np.array([[a.x_m, a.y_m, a.u_px, a.v_px] for a in read_anchors(path, ["00042", "00021"])])


READERS = {
    "ceiling.csv of the station": ("ceiling.csv", CEILING, lambda path: StarCatalogue.load(path).x_m),
    "ceiling.csv of the emulator": ("ceiling.csv", CEILING, read_ceiling),
    "anchors.csv": (
        "anchors.csv",
        "id,x_m,y_m,frame,u,v\n0,2.5724,2.3283,00042,312.5,366.9\n1,1.5,0.5,00021,107.5,326.5\n",
        _anchors,
    ),
    "places.csv": (
        "places.csv", "frame,x_m,y_m,heading_deg\na,-1.25,0.5,10.5\n",
        lambda path: np.array(_read_places(path, {"a"})["a"]),
    ),
    "tilts.csv": (
        "tilts.csv", "along_x_deg,along_y_deg\n0.5,0.0\n-0.5,0.25\n", lambda path: load_tilts(path).along_rad,
    ),
    "imu.csv": ("imu.csv", IMU, _flight),
    "stars.csv": ("stars.csv", STARS, _fixes),
    "imu.csv of the delay": ("imu.csv", IMU, _turns),
}  # fmt: skip

DISGUISES = {
    "byte order mark": lambda text: b"\xef\xbb\xbf" + text.encode(),
    "CRLF": lambda text: text.replace("\n", "\r\n").encode(),
    "CR": lambda text: text.replace("\n", "\r").encode(),
    "semicolons, decimal commas": lambda text: text.replace(",", ";").replace(".", ",").encode(),
    "tabs in UTF-16": lambda text: text.replace(",", "\t").encode("utf-16"),
    "quotes": lambda text: "".join(
        ",".join(f'"{cell}"' for cell in line.split(",")) + "\n" for line in text.splitlines()
    ).encode(),
    "a last line of spaces": lambda text: (text + "   \n").encode(),
    "emptied columns": lambda text: text.replace("\n", ",,\n").encode(),
    "the Windows code page": lambda text: "".join(
        f"{line},{'ü' if k else 'Größe'}\n" for k, line in enumerate(text.splitlines())
    ).encode("cp1252"),
}  # fmt: skip


@pytest.mark.parametrize("disguise", DISGUISES)
@pytest.mark.parametrize("reader", READERS)
def test_every_table_is_read_in_every_disguise(reader, disguise, tmp_path):
    name, text, read = READERS[reader]
    plain, other = tmp_path / "plain", tmp_path / "other"
    plain.mkdir()
    other.mkdir()
    (plain / name).write_text(text)
    (other / name).write_bytes(DISGUISES[disguise](text))
    np.testing.assert_array_equal(read(other / name), read(plain / name))


@pytest.mark.parametrize("reader", READERS)
def test_a_column_twice_and_a_missing_one_are_named_with_their_line(reader, tmp_path):
    name, text, read = READERS[reader]
    header = text.splitlines()[0]
    first = header.split(",")[0]
    wide = text.replace("\n", f",{first}\n", 1).rstrip("\n").replace("\n", ",1\n") + ",1\n"
    (tmp_path / name).write_text(wide.replace(f"{first},1\n", f"{first}\n", 1))
    with pytest.raises(FileError, match=rf"{name}: line 1, column '{first}' appears twice"):
        read(tmp_path / name)
    (tmp_path / name).write_text(text.replace(first, "other", 1))
    with pytest.raises(FileError, match=rf"{name}: line 1, column '{first}' is missing"):
        read(tmp_path / name)


def scaled(text, factor):
    header, *rows = text.splitlines()
    cells = [row.split(",") for row in rows]
    return "\n".join([header, *(f"{i},{factor * float(x)},{factor * float(y)}" for i, x, y in cells)]) + "\n"


@pytest.mark.parametrize("read", [StarCatalogue.load, read_ceiling], ids=["station", "emulator"])
@pytest.mark.parametrize(
    ("text", "line"),
    [(scaled(CEILING, 1000.0), 2), (scaled(CEILING, 100.0), 2), (CEILING + "x,1e9,0\n", 182)],
    ids=["mm", "cm", "1e9"],
)
def test_a_ceiling_in_other_units_or_with_a_star_on_the_moon_is_refused_by_its_line(
    read, text, line, tmp_path
):
    path = tmp_path / "ceiling.csv"
    path.write_text(text)
    with pytest.raises(FileError, match=rf"ceiling\.csv: line {line}, x_m is .*expected at most 100 m"):
        read(path)


def test_a_typo_in_the_list_is_named_and_a_list_of_which_no_picture_shows_four_is_refused(tmp_path):
    path = tmp_path / "ceiling.csv"
    path.write_text(CEILING + "typo,95.0,0\n")
    with pytest.raises(FileError, match=r"line 182: star 'typo' lies 9\d(\.\d*)? m from the middle"):
        StarCatalogue.load(path)
    (tmp_path / "camera.json").write_text((RIG / "camera.json").read_text())
    path.write_text(scaled("\n".join(CEILING.splitlines()[:12]) + "\n", 12.0))
    with pytest.raises(FileError, match=r"no 4 stars are nearer than .* is the list in m\?"):
        load_sky(tmp_path)


@pytest.mark.parametrize(
    ("key", "value"),
    [("ceiling_height_above_camera_m", 2200.0), ("mount_yaw_rad", 90.0), ("mount_offset_body_m", [24, 22, 0]),
     ("width", 10**9), ("fx", 1e9), ("fx", 10**400), ("dist_k1_k2_p1_p2_k3", [1e9, 0, 0, 0, 0])],
)  # fmt: skip
def test_a_camera_in_other_units_is_refused_by_its_key(key, value, tmp_path):
    path = tmp_path / "camera.json"
    (tmp_path / "ceiling.csv").write_text(CEILING)
    path.write_text(json.dumps({**json.loads((RIG / "camera.json").read_text()), key: value}))
    with pytest.raises(FileError, match=rf"camera\.json: .*{key}") as refused:
        load_sky(tmp_path)
    assert len(str(refused.value)) < 300
