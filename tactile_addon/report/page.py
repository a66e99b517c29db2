# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The page around the parts of a report: HTML in a single file."""

from collections.abc import Iterable, Sequence
from html import escape

PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{title}</title>
<style>
body {{ max-width: 64rem; margin: 2rem auto; padding: 0 1rem; font: 1rem/1.5 sans-serif; color: #222; }}
.ok, .doubt {{ padding: .5rem 1rem; border-left: .4rem solid #2a7; background: #eef8f2; }}
.doubt {{ border-color: #d70; background: #fdf4e8; }}
figure {{ display: inline-block; margin: 0 1rem 1rem 0; vertical-align: top; }}
figcaption {{ font-size: .875rem; color: #555; max-width: 20rem; }}
svg {{ max-width: 100%; font: 11px sans-serif; }}
table {{ border-collapse: collapse; display: block; overflow-x: auto; }}
td, th {{ padding: .2rem 1.2rem .2rem 0; text-align: left; vertical-align: top; }}
tr {{ border-bottom: 1px solid #ddd; }}
@media print {{ body {{ margin: 0; }} figure, table {{ break-inside: avoid; }} }}
</style></head><body>
<h1>{title}</h1>
{body}
</body></html>
"""


def page(title: str, parts: Iterable[str]) -> str:
    """The page with a title in plain text and parts in HTML."""
    return PAGE.format(title=escape(title), body="\n".join(parts))


def section(heading: str, *parts: str) -> str:
    """A heading in plain text, and parts of HTML below it."""
    return f"<h2>{escape(heading)}</h2>\n" + "\n".join(parts)


def verdict(words: str, is_good: bool) -> str:
    """A sentence in the color of good or of doubt."""
    return f'<p class="{"ok" if is_good else "doubt"}">{escape(words)}</p>'


def words(text: str) -> str:
    """A paragraph of plain text."""
    return f"<p>{escape(text)}</p>"


def swatch(color: Sequence[float], text: str) -> str:
    """A box of a color, whose parts are from 0 to 1, with words next to it."""
    red, green, blue = (round(255.0 * part) for part in color[:3])
    style = f"border-left: 1rem solid rgb({red}, {green}, {blue}); padding-left: .5rem"
    return f'<p style="{style}">{escape(text)}</p>'


def figure(picture: str, caption: str) -> str:
    """A picture in SVG with a caption in plain text."""
    return f"<figure>{picture}<figcaption>{escape(caption)}</figcaption></figure>"


def table(rows: Iterable[Sequence[str]], header: Sequence[str] = ()) -> str:
    """A table of rows of plain values, with the first value of each in bold."""
    lines = ["".join(f"<th>{escape(name)}</th>" for name in header)] if header else []
    for first, *others in rows:
        cells = "".join(f"<td>{escape(str(value))}</td>" for value in others)
        lines.append(f"<th>{escape(str(first))}</th>{cells}")
    return f"<table>{''.join(f'<tr>{line}</tr>' for line in lines)}</table>"
