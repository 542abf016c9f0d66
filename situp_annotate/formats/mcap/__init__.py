"""MCAP logs: pictures, boxes, states and remarks of a video, for viewers."""
