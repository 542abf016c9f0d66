"""The surface of the package."""

import subprocess
import sys

import pytest

import situp_annotate
from situp_annotate.errors import BoxError
from situp_annotate.types import BoundingBox


def test_every_public_name_is_there():
    for name in situp_annotate.__all__:
        assert getattr(situp_annotate, name) is not None
    assert set(situp_annotate.__all__) <= set(dir(situp_annotate))
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        situp_annotate.nothing  # noqa: B018


def test_importing_the_package_loads_nothing_heavy():
    code = (
        "import sys, situp_annotate;"
        "print([m for m in ('numpy', 'cv2', 'av', 'numba', 'pydantic') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize(
    "numbers", [(0, 0, 0, 5), (0, 0, 5, -1), (float("nan"), 0, 5, 5), (0, float("inf"), 5, 5)]
)
def test_boxes_check_themselves(numbers):
    with pytest.raises(BoxError):
        BoundingBox(*numbers)


@pytest.mark.parametrize(
    ("box", "inside"),
    [((0, 0, 5, 5), True), ((-4, -4, 5, 5), True), ((-5, 0, 5, 5), False), ((60, 0, 5, 5), False),
     ((0, 50, 5, 5), False), ((59, 49, 5, 5), True)],
)  # fmt: skip
def test_boxes_that_touch_only_the_edge_do_not_intersect(box, inside):
    assert BoundingBox(*box).intersects(60, 50) is inside
