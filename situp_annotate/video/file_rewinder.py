"""Walk through a video file backward: decode stretches of it forward, the last one first."""

import math
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from pathlib import Path

import av
from av.video.frame import VideoFrame

from situp_annotate.errors import FrameSizeError, VideoError
from situp_annotate.types import NS_PER_S, Frame, VideoInfo
from situp_annotate.video.frame_order import FrameFollower, FrameOrder
from situp_annotate.video.packet_index import IndexedStream
from situp_annotate.video.pyav_stream import upright_image

__all__ = ["FileRewinder"]

# Decoders fill what is broken with what they have decoded before, even beyond a keyframe. So
# many groups of pictures before the damage they fill it as in reading forward.
_LEAD = 3


class FileRewinder:
    """Decodes a file in chunks that fit into the budget, and hands out each from its end.

    Parameters
    ----------
    path : Path
        An absolute path.
    info : VideoInfo
        What the forward pass said of the video.
    times_ns : sequence of int
        Times of the frames of the forward pass, by index.
    budget_bytes : int
        How many bytes of decoded pictures may be held; one picture always is.

    Attributes
    ----------
    peak_bytes : int
        Most bytes of decoded pictures that were held at one time.

    Raises
    ------
    VideoMissingError
        If there is no such file or it cannot be read.
    VideoFormatError
        If it is no video.

    Notes
    -----
    Pictures are held as they are decoded (yuv420p has 1.5 bytes a pixel, BGR has 3). Decoding
    starts again at keyframes, and a chunk begins at one where one is near enough. A group of
    pictures that does not fit is decoded from its keyframe once for each chunk of it, every time
    not as far, and without the pictures on which nothing is built: n chunks of a long group cost
    less than (n + 1) / 2 times its decoding.
    """

    def __init__(
        self, path: Path, info: VideoInfo, times_ns: Sequence[int], *, budget_bytes: int
    ) -> None:
        self.peak_bytes = 0
        self._info = info
        self._times_ns = times_ns
        self._unusable: set[int] = set()
        self._first_shown: dict[int, int] = {}
        self._stream = IndexedStream(path, max_pixels=info.width * info.height)
        try:
            first = self._first_picture()
            self._capacity = max(1, budget_bytes // max(1, _byte_count(first)))
            self._order = self._surmise_order(first.pts)
            self._restarts = self._list_restarts()
        except BaseException:
            self._stream.close()
            raise

    def _first_picture(self) -> VideoFrame:
        for frame in self._stream.from_start():
            return frame
        raise self._lost(0, 1)

    def _surmise_order(self, first: int | None) -> FrameOrder:
        times_ns = self._stream.times_ns
        if self._info.timestamps != "stream" or not self._stream.all_timed or first is None:
            return FrameOrder(len(times_ns))
        return FrameOrder.by_times(self._times_ns, times_ns, first=first)

    def _list_restarts(self) -> list[tuple[int, int]]:
        """Where decoding may start: index of the first good frame, number of the keyframe."""
        found = []
        for number in self._stream.keyframes:
            index = self._first_shown.get(number, self._order.index_of(number))
            if index is not None and number not in self._unusable:
                found.append((index, number))
        return sorted(found)

    def close(self) -> None:
        """Free the file."""
        self._stream.close()

    def walk(self, start: int, stop: int) -> Iterator[Frame]:
        """Yield the frames ``stop - 1`` to `start`.

        Raises
        ------
        VideoError
            If a frame is not found again.
        FrameSizeError
            If a picture is not of the video's size.
        """
        while stop > start:
            first, pictures = self._last_chunk(start, stop)
            for index in range(stop - 1, first - 1, -1):
                yield self._frame(index, pictures.pop())
            stop = first

    def _frame(self, index: int, picture: VideoFrame) -> Frame:
        info = self._info
        turn = info.rotation_degrees
        try:
            image = upright_image(picture, grey=self._stream.grey, rotation_degrees=turn)
        except av.FFmpegError as error:
            raise self._lost(index, index + 1) from error
        if image.shape[:2] != (info.height, info.width):
            raise FrameSizeError(
                f"{info.path}: frame {index} has {image.shape[1]} × {image.shape[0]} pixels where "
                f"the video has {info.width} × {info.height}; split the video there."
            )
        return Frame(index, self._times_ns[index], image)

    def _last_chunk(self, start: int, stop: int) -> tuple[int, list[VideoFrame]]:
        """Decode the last frames of a stretch; return the first one's index and the pictures."""
        while True:
            first, at = self._plan(start, stop)
            if at is None:
                pictures = self._gather(self._from_start(), first, stop)
                self._restarts = self._list_restarts()
                if pictures is None:
                    raise self._lost(first, stop)
                return first, pictures
            index, keyframe = self._restarts[at]
            pictures = self._gather_from(at, first, stop)
            if pictures is not None:
                return first, pictures
            if self._first_shown.get(keyframe, index) == index:
                self._unusable.add(keyframe)
            self._restarts = self._list_restarts()

    def _plan(self, start: int, stop: int) -> tuple[int, int | None]:
        """Choose the first frame of the next chunk, and the restart; None: the file's start."""
        first = max(start, stop - self._capacity)
        if stop > self._order.known:
            return first, None
        at = bisect_left(self._restarts, (first, 0))
        if first > start and at < len(self._restarts) and self._restarts[at][0] < stop:
            return self._restarts[at][0], at
        at = bisect_right(self._restarts, (first, math.inf)) - 1
        return first, at if at >= 0 else None

    def _gather_from(self, at: int, first: int, stop: int) -> list[VideoFrame] | None:
        frames = self._from_restart(self._restarts[at], first, skipping=True)
        pictures = self._gather(frames, first, stop)
        self._stream.drain()
        if self._stream.damaged:
            earlier = self._from_restart(self._restarts[max(0, at - _LEAD)], first)
            pictures = self._gather(earlier, first, stop) or pictures
        return pictures

    def _gather(
        self, frames: Iterator[tuple[int, VideoFrame]], first: int, stop: int
    ) -> list[VideoFrame] | None:
        """Keep the pictures of a stretch; None when one of them does not come in its turn."""
        pictures: list[VideoFrame] = []
        held = 0
        for index, frame in frames:
            if index < first:
                continue
            if index != first + len(pictures):
                return None
            pictures.append(frame)
            held += _byte_count(frame)
            self.peak_bytes = max(self.peak_bytes, held)
            if index == stop - 1:
                return pictures
        return None

    def _from_start(self) -> Iterator[tuple[int, VideoFrame]]:
        """Decode from the first packet, and note the order of what is not known yet."""
        follower = FrameFollower(self._times_ns, from_stream=self._info.timestamps == "stream")
        for frame in self._stream.from_start():
            index = follower.place(self._stream.time_ns(frame.pts))
            if index is not None:
                if index >= self._order.known:
                    self._order.record(index, frame.pts)
                yield index, frame

    def _from_restart(
        self, restart: tuple[int, int], wanted: int, *, skipping: bool = False
    ) -> Iterator[tuple[int, VideoFrame]]:
        """Decode from a keyframe; nothing comes where the start is broken."""
        last, keyframe = restart[0] - 1, restart[1]
        order, fresh = self._order, True

        def may_skip(number: int) -> bool:
            index = order.index_of(number)
            return number != keyframe and index is not None and index < wanted

        for frame in self._stream.from_keyframe(keyframe, may_skip=may_skip if skipping else None):
            index = order.index_of(frame.pts)
            if index is None or (fresh and index <= last):
                continue  # built on what came before the keyframe, or not there in reading forward
            if index <= last or (fresh and frame.is_corrupt):
                return
            if fresh and index > restart[0]:
                self._first_shown[keyframe] = index  # pictures are refreshed bit by bit
            last, fresh = index, False
            yield index, frame

    def _lost(self, first: int, stop: int) -> VideoError:
        where = f"{self._times_ns[first] / NS_PER_S:.2f}" if first < len(self._times_ns) else "0"
        return VideoError(
            f"{self._info.path}: of the frames {first} to {stop - 1}, from {where} s on, not all "
            "are found in going backward; if the file has not changed since it was read forward, "
            "convert it anew."
        )


def _byte_count(frame: VideoFrame) -> int:
    return sum(plane.buffer_size for plane in frame.planes)
