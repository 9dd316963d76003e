"""Several gradings on one page, with links to the report of each."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Mapping
from importlib import resources

import jinja2
from markupsafe import Markup

from graders.report import text
from graders.result import Result


def overview_html(results: Mapping[str, Result]) -> str:
    """A page with a row for each grading and a column for each case.

    Parameters
    ----------
    results : mapping
        From the folder of each grading, relative to the page, to its result; all by the same rubric.

    Returns
    -------
    str
        The page; like the reports it loads nothing and runs no script.
    """
    here = resources.files("graders.report")
    style = (here / "report.css").read_text("utf-8")
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters |= {"number": text.number, "word": lambda verdict: verdict.replace("-", " ")}
    template = environment.from_string((here / "overview.html.jinja").read_text("utf-8"))
    first = next(iter(results.values()))
    return text.printable(
        template.render(
            results=results,
            first=first,
            symbols=text.SYMBOLS,
            style=Markup(style),  # noqa: S704 - a file of this package
            style_hash=base64.b64encode(hashlib.sha256(style.encode()).digest()).decode(),
        )
    )
