"""What the times of a video's pictures mean for labels."""

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from situp_annotate.inspection.report import Grade, Remark, count
from situp_annotate.inspection.stream import StreamSurvey
from situp_annotate.types import NS_PER_S
from situp_annotate.video.probe import Probe

__all__ = ["Steps", "drift_remark", "gap_remark", "measure_steps", "timing_remarks"]

_GAP_STEPS = 1.5
_RATES_DIFFER = 0.01
_MAX_ROUNDING = 0.05  # 1/120 s is 8 ms in Matroska


@dataclass(frozen=True, slots=True)
class Steps:
    """Times from picture to picture.

    Attributes
    ----------
    shortest_ns, usual_ns, longest_ns : int
        The usual one is the median.
    regular : bool
        Whether nearly all are the usual one.
    rate : Fraction
        Frames a second that somebody who counts by time would take: the header's if most steps
        are of that length, else the average.
    drift : int
        By how many frames, at most, index differs from time × that rate.
    gaps : int
        How many steps are longer than the usual one by more than a half.
    """

    shortest_ns: int
    usual_ns: int
    longest_ns: int
    regular: bool
    rate: Fraction
    drift: int
    gaps: int

    @property
    def evenness(self) -> str:
        """Whether the frame rate is constant, in words."""
        if not self.regular:
            return "variable"
        return f"constant but for {count(self.gaps, 'gap')}" if self.gaps else "constant"

    @property
    def spread(self) -> str:
        """Shortest, usual and longest step in words."""
        if self.longest_ns - self.shortest_ns < 2_000_000:
            return f"{self.usual_ns / 1e6:.4g} ms"
        return (
            f"{self.shortest_ns / 1e6:.4g} to {self.longest_ns / 1e6:.4g} ms, "
            f"usually {self.usual_ns / 1e6:.4g} ms"
        )


def measure_steps(probe: Probe, survey: StreamSurvey) -> Steps | None:
    """Return how pictures follow each other; None where their times cannot be used."""
    times_ns = survey.times_ns
    if not probe.timestamps_usable or len(times_ns) < 2:
        return None
    steps = np.diff(times_ns)
    rate = _counting_rate(probe, survey)
    by_time = np.rint((times_ns - times_ns[0]) * (float(rate) / NS_PER_S))
    usual_ns = int(np.median(steps))
    return Steps(
        shortest_ns=int(steps.min()),
        usual_ns=usual_ns,
        longest_ns=int(steps.max()),
        regular=probe.regular,
        rate=rate,
        drift=int(np.abs(by_time - np.arange(len(times_ns))).max()),
        gaps=int(np.count_nonzero(steps > _GAP_STEPS * usual_ns)),
    )


def _counting_rate(probe: Probe, survey: StreamSurvey) -> Fraction:
    said = survey.header_rate
    if said and probe.regular and _is_of_steps(said, probe, survey):
        return said
    return probe.frame_rate


def _is_of_steps(rate: Fraction, probe: Probe, survey: StreamSurvey) -> bool:
    """Whether pictures usually follow each other at this rate, but for rounding to ticks."""
    step_ns = float(NS_PER_S / rate)
    tick_ns = float(survey.time_base * NS_PER_S)
    slack_ns = max(_RATES_DIFFER * step_ns, min(tick_ns, _MAX_ROUNDING * step_ns))
    return abs(step_ns - probe.usual_step_ns) <= slack_ns


def timing_remarks(probe: Probe, survey: StreamSurvey, steps: Steps | None) -> Iterator[Remark]:
    """Yield what is odd about the times that the packets carry."""
    rate = f"{float(probe.frame_rate):.6g}"
    if not probe.timestamps_usable:
        yield Remark(
            Grade.WARNING,
            "timestamps",
            "The stream carries no times that can be used (a raw stream, or an AVI with B-frames). "
            f"Frame numbers are safe; times in the results are number ÷ {rate} frames/s. Put it "
            "into a container with times if they matter: ffmpeg -i IN -c:v libx264 OUT.mp4.",
        )
    elif steps is not None and not steps.regular and steps.longest_ns > steps.shortest_ns:
        yield _variable_rate(steps, rate)
    yield from _header_rate(probe, survey)
    start_s = survey.start_ns / NS_PER_S
    if abs(survey.start_ns) >= probe.usual_step_ns / 2:
        yield Remark(
            Grade.NOTE,
            "start",
            f"The pictures start at {start_s:.3f} s of the container's clock, not at 0. Times in "
            "the results count from there; add that much to compare them with a tool that shows "
            "the container's times.",
        )


def _variable_rate(steps: Steps, rate: str) -> Remark:
    counting = (
        f"A tool that counts frames by time (Label Studio, most players) at {rate} frames/s is "
        f"off by up to {count(steps.drift, 'frame')}"
        if steps.drift
        else f"A tool that counts frames by time at {rate} frames/s still finds the right ones"
    )
    return Remark(
        Grade.WARNING,
        "vfr",
        f"Variable frame rate: from picture to picture it takes {steps.spread}. {counting}; "
        "situp-annotate, CVAT and OpenCV's reading in order count pictures, and agree. Carry "
        "labels over by their times, or make a copy of constant rate before anything is labelled: "
        "ffmpeg -i IN -fps_mode cfr OUT.mp4.",
    )


def _header_rate(probe: Probe, survey: StreamSurvey) -> Iterator[Remark]:
    said, measured = survey.header_rate, probe.frame_rate
    if not said or not measured or len(survey.times_ns) < 2:
        return
    if abs(said / measured - 1) < _RATES_DIFFER:
        return
    if probe.timestamps_usable and (not probe.regular or _is_of_steps(said, probe, survey)):
        return  # no rate is right, or gaps make for the difference: both are said already
    yield Remark(
        Grade.WARNING,
        "header_rate",
        f"The header says {float(said):.6g} frames/s, the pictures come at "
        f"{float(measured):.6g}. Tools that believe the header give labels wrong times; tell them "
        "the measured rate where they ask for one.",
    )


def drift_remark(steps: Steps) -> Remark:
    """Say that counting by time goes wrong though the rate passes for constant."""
    return Remark(
        Grade.WARNING,
        "drift",
        "The steps are not all alike: a tool that counts frames by time at "
        f"{float(steps.rate):.6g} frames/s (Label Studio, most players) is off by up to "
        f"{count(steps.drift, 'frame')}. Carry labels over by their times.",
    )


def gap_remark(steps: Steps) -> Remark:
    """Say that pictures are missing, from the times of the packets alone."""
    return Remark(
        Grade.WARNING,
        "gap",
        f"{count(steps.gaps, 'gap')} in the times: the longest step is "
        f"{steps.longest_ns / 1e6:.0f} ms where {steps.usual_ns / 1e6:.4g} ms are usual. Pictures "
        "are missing there; frame numbers count those that are in the file.",
    )
