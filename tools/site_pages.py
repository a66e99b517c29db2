# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What MkDocs does besides its own work: it adds pages that are not in docs, and draws formulas.

mkdocs.yml names this file as a hook.
"""

import re
import tomllib
from pathlib import Path

from latex2mathml.converter import convert
from mkdocs.structure.files import File

ROOT = Path(__file__).resolve().parents[1]
# Pages outside of docs that the site has too. Their links start in another folder there.
OUTSIDE = {"CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md"}
FENCE = re.compile(r"^```.*?^```", re.DOTALL | re.MULTILINE)
MARK = re.compile(r"<!-- (?:(?:table|figure) .*?|end) -->")  # Those of tools.figures.
CODE = re.compile(r"`[^`]*`")
DISPLAY = re.compile(r"^\$\$(.+?)\$\$$", re.DOTALL | re.MULTILINE)
INLINE = re.compile(r"\$(\S(?:[^$\n]*\S)?)\$")


def on_config(config):
    """Takes the site's and the source's addresses from pyproject.toml, once they are there."""
    urls = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"].get("urls", {})
    config.site_url, config.repo_url = urls.get("Documentation"), urls.get("Repository")
    return config


def on_files(files, config):
    """Adds the pages that lie next to README.md."""
    for name, page in OUTSIDE.items():
        text = (ROOT / name).read_text(encoding="utf-8").replace("](docs/", "](")
        for other, its_page in OUTSIDE.items():
            text = text.replace(f"]({other})", f"]({its_page})")
        files.append(File.generated(config, page, content=text))
    return files


def on_page_markdown(markdown, **_):
    """Turns formulas between dollar signs into MathML, which browsers show without a script."""
    markdown, kept = MARK.sub("", markdown), []

    def keep(match):
        kept.append(match[0])
        return f"\0{len(kept) - 1}\0"

    text = CODE.sub(keep, FENCE.sub(keep, markdown))
    text = DISPLAY.sub(lambda m: convert(m[1].strip(), display="block"), text)
    # Formulas are in a span, because a line that begins with <math> would be a block of its own.
    text = INLINE.sub(lambda m: f"<span>{convert(m[1])}</span>", text)
    # Parts are put back in reverse, because a part that was kept later may contain earlier ones.
    for number in reversed(range(len(kept))):
        text = text.replace(f"\0{number}\0", kept[number])
    return text
