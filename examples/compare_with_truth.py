"""Read a recording: how far was the estimate from the truth, and how far did it claim to be?

groundstation run examples/rigs/drawn_fixes.toml --lockstep --duration 60 --record run.mcap
python examples/compare_with_truth.py run.mcap
"""

import argparse
from pathlib import Path

import numpy as np

from groundstation.bus.topics import topic_of
from groundstation.messages.definitions import ReferenceState, VehicleState
from groundstation.recording.reader import Recording


def poses(recording: Recording, kind: type[VehicleState] | type[ReferenceState], vehicle: str) -> np.ndarray:
    """Rows of t (s), x, y (m), heading (rad, unwrapped), shape (n, 4)."""
    found = (message.payload for message in recording.messages([topic_of(kind)], [vehicle]))
    rows = np.array([(p.stamp_ns * 1e-9, *p.position_table_m, p.heading_rad) for p in found])
    rows[:, 3] = np.unwrap(rows[:, 3])
    return rows


def sentence(of: np.ndarray) -> str:
    """x, y (m) and heading (rad) for people."""
    return f"x {of[0] * 1e3:.2f} mm, y {of[1] * 1e3:.2f} mm, heading {np.degrees(of[2]):.3f} deg"


def main() -> None:
    """Print one line per vehicle."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("recording", type=Path)
    with Recording(parser.parse_args().recording) as recording:
        owners = {channel.owner for channel in recording.channels if channel.topic is topic_of(VehicleState)}
        for vehicle in sorted(owners):
            estimate, truth = (
                poses(recording, VehicleState, vehicle),
                poses(recording, ReferenceState, vehicle),
            )
            t_s = estimate[:, 0]
            inside = (t_s >= truth[0, 0]) & (t_s <= truth[-1, 0])
            errors = np.column_stack(
                [estimate[inside, i] - np.interp(t_s[inside], truth[:, 0], truth[:, i]) for i in (1, 2, 3)]
            )
            errors[:, 2] = (errors[:, 2] + np.pi) % (2 * np.pi) - np.pi
            claimed = [m.payload.pose_std for m in recording.messages([topic_of(VehicleState)], [vehicle])]
            rms, std = np.sqrt(np.mean(errors**2, axis=0)), np.sqrt(np.mean(np.array(claimed) ** 2, axis=0))
            print(f"{vehicle}: RMS error {sentence(rms)}; claimed {sentence(std)}")


if __name__ == "__main__":
    main()
