"""Poses beside the Cramer-Rao bound: frame by frame, with the motion model, unlabelled, coplanar."""

import numpy as np

from bench.limits import at_least, at_most, between, plain
from bench.relative.scenes import following, scenes
from bench.rows import Bench, Row

BAD_M, BAD_DEG = 0.2, 3.0
FRAMES = 150
FLIPPED_DEG = 10.0


def measure(bench: Bench) -> list[Row]:
    """Every row."""
    rows = []
    for name, must, aim in (("none", 1.1, 1.03), ("hill-euler", 0.5, 0.3)):
        position, turn, squares = [], [], []
        for seed in range(bench.seeds):
            bench.say(f"relative: {name}, {seed} of {bench.seeds} flights")
            found = following.follow(scenes.Scene(), scenes.leaving(seed), 50 + seed, name)
            position.append(found.ratio("position"))
            turn.append(found.ratio("turn"))
            squares.append(found.squares())
        ratios = [float(np.sqrt(np.mean(np.square(each)))) for each in (position, turn)]
        what = "single frames" if name == "none" else "with the motion model"
        note = f"{bench.seeds} flights of 192 frames, 3 to 15 m"
        title = f"relative, {what}: position / turn error over the single-frame bound"
        rows.append(at_most(title, ratios, (must, must), (aim, aim), note=note))
        mean = float(np.mean(np.concatenate(squares)))
        rows.append(between(f"relative, {what}: squared error in sigmas", mean, 4.5, 7.5, "5.3-6.7"))
    return [*rows, *_strays(bench), *_planes(bench)]


def _strays(bench: Bench) -> list[Row]:
    solved, metres, degrees = [], [], []
    times = np.arange(FRAMES) * 4.0
    for seed in range(bench.seeds):
        bench.say(f"relative: strays, {seed} of {bench.seeds} flights")
        found = following.follow(
            scenes.Scene(), scenes.leaving(seed, times), 70 + seed, clutter=3.0, missing=0.1, labelled=False
        )
        good = found.solved
        solved.append(int(good.sum()))
        metres.append(float(np.linalg.norm(found.errors[good, :3], axis=1).max()))
        degrees.append(float(np.degrees(np.linalg.norm(found.errors[good, 3:], axis=1)).max()))
    what = f"relative, unlabelled, 3 strays a frame, 10 % missing, {FRAMES} frames"
    note = "each flight " + ", ".join(map(str, solved))
    return [
        at_least(f"{what}: solved, mean of the flights", float(np.mean(solved)), 146.0, 148.0, note=note),
        at_most(f"{what}: worst solved frame", (max(metres), max(degrees)), (0.2, 3.0), (0.1, 1.5), "m, deg"),
    ]


def _planes(bench: Bench) -> list[Row]:
    flipped, single = 0, 0
    times = np.arange(FRAMES) * 2.0
    for seed in range(bench.seeds):
        bench.say(f"relative: plane, {seed} of {bench.seeds} flights")
        motion = scenes.leaving(seed, times, nearest=7.0, speed=0.0155)
        for name in ("hill-euler", "none"):
            found = following.follow(scenes.Scene(points_m=scenes.PLATE), motion, 90 + seed, name)
            off = np.degrees(np.linalg.norm(found.errors[:, 3:], axis=1))
            count = int(np.count_nonzero(off > FLIPPED_DEG))
            flipped, single = (flipped + count, single) if name == "hill-euler" else (flipped, single + count)
    what = f"relative, coplanar points at 7 to 12 m: flipped frames of {FRAMES * bench.seeds}"
    return [at_most(what, flipped, 0.0), plain(f"{what}, single frames", single)]
