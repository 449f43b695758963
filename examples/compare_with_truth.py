"""Read a recording: how far was the estimate from the truth, and how far did it claim to be?

groundstation run examples/rigs/drawn_fixes.toml --lockstep --duration 60 --record run.mcap
python examples/compare_with_truth.py run.mcap
"""

import argparse
from pathlib import Path

import numpy as np

from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.reference.messages import ReferenceState
from groundstation.recording.reader import Recording


def states(recording: Recording, vehicle: str) -> np.ndarray:
    """Rows of t (s), x, y (m), heading (rad, unwrapped) and their standard deviations, shape (n, 7)."""
    found = (message.payload for message in recording.messages([VehicleState], [vehicle]))
    rows = np.array(
        [
            (state.stamp_ns * 1e-9, *state.position_table_m, state.heading_rad, *state.pose_sigma)
            for state in found
            if isinstance(state, VehicleState)
        ]
    )
    rows[:, 3] = np.unwrap(rows[:, 3])
    return rows


def truths(recording: Recording, vehicle: str) -> np.ndarray:
    """Rows of t (s), x, y (m), heading (rad, unwrapped), shape (n, 4)."""
    found = (message.payload for message in recording.messages([ReferenceState], [vehicle]))
    rows = np.array(
        [
            (truth.stamp_ns * 1e-9, *truth.position_table_m, truth.heading_rad)
            for truth in found
            if isinstance(truth, ReferenceState)
        ]
    )
    rows[:, 3] = np.unwrap(rows[:, 3])
    return rows


def errors(state: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """State less truth at the moments of the states: x, y (m), heading (rad), shape (n, 3)."""
    at_s = state[:, 0]
    off = np.column_stack([state[:, i] - np.interp(at_s, truth[:, 0], truth[:, i]) for i in (1, 2, 3)])
    off[:, 2] = (off[:, 2] + np.pi) % (2 * np.pi) - np.pi
    return off


def sentence(values: np.ndarray) -> str:
    """Root mean squares of rows of x, y (m), heading (rad), for people."""
    x_m, y_m, heading_rad = np.sqrt(np.mean(values**2, axis=0))
    return f"x {x_m * 1e3:.2f} mm, y {y_m * 1e3:.2f} mm, heading {np.degrees(heading_rad):.3f} deg"


def main() -> None:
    """Print one line per vehicle that has a reference."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("recording", type=Path)
    with Recording(parser.parse_args().recording) as recording:
        for channel in recording.channels:
            if channel.noun == ReferenceState.TOPIC.noun:
                state, truth = states(recording, channel.owner), truths(recording, channel.owner)
                state = state[(state[:, 0] >= truth[0, 0]) & (state[:, 0] <= truth[-1, 0])]
                off = sentence(errors(state, truth))
                print(f"{channel.owner}: RMS error {off}; claimed {sentence(state[:, 4:])}")


if __name__ == "__main__":
    main()
