"""Looks at all links of a built site: each leads to a place that is there, and nothing is fetched from elsewhere."""

import re
from html.parser import HTMLParser
from urllib.parse import unquote, urlsplit

# Files that a page shows or runs must lie in the site, which is read without a network.
FETCHED = {"img": "src", "script": "src", "link": "href", "iframe": "src", "source": "src"}


class _Page(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.anchors, self.links, self.fetched = set(), [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.anchors |= {given[name] for name in ("id", "name") if given.get(name)}
        if tag == "a" and given.get("href"):
            self.links.append(given["href"])
        if FETCHED.get(tag) and given.get(FETCHED[tag]) and given.get("rel") not in ("canonical", "search", "index"):
            self.fetched.append(given[FETCHED[tag]])


def problems(folder, without=()):
    """Yields a sentence for each link that leads nowhere; those to folders in `without` are passed over.

    Pages of other programs, which lie in `rust`, are led to but not looked at.
    """
    pages = {}
    for path in folder.rglob("*.html"):
        if path.relative_to(folder).parts[0] != "rust":
            pages[path.resolve()] = _Page(path.read_text("utf-8"))
    for path, page in sorted(pages.items()):
        name = path.relative_to(folder.resolve())
        for link in [*page.links, *page.fetched]:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                if link in page.fetched and parts.scheme != "data":
                    yield f"{name} fetches {link}"
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if re.split(r"[/\\]", str(target.relative_to(folder.resolve())))[0] in without:
                continue
            if not target.is_file():
                yield f"{name}: {link} leads nowhere"
            elif parts.fragment and target in pages and unquote(parts.fragment) not in pages[target].anchors:
                yield f"{name}: {link} leads to no place of that page"
