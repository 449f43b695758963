"""`groundstation relative target`: a target file from a picture, clicks and lengths."""

from __future__ import annotations

import base64
import json
import shlex
from pathlib import Path
from typing import Annotated

import cv2
import typer

from groundstation.data_sets.relative_case import MOST_DIAMETER_M
from groundstation.data_sets.relative_target_file import ClickedPoint, target_toml
from groundstation.data_sets.star_folder import read_frame
from groundstation.declarations.errors import UsageError
from groundstation.files.writing import check_targets, write_file

_PAGE = """<!doctype html><html lang="en"><meta charset="utf-8"><title>Points of a target</title>
<style>body{{font:15px/1.4 sans-serif;margin:2em}}td input{{width:6em}}
canvas{{cursor:crosshair;border:1px solid #888}}</style><h1>Points of a target</h1>
<p>Click the points; give each its place in body axes, metres. Then copy the call and run it.</p>
<canvas id="picture" aria-label="picture to click on"></canvas>
<table><thead><tr><th>point<th>u<th>v<th>x, m<th>y, m<th>z, m</thead><tbody id="rows"></tbody></table>
<pre id="call"></pre><img id="source" alt="" hidden src="data:image/png;base64,{picture}">
<script>
const source=document.getElementById("source"),canvas=document.getElementById("picture"),points=[];
function draw(){{canvas.width=source.naturalWidth;canvas.height=source.naturalHeight;
const pen=canvas.getContext("2d");pen.drawImage(source,0,0);pen.strokeStyle=pen.fillStyle="#0f0";
points.forEach((p,i)=>{{pen.beginPath();pen.arc(p.u+.5,p.v+.5,6,0,7);pen.stroke();pen.fillText(i,p.u+9,p.v-4)}});
document.getElementById("call").textContent={call}+" "+
points.map(p=>"--point "+[p.u.toFixed(1),p.v.toFixed(1),p.x,p.y,p.z].join(",")).join(" ")}}
function row(p,i){{const line=document.createElement("tr");
line.innerHTML="<td>"+i+"<td>"+p.u.toFixed(1)+"<td>"+p.v.toFixed(1);
for(const axis of ["x","y","z"]){{const cell=document.createElement("td"),box=document.createElement("input");
box.type="number";box.step="any";box.value=p[axis];box.ariaLabel="point "+i+" "+axis;
box.oninput=()=>{{p[axis]=Number(box.value);draw()}};cell.append(box);line.append(cell)}}
document.getElementById("rows").append(line)}}
canvas.onclick=e=>{{const box=canvas.getBoundingClientRect();const p={{
u:(e.clientX-box.left)*canvas.width/box.width-.5,
v:(e.clientY-box.top)*canvas.height/box.height-.5,x:0,y:0,z:0}};points.push(p);row(p,points.length-1);draw()}};
source.complete?draw():source.onload=draw;
</script></html>
"""


def target(
    picture: Annotated[Path, typer.Argument(help="A picture of the target (PNG, JPEG).")],
    out: Annotated[Path, typer.Option(help="TOML file to write; without --point an HTML page to click on.")],
    point: Annotated[
        list[str] | None,
        typer.Option(help="u,v,x,y,z of a point: pixels of its click, metres in body axes."),
    ] = None,
    f_px: Annotated[float | None, typer.Option(help="Focal length of the camera, px.")] = None,
    tip_diameter_m: Annotated[float | None, typer.Option(help="Diameter of the points.")] = None,
    colours: Annotated[
        bool, typer.Option("--colours", help="Learn each point's colour at its click.")
    ] = False,
) -> None:
    """Make a target file: click the points in a picture, give their places on the craft.

    Without --point a page is written on which points are clicked and placed; it shows the call to run next.
    With at least four points the pose in the picture is solved, as a check of clicks and lengths.

    Example: groundstation relative target picture.png --out click.html

    Example: groundstation relative target picture.png --out target.toml --f-px 750 --point 320,200,0,0.5,0
    """
    check_targets(out, sources=[picture])
    image = read_frame(picture, None, is_colour=None)
    if not point:
        if out.suffix.lower() not in (".html", ".htm"):
            raise UsageError("without --point a page to click on is made: give --out PAGE.html.")
        data = cv2.imencode(".png", image)[1].tobytes()
        write_file(out, _PAGE.format(picture=base64.b64encode(data).decode("ascii"), call=_call(picture)))
        print(f"{out}: open it in a browser and click the points.")
        return
    if tip_diameter_m is not None and not 0.0 < tip_diameter_m <= MOST_DIAMETER_M:
        raise UsageError(
            f"--tip-diameter-m must be above 0 and at most {MOST_DIAMETER_M:g}, found {tip_diameter_m:g}."
        )
    if f_px is None:
        raise UsageError("give --f-px, the focal length in pixels (`groundstation calibrate lens` finds it).")
    clicked = [_clicked(text, image.shape[1], image.shape[0]) for text in point]
    text, words = target_toml(image, clicked, f_px, tip_diameter_m, learns_colours=colours)
    write_file(out, text)
    print(words)


def _call(picture: Path) -> str:
    """The command to run next, as a string of the page's script; a shell takes it as it stands."""
    words = ("groundstation", "relative", "target", str(picture), "--out", "target.toml", "--f-px", "750")
    return json.dumps(shlex.join(words)).replace("<", "\\u003c")  # no name ends the script


def _clicked(text: str, width: int, height: int) -> ClickedPoint:
    try:
        u, v, x, y, z = (float(cell) for cell in text.split(","))
    except ValueError as error:
        raise UsageError(f"--point must be u,v,x,y,z, found {text!r}.") from error
    if not (0.0 <= u <= width - 1 and 0.0 <= v <= height - 1):
        raise UsageError(f"--point {text}: {u:g}, {v:g} is not in the picture of {width} x {height} px.")
    return ClickedPoint((u, v), (x, y, z))
