"""MOTChallenge's text formats, and CVAT's archive of them."""
