# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks a folder of HTML: each link leads somewhere, and nothing is loaded from other hosts."""

import re
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

LOADED = {("img", "src"), ("script", "src"), ("link", "href"), ("source", "src"), ("iframe", "src")}
STYLE_URL = re.compile(r"url\(\s*['\"]?([^'\")]+)|@import\s+['\"]([^'\"]+)")


class Page(HTMLParser):
    """The ids of a page, and (tag, attribute, address) of all that it links to or loads."""

    def __init__(self, path):
        super().__init__()
        self.ids, self.addresses = {""}, []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        """Notes the ids and addresses of a tag."""
        for name, value in attributes:
            if name in ("id", "name"):
                self.ids.add(value)
            if name in ("href", "src") and value:
                self.addresses.append((tag, name, value))


def problems(folder):
    """Yields a sentence for each link that is broken and for all that is loaded from another host."""
    pages = {path: Page(path) for path in sorted(folder.rglob("*.html"))}
    for path, page in pages.items():
        for tag, name, address in page.addresses:
            words = urlsplit(address)
            where = f"{path.relative_to(folder)}: {address}"
            if words.scheme == "data":
                continue
            if words.scheme or words.netloc:
                if (tag, name) in LOADED:
                    yield f"{where} is loaded from another host"
                continue
            # The page for missing addresses is shown at any address, so its links begin at the top.
            target = (
                folder / words.path[1:] if words.path.startswith("/") else path.parent / unquote(words.path)
            )
            target = (path if not words.path else target).resolve()
            target = target / "index.html" if target.is_dir() else target
            if not target.is_file():
                yield f"{where} leads nowhere"
            elif target in pages and unquote(words.fragment) not in pages[target].ids:
                yield f"{where} names no place of that page"
    for path in sorted(folder.rglob("*.css")):
        for address in (a or b for a, b in STYLE_URL.findall(path.read_text(encoding="utf-8"))):
            if re.match(r"(https?:)?//", address):
                yield f"{path.relative_to(folder)}: {address} is loaded from another host"


def main():
    """Prints what is wrong with the given folder."""
    folder = Path(sys.argv[1]).resolve()
    found = list(problems(folder))
    if found or not any(folder.rglob("*.html")):
        sys.exit("\n".join(found) or f"check_site: there are no pages in {folder}")
    count = len(list(folder.rglob("*.html")))
    print(f"{count} pages in {folder}: all links lead somewhere, nothing is loaded from other hosts")


if __name__ == "__main__":
    main()
