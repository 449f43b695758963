"""Make a ceiling of LEDs: an irregular layout with a least distance, as CSV `id,x_m,y_m`.

    python tools/make_ceiling.py calibration/rigs/emulated/ceiling.csv --seed 20

Irregular, because any regular grid looks the same from many places; a least distance, so that two LEDs never
melt into one spot. Candidates are thrown one by one and kept if far enough from all others (random sequential
addition), which packs at most to some 55 % of the area by discs of that diameter.
"""

import argparse
import csv
import io
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

TRIES_PER_LED = 20_000


def scatter(
    count: int, size_m: tuple[float, float], least_distance_m: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Places (count, 2) in a rectangle about the origin, no two nearer than the least distance.

    Raises:
        ValueError: So many LEDs do not fit.
    """
    half = 0.5 * np.array(size_m)
    places = np.empty((count, 2))
    for index in range(count):
        for _ in range(TRIES_PER_LED):
            candidate = rng.uniform(-half, half)
            if np.all(np.sum((places[:index] - candidate) ** 2, axis=1) >= least_distance_m**2):
                places[index] = candidate
                break
        else:
            raise ValueError(
                f"only {index} of {count} LEDs fit into {size_m[0]} x {size_m[1]} m "
                f"at {least_distance_m} m from each other"
            )
    return places


def main() -> int:
    """Write the star list; 0 if it was written."""
    parser = argparse.ArgumentParser(description="Make an irregular ceiling of LEDs.")
    parser.add_argument("out", type=Path)
    parser.add_argument("--count", type=int, default=180)
    parser.add_argument("--size-m", type=float, nargs=2, default=(5.0, 4.0), metavar=("X", "Y"))
    parser.add_argument("--least-distance-m", type=float, default=0.15)
    parser.add_argument("--seed", type=int, default=20)
    args = parser.parse_args()
    try:
        places = scatter(
            args.count, tuple(args.size_m), args.least_distance_m, np.random.default_rng(args.seed)
        )
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("id", "x_m", "y_m"))
    writer.writerows((index, f"{x:.5f}", f"{y:.5f}") for index, (x, y) in enumerate(places.tolist()))
    partial = args.out.with_suffix(".partial")
    partial.write_text(text.getvalue(), encoding="utf-8")
    partial.replace(args.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
