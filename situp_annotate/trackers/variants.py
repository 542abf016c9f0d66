"""Presets with settings changed, by name: ``situp:scale_criterion=max,padding=3``."""

import json
import re
from dataclasses import asdict, fields

from pydantic import TypeAdapter, ValidationError

from situp_annotate.errors import TrackingError
from situp_annotate.toml import parse_value
from situp_annotate.trackers.presets import PRESETS
from situp_annotate.tracking import TrackerParams

__all__ = ["variant_params"]

_PARAMS: TypeAdapter[TrackerParams] = TypeAdapter(TrackerParams)
_BETWEEN_SETTINGS = re.compile(r",(?=\s*\w+\s*=)")


def variant_params(name: str) -> TrackerParams:
    """Parameters of a preset, or of one with settings changed.

    Parameters
    ----------
    name : str
        ``PRESET``, or ``PRESET:KEY=VALUE,…`` with keys of
        :class:`~situp_annotate.tracking.TrackerParams` and values as in TOML.

    Raises
    ------
    TrackingError
        If there is no such preset or key, or a value is not allowed.
    """
    preset, _, settings = name.partition(":")
    if preset not in PRESETS:
        raise TrackingError(f"{preset!r} is no preset; known are {', '.join(PRESETS)}.")
    values = asdict(PRESETS[preset].params)
    for setting in _BETWEEN_SETTINGS.split(settings) if settings else []:
        key, equals, text = (part.strip() for part in setting.partition("="))
        if not equals or key not in values:
            known = ", ".join(field.name for field in fields(TrackerParams))
            raise TrackingError(f"{name!r}: {setting!r} is no setting KEY=VALUE; keys are {known}.")
        values[key] = parse_value(text)
    try:
        return _PARAMS.validate_json(json.dumps(values, default=str), strict=True)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise TrackingError(f"{name!r}: {place} is not allowed: {first['msg']}.") from error
    except TrackingError as error:
        raise TrackingError(f"{name!r}: {error}") from error
