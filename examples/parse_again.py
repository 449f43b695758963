"""Parse the serial bytes of a recording again, with nothing of the ground station but the driver.

    python examples/parse_again.py run.mcap --vehicle alpha

What a recording keeps is what came over the wire, so that the parser of next year can read it as well. Any
other source of bytes will do as well: a file, a socket, a serial port.
"""

import argparse
from pathlib import Path

import numpy as np

from drivers.imu_block.protocol import FrameParser, ImuFrame
from drivers.imu_block.sensors import rate_rad_s, specific_force_m_s2
from groundstation.parts.imu.messages import ImuBytes
from groundstation.recording.reader import Recording


def main() -> None:
    """Print what the bytes say."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("recording", type=Path)
    parser.add_argument("--vehicle", default="alpha")
    arguments = parser.parse_args()

    frames = FrameParser()  # finds out by itself which version the block speaks
    samples: list[tuple[float, float, float]] = []
    with Recording(arguments.recording) as recording:
        for message in recording.messages([ImuBytes], [arguments.vehicle]):
            assert isinstance(message.payload, ImuBytes)
            for frame in frames.feed(message.payload.data):
                if isinstance(frame, ImuFrame):
                    x, y = frame.tilt_difference_counts
                    rate = rate_rad_s(frame.gyro_counts)
                    samples.append((rate, specific_force_m_s2(x), specific_force_m_s2(y)))
    mean, sigma = np.mean(samples, axis=0), np.std(samples, axis=0)
    print(f"version {frames.detected_version}, {len(samples)} samples")
    print(f"rate {np.degrees(mean[0]):+.3f} +- {np.degrees(sigma[0]):.3f} deg/s")
    print(f"force x {mean[1]:+.4f} +- {sigma[1]:.4f}, y {mean[2]:+.4f} +- {sigma[2]:.4f} m/s2")
    print(", ".join(f"{name} {count}" for name, count in frames.counters.as_dict().items() if count))


if __name__ == "__main__":
    main()
