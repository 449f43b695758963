"""The page of a tracked film: frames with residuals, and how pose and residuals went."""

from __future__ import annotations

import base64
import html
import io
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from groundstation.files.png import DPI, new_figure
from groundstation.relative_navigation.answers import Status, Track

Picture = NDArray[np.uint8]

MOST_PICTURES = 60
_JPEG = [cv2.IMWRITE_JPEG_QUALITY, 85]
_STYLE = (
    "body{font:15px/1.4 sans-serif;margin:2em;max-width:1400px}"
    "figure{display:inline-block;margin:6px;width:430px;vertical-align:top}"
    "img{max-width:100%}figcaption{font-size:12px}"
)


@dataclass
class Review:
    """Collects what the page shows.

    Attributes:
        title: Of the page.
        count: How many frames there will be.
        pictures: Kept ones, as JPEG, by frame.
        kept: Their answers.
    """

    title: str
    count: int
    pictures: list[bytes] = field(default_factory=list)
    kept: list[Track] = field(default_factory=list)

    def wants(self, track: Track) -> bool:
        """Whether a frame goes into the page: some evenly, and the first ones that were not solved."""
        stride = max(1, self.count // (MOST_PICTURES // 2))
        if len(self.kept) >= MOST_PICTURES:
            return False
        return track.frame % stride == 0 or track.status is not Status.SOLVED

    def add(self, track: Track, drawn: Picture) -> None:
        """Take a frame with its drawing."""
        self.pictures.append(cv2.imencode(".jpg", drawn, _JPEG)[1].tobytes())
        self.kept.append(track)

    def page(self, tracks: list[Track], words: str) -> str:
        """The whole page as HTML, pictures inside."""
        figures = [
            f'<figure><img alt="frame {track.frame}" src="data:image/jpeg;base64,{_coded(picture)}">'
            f"<figcaption>{html.escape(_words(track))}</figcaption></figure>"
            for track, picture in zip(self.kept, self.pictures, strict=True)
        ]
        chart = f'<img alt="pose and residuals" src="data:image/png;base64,{_coded(_chart(tracks))}">'
        summary = "<br>".join(html.escape(line) for line in words.splitlines())
        return (
            f'<!doctype html><html lang="en"><meta charset="utf-8">'
            f"<title>{html.escape(self.title)}</title><style>{_STYLE}</style>"
            f"<h1>{html.escape(self.title)}</h1><p>{summary}</p>{chart}"
            f"<h2>Frames</h2><p>Circles: centres. Crosses: where the pose puts the points. Red: residuals, "
            f"20 times their length.</p>{''.join(figures)}</html>\n"
        )


def _words(track: Track) -> str:
    residual = "" if np.isnan(track.residual_px) else f", residual {track.residual_px:.3f} px"
    reason = f" ({track.reason.value})" if track.reason.value else ""
    what = f"{track.status.value}{reason}, {track.points} points{residual}"
    return f"frame {track.frame}, {track.t_s:.3f} s: {what}"


def _coded(data: bytes) -> str:
    return base64.b64encode(data).decode("ascii")


def _chart(tracks: list[Track]) -> bytes:
    t = np.array([track.t_s for track in tracks])
    place = np.array(
        [np.full(3, np.nan) if track.pose is None else track.pose.position_camera_m for track in tracks]
    )
    figure = new_figure(11.0, 7.0)
    top, middle, bottom = figure.subplots(3, 1, sharex=True)
    for k, name in enumerate("xyz"):
        top.plot(t, place[:, k], label=name)
    top.set_ylabel("position, m")
    top.legend(ncols=3, fontsize=8)
    middle.plot(t, [track.residual_px for track in tracks], ".")
    middle.set_ylabel("residual, px")
    bottom.semilogy(t, [track.sigma_position_m for track in tracks], label="position, m")
    bottom.semilogy(t, np.degrees([track.sigma_attitude_rad for track in tracks]), label="turn, deg")
    bottom.set_ylabel("sigma")
    bottom.set_xlabel("t, s")
    bottom.legend(fontsize=8)
    memory = io.BytesIO()
    figure.savefig(memory, format="png", dpi=DPI)
    return memory.getvalue()
