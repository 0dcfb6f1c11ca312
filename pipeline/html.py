"""The parts of a page for people: sections of figures, tables; every text is escaped here and nowhere else."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from typing import Final


def page(title: str, parts: Iterable[str]) -> str:
    """Return a whole page; ``parts`` are HTML."""
    return _PAGE.format(title=escape(title), parts="\n".join(part for part in parts if part))


def section(title: str, figures: Sequence[str]) -> str:
    """Return a heading with figures under it, or nothing if the title ends in a count of none."""
    if title.endswith(": 0"):
        return ""
    shown = "\n".join(figures)
    return f"<h2>{escape(title)}</h2>" + (f"\n<main>\n{shown}\n</main>" if figures else "")


def table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table, or nothing if it has no rows."""
    if not rows:
        return ""
    head = "<tr>" + "".join(f"<th>{escape(heading)}" for heading in headings) + "\n" if headings else ""
    body = "\n".join("<tr>" + "".join(f"<td>{escape(cell)}" for cell in row) for row in rows)
    return f"<table>\n{head}{body}\n</table>"


def figure(sources: str | Sequence[str], lines: Iterable[str]) -> str:
    """Return the pictures that exist, with lines of text under them."""
    found = [sources] if isinstance(sources, str) else sources
    images = "".join(
        f'<a href="{escape(source)}"><img src="{escape(source)}" alt="" loading="lazy"></a>'
        for source in found
        if source
    )
    caption = "<br>".join(escape(line) for line in lines if line)
    return f"<figure>{images}<figcaption>{caption}</figcaption></figure>"


_PAGE: Final = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>{title}</title>
<style>
:root {{ color-scheme: light dark }}
body {{ font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 75rem; padding: 0 1rem }}
table {{ border-collapse: collapse; margin: 1rem 0 }}
th, td {{ padding: .1rem 1.5rem .1rem 0; text-align: left; vertical-align: top; max-width: 26rem }}
td {{ overflow-wrap: break-word }}
td:nth-child(2) {{ font-variant-numeric: tabular-nums }}
main {{ display: grid; grid-template-columns: repeat(auto-fill, minmax(15rem, 1fr)); gap: 1rem; margin-top: 1rem }}
figure {{ margin: 0; text-align: center; border: 1px solid #8884; border-radius: .4rem; padding: .6rem }}
img {{ max-width: 100%; background: #fff }}
figcaption {{ font-size: .75rem; opacity: .75; overflow-wrap: anywhere }}
</style>
<h1>{title}</h1>
{parts}
</html>
"""
