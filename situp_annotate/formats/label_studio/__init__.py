"""Label Studio's JSON for video."""

__all__ = ["ID_KEY"]

ID_KEY = "situp_id"
"""Where a task's data has the id of its video in the run: the name of a file need not be unique."""
