"""The targets that trackers are measured on, and the groups that means are told of.

Two layouts are read. OTB's: ``NAME/img/`` with pictures and ``NAME/groundtruth_rect*.txt``. And
text only: ``ground_truth/NAME.txt``, on which only boxes that are there already can be scored.

What is known of targets stands in ``attributes.json`` beside them or in another file like it::

    {"Jogging.1": {"attributes": ["OCC", "DEF"], "otb2013": true}}

Every key whose value is true is a set that the target belongs to; other keys are passed over. A
target without an entry has that of its sequence. Where there is no such file, ``attrs.txt`` in
the sequence's folder gives attributes, separated by commas or blanks.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict

from situp_annotate.errors import SitupError
from situp_annotate.evaluation.datasets import OtbTarget, find_sequences
from situp_annotate.evaluation.otb_frames import scored_rows
from situp_annotate.formats.json_files import read_bytes, validate_json
from situp_annotate.formats.otb import read_boxes
from situp_annotate.formats.zipped import read_text

__all__ = [
    "OTB_ATTRIBUTES",
    "Target",
    "attribute_groups",
    "comparable_name",
    "load_targets",
    "set_groups",
]

OTB_ATTRIBUTES = ("IV", "SV", "OCC", "DEF", "MB", "FM", "IPR", "OPR", "OV", "BC", "LR")
"""In the order of the benchmark's paper."""

_TEXT_ONLY = "ground_truth"
_ATTRIBUTES = "attributes.json"
_WANTED = 'for each name an object such as {"attributes": ["SV"], "otb50": true}'


class _Facts(BaseModel):
    model_config = ConfigDict(extra="allow")

    attributes: list[str] = []

    @property
    def sets(self) -> tuple[str, ...]:
        return tuple(key for key, value in (self.model_extra or {}).items() if value is True)


@dataclass(frozen=True, slots=True)
class Target:
    """One object to follow.

    Attributes
    ----------
    name, sequence : str
        ``Jogging.1`` of ``Jogging``.
    truth : ndarray
        (n, 4): x, y, width, height, counted from 1, of the frames that count; at least one.
    folder : Path or None
        The sequence's; None where there are no pictures.
    attributes, sets : tuple of str
        What is said of it.
    """

    name: str
    sequence: str
    truth: npt.NDArray[np.float64]
    folder: Path | None = None
    attributes: tuple[str, ...] = ()
    sets: tuple[str, ...] = ()


def comparable_name(name: str) -> str:
    """Form in which ``Jogging.1``, ``jogging-1`` and ``Jogging_1`` are one."""
    return re.sub(r"[.\-_]+", "_", name.casefold())


def load_targets(folder: Path, attributes: Path | None = None) -> list[Target]:
    """Load the truth of all targets, and what is known of them.

    Parameters
    ----------
    folder : Path
        In one of the layouts above.
    attributes : Path, optional
        File to take attributes and sets from instead of that in the folder.

    Returns
    -------
    list of Target
        Sorted by name.

    Raises
    ------
    SitupError
        If there is no target, a file cannot be read, or the attributes are of other names.
    """
    text_only = folder / _TEXT_ONLY
    found = _text_only(text_only) if text_only.is_dir() else _in_otb_layout(folder)
    place = attributes or folder / _ATTRIBUTES
    facts = _read_facts(place) if attributes or place.exists() else {}
    targets = [_described(target, facts) for target in found]
    if attributes and not any(target.attributes or target.sets for target in targets):
        raise SitupError(
            f"{attributes}: says nothing of {targets[0].name} or any other sequence in {folder}; "
            f"name sequences as their folders are named."
        )
    return sorted(targets, key=lambda target: target.name)


def _target(path: Path, target: OtbTarget, sequence: str, folder: Path | None) -> Target:
    if len(target.truth) == 0:
        raise SitupError(f"{path}: there is no box; give x, y, width, height, a line a frame.")
    return Target(target.name, sequence, scored_rows(sequence, target.truth), folder)


def _text_only(folder: Path) -> list[Target]:
    paths = list(folder.glob("*.txt"))
    if not paths:
        raise SitupError(f"{folder}: no truth here; give a file NAME.txt for each target.")
    return [
        _target(path, OtbTarget(path.stem, read_boxes(path)), _without_number(path.stem), None)
        for path in paths
    ]


def _without_number(name: str) -> str:
    return re.sub(r"\.\d+$", "", name)


def _in_otb_layout(folder: Path) -> list[Target]:
    return [
        _target(sequence.folder, target, sequence.name, sequence.folder)
        for sequence in find_sequences(folder)
        for target in sequence.targets
    ]


def _read_facts(path: Path) -> dict[str, _Facts]:
    facts = validate_json(path, read_bytes(path), dict[str, _Facts], wanted=_WANTED)
    return {comparable_name(name): each for name, each in facts.items()}


def _described(target: Target, facts: Mapping[str, _Facts]) -> Target:
    known = facts.get(comparable_name(target.name)) or facts.get(comparable_name(target.sequence))
    attributes = tuple(known.attributes) if known else ()
    if not facts and target.folder and (path := target.folder / "attrs.txt").exists():
        attributes = tuple(re.findall(r"[^\s,;]+", read_text(path)))
    sets = known.sets if known else ()
    return replace(target, attributes=attributes, sets=sets)


def attribute_groups(targets: Sequence[Target]) -> dict[str, list[str]]:
    """Names of the targets with each attribute: OTB's first, in its order, then others."""
    found = {attribute for target in targets for attribute in target.attributes}
    others = sorted(found.difference(OTB_ATTRIBUTES))
    return {
        attribute: [target.name for target in targets if attribute in target.attributes]
        for attribute in (*OTB_ATTRIBUTES, *others)
        if attribute in found
    }


def set_groups(targets: Sequence[Target]) -> dict[str, list[str]]:
    """Names of the targets of each set, sorted by the sets' names."""
    found = sorted({each for target in targets for each in target.sets})
    return {each: [target.name for target in targets if each in target.sets] for each in found}
