"""SITUP and its relatives: what each of them is made of, and where that is written.

All are the same tracker with other settings. Where an original has
more than this, or something else, its note says so.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from situp_annotate.tracking import TrackerParams

__all__ = ["DEFAULT_PRESET", "PRESETS", "Preset"]

DEFAULT_PRESET = "fast"
"""What ``situp-annotate run`` tracks with where nothing else is asked for."""

_ONE_SCALE = (1.0,)
_NEVER = 1e9
"""Size in pixels that no target has."""


@dataclass(frozen=True, slots=True)
class Preset:
    """A tracker of the family.

    Attributes
    ----------
    params : TrackerParams
        What it is made of.
    source : str
        Where it was published.
    note : str
        What of the original is missing or different here.
    """

    params: TrackerParams
    source: str
    note: str = ""


_RAW = TrackerParams(
    features=("gray",),
    cell_size=1,
    padding=2.0,
    label_sigma=1 / 16,
    regularization=0.01,
    scale_factors=_ONE_SCALE,
    halve_above=_NEVER,
)
"""What the trackers on raw pixels have in common."""

_KCF = TrackerParams(
    features=("hog",),
    grayscale=True,
    kernel="gaussian",
    kernel_sigma=0.5,
    regularization=1e-4,
    learning_rate=0.02,
    scale_factors=_ONE_SCALE,
)

_DSST = TrackerParams(
    features=("hog", "gray"),
    cell_size=2,
    filter="ratio",
    padding=2.0,
    label_sigma=1 / 16,
    regularization=0.01,
    learning_rate=0.025,
    scale_factors=_ONE_SCALE,
    scale_search="filter",
    sampling="plain",
    subcell=True,
    halve_above=_NEVER,
)

PRESETS: Mapping[str, Preset] = {
    "mosse": Preset(
        replace(_RAW, filter="ratio", learning_rate=0.125),
        "D. S. Bolme et al., Visual object tracking using adaptive correlation filters, CVPR 2010",
        "without the logarithm, the warped copies of the first window and the stop at low PSR",
    ),
    "csk": Preset(
        replace(_RAW, kernel="gaussian", kernel_sigma=0.2, learning_rate=0.075),
        "J. F. Henriques et al., Exploiting the circulant structure of tracking-by-detection with "
        "kernels, ECCV 2012",
    ),
    "kcf": Preset(
        _KCF,
        "J. F. Henriques et al., High-speed tracking with kernelized correlation filters, PAMI "
        "2015",
    ),
    "dcf": Preset(
        replace(_KCF, kernel="linear"),
        "J. F. Henriques et al., High-speed tracking with kernelized correlation filters, PAMI "
        "2015: its linear kernel",
    ),
    "samf": Preset(
        TrackerParams(
            kernel="gaussian",
            kernel_sigma=0.5,
            regularization=1e-4,
            learning_rate=0.01,
            scale_criterion="max",
        ),
        "Y. Li, J. Zhu, A scale adaptive kernel correlation filter tracker with feature "
        "integration, ECCV workshops 2014",
    ),
    "dsst": Preset(
        _DSST,
        "M. Danelljan et al., Accurate scale estimation for robust visual tracking, BMVC 2014",
        "cells of two pixels where the original has HOG at every pixel",
    ),
    "fdsst": Preset(
        replace(_DSST, cell_size=4, padding=3.0, halve_above=100.0),
        "M. Danelljan et al., Discriminative scale space tracking, PAMI 2017",
        "peaks between cells by parabolas instead of trigonometric interpolation; all channels and "
        "all 33 scales instead of principal components and 17, which the original has for speed",
    ),
    "situp": Preset(
        TrackerParams(),
        "H. Ma, S. T. Acton, Z. Lin, SITUP: Scale invariant tracking using average "
        "peak-to-correlation energy",
    ),
    "aspect": Preset(
        TrackerParams(aspect_factors=(1.0, 0.98, 1.02), sampling="plain", subcell=True),
        "not published: SITUP with a search for the aspect ratio, which KCFDP (D. Huang et al., "
        "Enable scale and aspect ratio adaptability in visual tracking with detection proposals, "
        "BMVC 2015) aims at with detection proposals",
    ),
    "accurate": Preset(
        TrackerParams(
            filter="background",
            window="square",
            padding=4.0,
            template_side=(100.0, 160.0),
            support=1.25,
            label_sigma=1 / 16,
            learning_rate=0.01,
            learn_above=0.5,
            scale_factors=(1.0, 0.98, 1.02),
            sampling="plain",
            subcell=True,
        ),
        "not published: SITUP's features and criterion with the filter of BACF (H. Kiani Galoogahi "
        "et al., Learning background-aware correlation filters for visual tracking, ICCV 2017), "
        "whose learning rate it almost has, templates of about the same size for all targets, and "
        "the rule for when to learn of LMCF (M. Wang et al., Large margin object tracking with "
        "circulant feature maps, CVPR 2017)",
    ),
    "fast": Preset(
        TrackerParams(
            scale_factors=(1.0, 0.985, 1.015),
            template_side=(0.0, 72.0),
            learn_above=0.5,
            sampling="plain",
            subcell=True,
        ),
        "not published: SITUP with three scales, small templates, peaks between cells, and LMCF's "
        "rule for when to learn",
    ),
}
"""By name: those that were published in the order of their years, then ours."""
