"""Throughput of the IMU block's parser on a recorded stream, one core."""

from pathlib import Path

from bench.rows import RIGS, Bench, CpuTime, Row
from drivers.imu_block.protocol import FrameParser, ImuFrame, encode_v1
from groundstation.launch.lockstep_run import run_lockstep
from groundstation.parts.imu.messages import ImuBytes
from groundstation.recording.reader import Recording
from groundstation.rig.read import load_rig, read_text

STREAM_HZ = 1000.0
LIMIT = 100.0
RECORDED_S = 60.0
REPEATS = 5
FTDI_BYTES = 62


def recorded_chunks(folder: Path) -> list[bytes]:
    """Every read of the serial port of a lockstep flight, as recorded."""
    path, rig = folder / "parser.mcap", RIGS / "drawn_fixes.toml"
    run_lockstep(load_rig(rig), read_text(rig), rig, path, RECORDED_S, 1, lambda _text, _done: None)
    with Recording(path) as recording:
        found = [message.payload for message in recording.messages([ImuBytes])]
    return [chunk.data for chunk in found if isinstance(chunk, ImuBytes)]


def measure(bench: Bench) -> list[Row]:
    """Version 2 as recorded; the same samples written anew as version 1."""
    bench.say("parser: recording a stream")
    chunks = recorded_chunks(bench.folder)
    parser = FrameParser()
    frames = [item for chunk in chunks for item in parser.feed(chunk) if isinstance(item, ImuFrame)]
    legacy = b"".join(
        encode_v1(
            sequence=i % 256,
            gyro_counts=frame.gyro_counts,
            tilt_difference_counts=frame.tilt_difference_counts,
        )
        for i, frame in enumerate(frames)
    )
    return [
        _row(bench, "v2, as recorded", chunks * REPEATS, len(frames) * REPEATS),
        _row(bench, "v1, same samples", _packets(legacy) * REPEATS, len(frames) * REPEATS),
    ]


def _packets(stream: bytes) -> list[bytes]:
    """As an FTDI chip hands them over."""
    return [stream[i : i + FTDI_BYTES] for i in range(0, len(stream), FTDI_BYTES)]


def _row(bench: Bench, what: str, chunks: list[bytes], expected: int) -> Row:
    bench.say(f"parser: {what}")
    parser, count = FrameParser(), 0
    with CpuTime() as cpu:
        for chunk in chunks:
            count += len(parser.feed(chunk))
    times = count / cpu.seconds / STREAM_HZ
    measured = f"{times:.0f}x ({1e6 * cpu.seconds / count:.1f} us per frame)"
    return Row(
        f"parser throughput on a recorded stream, one core: {what}",
        f"{LIMIT:.0f}x a 1 kHz stream",
        measured,
        times >= LIMIT and count >= 0.99 * expected,
    )
