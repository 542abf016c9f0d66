"""Walk through a video, frame by frame, from the start to the end, and check it on the way."""

from collections.abc import Iterable
from types import TracebackType
from typing import Self

from situp_annotate.errors import FrameSizeError, VideoIncompleteError
from situp_annotate.limits import Limits
from situp_annotate.types import NS_PER_S, Finding, Frame, VideoInfo
from situp_annotate.video.bounds import too_long
from situp_annotate.video.decoder import Decoder
from situp_annotate.video.findings import FindingLog
from situp_annotate.video.probe import Probe, SizeChange
from situp_annotate.video.timeline import Timeline

__all__ = ["FrameSource"]

_COVERED = 0.98


class FrameSource:
    """The frames of one video: a forward iterator and a context manager, made by `open_video`.

    Frames are numbered in decode order. Nothing is ever sought, and memory does not grow with
    the video's length. When the frames end before they should, the iteration ends with an error,
    or with a finding where incomplete videos are to be kept.

    Attributes
    ----------
    info : VideoInfo
        What is known of the video.
    frames_decoded : int
        Frames handed out or skipped so far.
    """

    def __init__(
        self,
        info: VideoInfo,
        decoder: Decoder,
        probe: Probe | None,
        *,
        findings: Iterable[Finding] = (),
        keep_incomplete: bool,
        limits: Limits,
    ) -> None:
        """Take over a decoder that stands at its first picture, and findings on the whole video."""
        self.info = info
        self.frames_decoded = 0
        self._decoder = decoder
        self._probe = probe
        self._keep = keep_incomplete
        self._limits = limits
        self._at_first = True
        self._ended = False
        self._log = FindingLog()
        self._timeline = Timeline(
            frame_rate=info.frame_rate,
            from_stream=info.timestamps == "stream",
            usual_step_ns=probe.usual_step_ns if probe else round(NS_PER_S / info.frame_rate),
            regular=probe is not None and probe.regular,
        )
        for finding in findings:
            self._log.add(finding)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Everything noticed so far; of each kind the first twenty, and how many more."""
        return self._log.all

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Free the file; the iteration is over."""
        self._ended = True
        self._decoder.close()

    def __iter__(self) -> Self:
        return self

    def __next__(self) -> Frame:
        """Decode the next frame.

        Raises
        ------
        VideoIncompleteError
            If the frames end before the header says they should.
        FrameSizeError
            If the picture changes its size.
        VideoTooLargeError
            If there are too many frames, or one is too large.
        """
        pts_ns = self._next_time()
        if pts_ns is None:
            raise StopIteration
        index = self.frames_decoded - 1
        return Frame(index, pts_ns, self._decoder.image(), self._log.take_fresh())

    def skip_through(self) -> int:
        """Go to the end without handing out pictures, with all checks.

        Returns
        -------
        int
            How many frames the video has.

        Raises
        ------
        VideoIncompleteError
            If the frames end before the header says they should.
        FrameSizeError
            If the picture changes its size.
        VideoTooLargeError
            If there are too many frames, or one is too large.
        """
        while self._next_time() is not None:
            pass
        return self.frames_decoded

    def _next_time(self) -> int | None:
        """Go to the next frame and return its time; None at the end."""
        if self._ended or not self._advance():
            self._ended = True
            return None
        pts_ns, odd = self._timeline.place(self.frames_decoded, self._decoder.time_ns)
        for finding in odd:
            self._log.add(finding)
        self.frames_decoded += 1
        return pts_ns

    def _advance(self) -> bool:
        """Go to the next picture and check it; False at the end, having checked that too."""
        try:
            if self._at_first or self._decoder.advance():
                self._at_first = False
                if self.frames_decoded == self._limits.max_frames:
                    raise too_long(self.info.path, self._limits.max_frames)
                self._check_size(self._decoder.time_ns)
                return True
            self._check_end()
        except (VideoIncompleteError, FrameSizeError) as error:
            self._ended = True
            if not self._keep:
                raise
            self._log.add(Finding(error.kind, str(error), self.frames_decoded))
        return False

    def _check_size(self, time_ns: int | None) -> None:
        size_hw = self._decoder.size_hw
        change = self._probe.size_change if self._probe else None
        # OpenCV rescales to the first size without a word.
        if change is not None and self._has_reached(change, time_ns):
            height, width = change.size_hw
            size_hw = (width, height) if self.info.rotation_degrees % 180 else (height, width)
        if size_hw != (self.info.height, self.info.width):
            raise FrameSizeError(
                f"{self.info.path}: the picture changes from {self.info.width} × "
                f"{self.info.height} to {size_hw[1]} × {size_hw[0]} pixels at frame "
                f"{self.frames_decoded}; {self._outcome('split the video there')}."
            )

    def _has_reached(self, change: SizeChange, time_ns: int | None) -> bool:
        if self.info.timestamps != "stream" or time_ns is None or change.time_ns is None:
            return self.frames_decoded >= change.frame
        return time_ns >= change.time_ns

    def _check_end(self) -> None:
        probe = self._probe
        if probe is None:
            return
        broken = probe.coded_pictures - self.frames_decoded
        if broken > 0:
            self._log.add(
                Finding(
                    "undecoded",
                    f"{broken} of {probe.coded_pictures} coded pictures gave no frame; the frames "
                    "around them may be damaged.",
                )
            )
        if probe.promised_end_ns is None:
            return
        end_ns = self._end_ns(probe)
        lost_ns = probe.promised_end_ns - end_ns
        if lost_ns > (1 - _COVERED) * probe.promised_end_ns and lost_ns > 2 * probe.usual_step_ns:
            raise VideoIncompleteError(
                f"{self.info.path}: the video ends early: {self.frames_decoded} frames up to "
                f"{end_ns / NS_PER_S:.2f} s could be decoded of the "
                f"{probe.promised_end_ns / NS_PER_S:.2f} s that its header promises; "
                f"{self._outcome('copy or record it anew')}."
            )

    def _outcome(self, advice: str) -> str:
        if self._keep:
            return "the frames up to there are kept"
        return f'{advice}, or set decoding.incomplete = "keep" to annotate the frames up to there'

    def _end_ns(self, probe: Probe) -> int:
        """Where the last decoded frame ends."""
        last_ns = self._timeline.last_ns
        if last_ns == probe.last_ns and probe.end_ns is not None:
            return probe.end_ns  # the last picture may be meant to stand for long
        return last_ns + probe.usual_step_ns
