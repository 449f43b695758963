"""The section `camera` of a mock-up: a webcam that looks up, or fixes drawn in its place."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from firmware_emulator.settings import Fraction, NonNegative, Positive, Settings


class CameraConfig(Settings):
    """The webcam that looks up, or fixes drawn in its place."""

    source: Literal["rendered", "fixes", "none"] = "fixes"
    """Pictures, or poses drawn from truth plus noise on the channel `<vehicle>/fixes`, or nothing."""
    rate_hz: Positive = 1.5
    exposure_s: Positive = 0.02
    readout_s: NonNegative = 0.0
    """Rolling shutter: time between the exposures of first and last row."""
    delay_s: Annotated[float, Field(ge=0.0, le=4.0)] = 0.6
    """From the middle of the exposure to the host; a drawn fix can say ages up to 4.29 s."""
    delay_jitter_s: NonNegative = 0.002
    sigma_xy_m: NonNegative = 0.001
    sigma_heading_rad: NonNegative = 0.00087
    missing_fraction: Fraction = 0.0
    """Of the exposures, how many give no drawn fix."""
    wrong_fraction: Fraction = 0.0
    """Of the drawn fixes, how many are wrong by more than their sigma states, unmarked."""
    stream: Literal["raw", "mjpeg"] = "raw"
    """How live pictures are served over HTTP."""
    jpeg_quality: Annotated[int, Field(ge=1, le=100)] = 90
    ceiling: str = ""
    """Path of the star list (id,x_m,y_m); needed by `rendered`."""
    camera: str = ""
    """Path of the camera file (JSON); needed by `rendered`."""

    @model_validator(mode="after")
    def _exposure_fits_the_rate(self) -> "CameraConfig":
        if self.source == "rendered" and (self.exposure_s + self.readout_s) * self.rate_hz >= 1.0:
            raise ValueError(
                f"exposure_s + readout_s = {self.exposure_s + self.readout_s:g} s is longer than a period of "
                f"rate_hz = {self.rate_hz:g}"
            )
        return self

    @model_validator(mode="after")
    def _rendering_has_its_files(self) -> "CameraConfig":
        if self.source == "rendered" and not (self.ceiling and self.camera):
            raise ValueError("source = 'rendered' needs both ceiling and camera, the paths of their files")
        return self
