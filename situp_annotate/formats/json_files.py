"""Read JSON files of foreign formats: what is wrong in them is said with its place."""

from pathlib import Path
from typing import Any, TypeVar

from pydantic import TypeAdapter, ValidationError

from situp_annotate.errors import SitupError
from situp_annotate.formats.manifest.wording import show_place, show_value
from situp_annotate.formats.zipped import open_readable

__all__ = ["read_bytes", "validate_json"]

_Model = TypeVar("_Model")

_BYTE_ORDER_MARK = b"\xef\xbb\xbf"


def read_bytes(path: Path) -> bytes:
    """Read a file, without the byte-order mark that some editors put first.

    Raises
    ------
    SitupError
        If it cannot be read, or is too large.
    """
    try:
        with open_readable(path) as file:
            return file.read().removeprefix(_BYTE_ORDER_MARK)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise SitupError(f"{path}: cannot be read: {reason}.") from error


def validate_json(path: Path, content: bytes, model: type[_Model], *, wanted: str) -> _Model:
    """Check the content of a JSON file against a pydantic model.

    Parameters
    ----------
    path : Path
        The file, for messages.
    content : bytes
        What stands in it.
    model : type
        What it must be; any type that pydantic knows.
    wanted : str
        What to give instead, for messages.

    Raises
    ------
    SitupError
        If it is no JSON, or something else; names the file, the place, the value and what is
        allowed.
    """
    try:
        return TypeAdapter(model).validate_json(content)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
    raise SitupError(f"{path}: {_problem(first)}; give {wanted}.")


def _problem(error: Any) -> str:  # noqa: ANN401
    message = error["msg"].removesuffix(".")
    if error["type"] == "json_invalid":
        return f"not valid JSON ({error['ctx']['error']})"
    if error["type"] == "missing":
        *owner, name = error["loc"]
        return f"{show_place(tuple(owner))}: {name} is missing"
    return f"{show_place(error['loc'])}: {show_value(error['input'])}: {message}"
