"""Videos in: files and folders of pictures become frames, in order, with their times."""

from situp_annotate.video.discovery import find_videos, fingerprint
from situp_annotate.video.footage import ForwardWalk, VideoFootage
from situp_annotate.video.image_folder import list_images
from situp_annotate.video.opening import open_video
from situp_annotate.video.rewinding import Rewinder, rewind
from situp_annotate.video.source import FrameSource

__all__ = [
    "ForwardWalk",
    "FrameSource",
    "Rewinder",
    "VideoFootage",
    "find_videos",
    "fingerprint",
    "list_images",
    "open_video",
    "rewind",
]
