"""Fill a template: escaping, inlined style and script, and the policy that allows no others.

Labels, ids and paths come from users. Jinja escapes them in text and attributes, ``tojson`` inside
``<script>``, :func:`link` in addresses; should one slip through all the same, the page's content
security policy runs no script and applies no style but the two whose hashes it names.
"""

import hashlib
from base64 import b64encode
from functools import cache
from importlib import resources
from typing import Any
from urllib.parse import quote

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

__all__ = ["link", "load_templates", "render"]

_PACKAGE = "situp_annotate.report"


def link(*parts: str) -> str:
    """Address of a file beside the page, whatever its name; never one of another scheme."""
    return "./" + "/".join(quote(part, safe="", errors="replace") for part in parts)


def _count(number: int) -> str:
    """Thousands apart, by a narrow space that does not break."""
    return f"{number:,}".replace(",", "\u202f")


def _percent(part: float, whole: float) -> str:
    """A share; never 0 % or 100 % where it is not exactly so."""
    if not whole:
        return "–"
    share = 100 * part / whole
    if 0 < share < 1:
        return "< 1 %"
    return f"{min(round(share), 99) if share < 100 else 100} %"


def _clock(seconds: float) -> str:
    """Time as ``h:mm:ss.mmm``, without the hours where there are none."""
    milliseconds = round(seconds * 1000)
    minutes, rest = divmod(milliseconds, 60_000)
    hours, minutes = divmod(minutes, 60)
    start = f"{hours}:{minutes:02}" if hours else f"{minutes}"
    return f"{start}:{rest // 1000:02}.{rest % 1000:03}"


@cache
def _asset(*names: str) -> str:
    """Our own files, one after the other, to be inlined."""
    folder = resources.files(_PACKAGE)
    return "\n".join(folder.joinpath(name).read_text(encoding="utf-8") for name in names)


@cache
def _source_hash(*names: str) -> str:
    """How a content security policy names what is inlined."""
    digest = hashlib.sha256(_asset(*names).encode()).digest()
    return f"'sha256-{b64encode(digest).decode()}'"


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader(_PACKAGE),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.policies["json.dumps_kwargs"] = {"separators": (",", ":")}
    environment.filters |= {"count": _count, "clock": _clock}
    environment.globals |= {
        "asset": lambda *names: Markup(_asset(*names)),
        "source_hash": _source_hash,
        "link": link,
        "percent": _percent,
    }
    return environment


def load_templates() -> None:
    """Compile all templates, so that pages can be made at once."""
    for name in _environment().list_templates(extensions=["html"]):
        _environment().get_template(name)


def render(template: str, values: dict[str, Any]) -> str:
    """Text of a page.

    Parameters
    ----------
    template : str
        Name of a file in ``templates``.
    values : dict of str to object
        What the template names.

    Returns
    -------
    str
        HTML that can be encoded as UTF-8, even if a file's name cannot.
    """
    html = _environment().get_template(template).render(values)
    return html.encode("utf-8", "replace").decode("utf-8")
