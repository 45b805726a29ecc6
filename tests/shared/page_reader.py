"""Reads an HTML page as a browser does, and checks that it is well formed."""

from html.parser import HTMLParser

VOID = {"meta", "img", "circle", "path"}


class Page(HTMLParser):
    """What is in a page: `tags`, `text`, and `attributes` by tag and name."""

    def __init__(self, source):
        super().__init__()
        self.tags, self.pieces, self.attributes = set(), [], {}
        self._open, self._widths = [], []
        self.feed(source)
        self.close()
        assert self._open == []

    @property
    def text(self):
        """All that is no markup, unescaped."""
        return " ".join(self.pieces)

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)
        for name, value in attrs:
            self.attributes.setdefault((tag, name), []).append(value)
        if tag not in VOID:
            self._open.append(tag)
        if tag == "table":
            self._widths = []
        elif tag == "tr":
            self._widths.append(0)
        elif tag in {"th", "td"}:
            self._widths[-1] += 1

    def handle_endtag(self, tag):
        if tag not in VOID:
            assert self._open.pop() == tag
        if tag == "table":
            assert len(set(self._widths)) == 1, "a row has more or fewer cells than the head"

    def handle_data(self, data):
        self.pieces.append(data)


class Hostile:
    """Makes texts that run a script where they are not escaped, and remembers them."""

    def __init__(self):
        self.texts = []

    def __call__(self, place):
        text = f"\"'><script>alert('{place}')</script>&amp;"
        self.texts.append(text)
        return text
