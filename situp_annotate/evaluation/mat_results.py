"""Boxes of other trackers in files of MATLAB, as the OTB toolkit leaves them.

Such a file holds a cell ``results`` with a structure for each run: ``res`` (n × 4: x, y, width,
height, counted from 1), ``type`` (``'rect'``), ``startFrame``. Of several runs, those of a temporal
robustness evaluation, the first is the whole sequence.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from situp_annotate.errors import SitupError
from situp_annotate.formats.zipped import open_readable

__all__ = ["read_mat_boxes"]

_WANTED = "give the OTB toolkit's: a cell 'results' of structures with 'res' (n × 4)"


def read_mat_boxes(path: Path) -> tuple[npt.NDArray[np.float64], int | None]:
    """Read the boxes of one pass over a whole sequence.

    Parameters
    ----------
    path : Path
        Need not be trusted.

    Returns
    -------
    boxes : ndarray
        (n, 4), counted from 1; NaN where a number is not finite.
    first_picture : int or None
        ``startFrame``, if it is there.

    Raises
    ------
    SitupError
        If the file cannot be read, holds something else, or its boxes are not upright rectangles.
    """
    run = _first_run(path, _load(path))
    kind = run.get("type", "rect")
    if not isinstance(kind, str) or kind != "rect":
        raise SitupError(
            f"{path}: results{{1}}.type is {str(kind)[:40]!r}; only 'rect' is read: upright "
            f"rectangles, x, y, width, height."
        )
    if "shiftType" in run:
        raise SitupError(
            f"{path}: these runs begin with shifted boxes (shiftType), for spatial robustness; "
            f"give those of a one-pass evaluation."
        )
    return _boxes(path, run.get("res")), _start(path, run.get("startFrame"))


def _load(path: Path) -> object:
    from scipy.io import loadmat

    try:
        with open_readable(path) as file:
            content = loadmat(file, variable_names=["results"], simplify_cells=True)
    except (OSError, NotImplementedError) as error:
        raise SitupError(
            f"{path}: cannot be read ({error}); save it with MATLAB's save(…, '-v7')."
        ) from error
    except Exception as error:  # what a damaged file makes of the reader is not told
        raise SitupError(
            f"{path}: cannot be read as a file of MATLAB ({str(error) or type(error).__name__}); "
            f"{_WANTED}."
        ) from error
    if "results" not in content:
        raise SitupError(f"{path}: has no variable 'results'; {_WANTED}.")
    return content["results"]


def _first_run(path: Path, results: object) -> Mapping[str, Any]:
    if isinstance(results, list | np.ndarray) and len(results) > 0:
        results = results[0]
    if not isinstance(results, Mapping):
        raise SitupError(f"{path}: 'results' holds no structure; {_WANTED}.")
    return results


def _boxes(path: Path, found: object) -> npt.NDArray[np.float64]:
    rows = np.atleast_2d(np.asarray(found))
    if rows.dtype.kind not in "fiu" or rows.ndim != 2 or rows.shape[1] != 4:
        raise SitupError(
            f"{path}: results{{1}}.res is {rows.dtype} {rows.shape}, not numbers (n × 4); "
            f"{_WANTED}."
        )
    boxes = rows.astype(np.float64)
    boxes[~np.isfinite(boxes)] = np.nan
    return boxes


def _start(path: Path, found: object) -> int | None:
    if found is None:
        return None
    if not isinstance(found, int | float | np.number) or not 1 <= float(found) < np.inf:
        raise SitupError(
            f"{path}: results{{1}}.startFrame is {str(found)[:40]!r}; give a number from 1 on."
        )
    return int(found)
