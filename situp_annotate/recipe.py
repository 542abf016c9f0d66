"""Recipes: everything about a run that is not in the manifest, as TOML.

A recipe names only what differs from the defaults, and the defaults live in the dataclasses
below and in those they hold. ``pipelines/`` has ready-made ones.
"""

import difflib
import hashlib
import json
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, Literal, get_type_hints

from pydantic import TypeAdapter, ValidationError

from situp_annotate.errors import RecipeError, TrackingError
from situp_annotate.formats.export_options import ExportOptions
from situp_annotate.formats.exporting import EXPORTERS
from situp_annotate.formats.mcap.pictures import McapOptions
from situp_annotate.formats.overlay.options import OverlayOptions
from situp_annotate.limits import Limits
from situp_annotate.propagation import PropagationOptions
from situp_annotate.toml import parse_toml, parse_value
from situp_annotate.trackers import DEFAULT_PRESET, PRESETS
from situp_annotate.tracking import TrackerParams
from situp_annotate.types import State

__all__ = [
    "DecodingOptions",
    "MotOptions",
    "Outputs",
    "Recipe",
    "load_recipe",
    "recipe_from_dict",
    "recipe_names",
]


_MOST_SHOWN = 100
"""Characters of a value, in a message."""


def _nearest(name: str, names: Sequence[str]) -> str:
    close = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    hint = f"did you mean {close[0]!r}? " if close else ""
    return f"{hint}Known are {', '.join(sorted(names))}."


@dataclass(frozen=True, slots=True)
class DecodingOptions:
    """How videos are read.

    Attributes
    ----------
    incomplete : str
        What to do with a video that ends before its header says it should: ``"fail"``, or
        ``"keep"`` to annotate what is there.
    """

    incomplete: Literal["fail", "keep"] = "fail"


@dataclass(frozen=True, slots=True)
class Outputs:
    """What is written for each video, besides its labels and summary.

    Attributes
    ----------
    mot, mcap, overlay, report : bool
        Whether to write ``mot.csv``, ``annotations.mcap``, ``overlay.mp4`` and ``report.html``.
    exports : tuple of str
        Formats to export the labels to, as ``situp-annotate export`` does.

    Raises
    ------
    RecipeError
        If a format is not known.
    """

    mot: bool = True
    mcap: bool = True
    overlay: bool = True
    report: bool = True
    exports: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in self.exports:
            if name not in EXPORTERS:
                hint = _nearest(name, [*EXPORTERS])
                raise RecipeError(f"exports = {name!r} is not a format; {hint}")

    @property
    def show_pictures(self) -> bool:
        """Whether the video is likely to be decoded once more, for what shows its pictures."""
        return self.overlay or self.mcap or self.report


@dataclass(frozen=True, slots=True)
class MotOptions:
    """How ``mot.csv`` is written.

    Attributes
    ----------
    pixel_origin : int
        Coordinate of the picture's top-left corner: 0, or 1 for tools that count from 1.
    states : tuple of State
        Which boxes get rows. Where the object is lost, its box says nothing about where it is.
    """

    pixel_origin: Literal[0, 1] = 0
    states: tuple[State, ...] = (State.VISIBLE, State.OCCLUDED)


@dataclass(frozen=True, slots=True)
class Recipe:
    """Settings of a run; each attribute is a table of the TOML file.

    The tracker is the preset that needs the fewest boxes for the time it takes, by
    ``benchmarks/effort.py``; the paper's is in the recipe ``situp``.
    """

    tracker: TrackerParams = PRESETS[DEFAULT_PRESET].params
    propagation: PropagationOptions = field(default_factory=PropagationOptions)
    decoding: DecodingOptions = field(default_factory=DecodingOptions)
    outputs: Outputs = field(default_factory=Outputs)
    mot: MotOptions = field(default_factory=MotOptions)
    mcap: McapOptions = field(default_factory=McapOptions)
    overlay: OverlayOptions = field(default_factory=OverlayOptions)
    export: ExportOptions = field(default_factory=ExportOptions)
    limits: Limits = field(default_factory=Limits)

    def as_dict(self) -> dict[str, Any]:
        """Every value in force, as plain JSON data."""
        plain: dict[str, Any] = json.loads(json.dumps(asdict(self)))
        return plain

    @property
    def sha256(self) -> str:
        """Hash of every value in force, however it was set."""
        text = json.dumps(self.as_dict(), sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()


_SECTIONS: dict[str, Any] = get_type_hints(Recipe)
_PRESET = "preset"
"""Key of ``[tracker]`` that names the tracker whose settings the other keys change."""


def _folder() -> Path:
    """Where the ready-made recipes are: in the installed package, or beside it in a checkout."""
    package = Path(str(resources.files("situp_annotate")))
    installed = package / "pipelines"
    return installed if installed.is_dir() else package.parent / "pipelines"


def recipe_names() -> list[str]:
    """Names of the ready-made recipes, sorted."""
    return sorted(path.stem for path in _folder().glob("*.toml"))


def _find(name: str | Path) -> Path:
    path = Path(name)
    if path.suffix == ".toml" or len(path.parts) > 1:
        return path
    ready_made = _folder() / f"{name}.toml"
    if not ready_made.is_file():
        raise RecipeError(f"There is no recipe {name!r}; {_nearest(str(name), recipe_names())}")
    return ready_made


def _shown(value: object) -> str:
    """A value on one line, shortened where it is long."""
    text = repr(value)
    return text if len(text) <= _MOST_SHOWN else text[: _MOST_SHOWN - 1] + "…"


def _read(path: Path) -> dict[str, Any]:
    try:
        return parse_toml(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise RecipeError(f"{path}: this recipe cannot be read: {error.strerror}.") from error
    except UnicodeDecodeError as error:
        raise RecipeError(f"{path}: a recipe must be UTF-8 text: {error}.") from error
    except tomllib.TOMLDecodeError as error:
        raise RecipeError(f"{path}: this is not valid TOML: {error}.") from error


def _parse_setting(setting: str) -> tuple[str, str, Any]:
    """Split ``section.key=value``; the value is TOML, or else a bare word."""
    place, equals, text = setting.partition("=")
    section, dot, key = place.strip().partition(".")
    if not (equals and dot and section and key):
        raise RecipeError(
            f"--set {setting}: give SECTION.KEY=VALUE, such as tracker.learning_rate=0.01."
        )
    return section, key, parse_value(text)


def _check_names(document: Mapping[str, Any], origin: str) -> None:
    for section, values in document.items():
        if section not in _SECTIONS:
            raise RecipeError(
                f"{origin}: a recipe has no section {_shown(section)}; "
                f"{_nearest(section, [*_SECTIONS])}"
            )
        if not isinstance(values, Mapping):
            raise RecipeError(
                f"{origin}: {section} must be a table of settings, not {_shown(values)}."
            )
        known = [f.name for f in fields(_SECTIONS[section])]
        if section == "tracker":
            known.append(_PRESET)
        for key in values:
            if key not in known:
                raise RecipeError(
                    f"{origin}: {_shown(f'{section}.{key}')} is no setting; {_nearest(key, known)}"
                )


@cache
def _adapter(section: str) -> TypeAdapter[Any]:
    return TypeAdapter(_SECTIONS[section])


def _with_preset(values: Mapping[str, Any]) -> Mapping[str, Any]:
    name = values.get(_PRESET, DEFAULT_PRESET)
    if not isinstance(name, str) or name not in PRESETS:
        raise RecipeError(
            f"{_PRESET} = {_shown(name)} is no tracker of the family; "
            f"{_nearest(str(name), list(PRESETS))}"
        )
    own = {key: value for key, value in values.items() if key != _PRESET}
    return {**asdict(PRESETS[name].params), **own}


def _build(document: Mapping[str, Mapping[str, Any]], origin: str) -> Recipe:
    built = {}
    for section, values in document.items():
        try:
            complete = _with_preset(values) if section == "tracker" else values
            # Through JSON, so that strict types hold and arrays become tuples.
            text = json.dumps(complete, default=str)
            built[section] = _adapter(section).validate_json(text, strict=True)
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(str(part) for part in (section, *first["loc"]))
            raise RecipeError(
                f"{origin}: {place} = {_shown(first['input'])} is not allowed: {first['msg']}."
            ) from error
        except (TrackingError, RecipeError) as error:
            raise RecipeError(f"{origin}: {section}.{error}") from error
    return Recipe(**built)


def recipe_from_dict(plain: Mapping[str, Any]) -> Recipe:
    """The recipe whose :meth:`Recipe.as_dict` this is.

    Raises
    ------
    RecipeError
        If it is none's.
    """
    return _build(plain, "recipe")


def load_recipe(name: str | Path = DEFAULT_PRESET, settings: Sequence[str] = ()) -> Recipe:
    """Load a recipe.

    Parameters
    ----------
    name : str or Path
        A ready-made recipe's name, or the path of a TOML file.
    settings : sequence of str
        ``"section.key=value"`` each, applied over the recipe; ``tracker.preset`` replaces all of
        its ``[tracker]``.

    Raises
    ------
    RecipeError
        If the recipe is not there, is not valid TOML, or has an unknown section or key (the
        nearest known one is named) or a value that is not allowed.
    """
    path = _find(name)
    document = _read(path)
    _check_names(document, str(path))
    recipe = _build(document, str(path))
    if not settings:
        return recipe
    merged: dict[str, dict[str, Any]] = {key: dict(value) for key, value in document.items()}
    for setting in settings:
        section, key, value = _parse_setting(setting)
        _check_names({section: {key: value}}, f"--set {setting}")
        if (section, key) == ("tracker", _PRESET):
            merged[section] = {}  # another tracker: the recipe's settings were those of its own
        merged.setdefault(section, {})[key] = value
        recipe = _build(merged, f"--set {setting}")
    return recipe
