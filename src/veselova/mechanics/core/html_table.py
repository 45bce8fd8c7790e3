"""Tables that notebooks show of problems and results."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape

__all__ = ["html_table"]


def html_table(rows: Mapping[str, object]) -> str:
    """Return an HTML table with a row for each name and its value."""
    style = "style='text-align:left'"
    body = "".join(
        f"<tr><th {style}>{escape(name)}</th><td {style}>{escape(str(value))}</td></tr>"
        for name, value in rows.items()
    )
    return f"<table>{body}</table>"
