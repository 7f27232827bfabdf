"""Jinja2 templates, escaping always on: names come from users."""

from __future__ import annotations

from functools import cache
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from tauhat.report.formatting import number, percent, span, unit


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("tauhat.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(percent=percent, number=number, span=span, unit=unit)
    environment.globals.update(span=span)
    return environment


def rendered(template: str, **context: Any) -> Markup:
    """Return a template filled in, every value of the context escaped."""
    return Markup(_environment().get_template(template).render(**context))  # noqa: S704


def script_json(text: str) -> Markup:
    """Return JSON that cannot end the script element it stands in."""
    for sign in "<>&\u2028\u2029":
        text = text.replace(sign, f"\\u{ord(sign):04x}")
    return Markup(text)  # noqa: S704
