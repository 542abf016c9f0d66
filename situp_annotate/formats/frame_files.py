"""Names of the frames of a video, where formats want a file each."""

__all__ = ["frame_stem"]


def frame_stem(video_id: str, frame: int) -> str:
    """Folder and name without suffix, such as ``street/000041``; frames count from 0."""
    return f"{video_id}/{frame:06d}"
