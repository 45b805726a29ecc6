"""scripts/links.py: what it finds in pages, and how it judges a server's answers."""

import socket
import threading
from http.server import BaseHTTPRequestHandler, HTTPServer

import pytest
from links import ROOT, links, main, pages

ANSWERS = {"/there": 200, "/gone": 404, "/refused": 403}


class Answering(BaseHTTPRequestHandler):
    def do_GET(self):
        self.send_response(ANSWERS[self.path])
        self.end_headers()

    def log_message(self, *_):
        """Print nothing."""


@pytest.fixture
def server():
    """Return the address of a server with one good page, one that is gone and one that programs may not have."""
    with HTTPServer(("127.0.0.1", 0), Answering) as serving:
        thread = threading.Thread(target=serving.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{serving.server_port}"
        serving.shutdown()
        thread.join()


def test_links_are_found_once_without_their_punctuation_and_examples_are_left_out(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(
        "See [one](https://example.org/a_b#part), <https://example.org/a_b> and https://example.com.\n"
        "    flockwire: http://127.0.0.1:8420/#TOKEN and https://HOST/path"
    )
    assert links([page]) == {"https://example.org/a_b": page, "https://example.com": page}


def test_the_projects_pages_have_some():
    found = links(pages(ROOT))
    assert "https://doi.org/10.3390/electronics11152334" in found


@pytest.mark.parametrize(("paths", "status"), [(["/there"], 0), (["/there", "/refused"], 0), (["/gone"], 1)])
def test_only_a_page_that_is_gone_is_broken(server, paths, status, capsys):
    found = {f"{server}{path}": ROOT / "README.md" for path in paths}
    assert main(found, online=lambda: True) == status
    printed = capsys.readouterr().out
    assert f"links: {status} of {len(paths)} external links are broken" in printed
    assert ("not checked" in printed) == ("/refused" in paths)
    assert ("BROKEN" in printed) == bool(status)


def test_a_server_that_does_not_exist_is_broken(monkeypatch):
    def unknown(*_, **__):
        raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

    monkeypatch.setattr(socket, "getaddrinfo", unknown)
    assert main({"https://there-is-no-such-host.invalid/page": ROOT / "README.md"}) == 0  # nothing can be resolved
    assert main({"https://there-is-no-such-host.invalid/page": ROOT / "README.md"}, online=lambda: True) == 1


def test_without_the_internet_nothing_is_judged(capsys):
    assert main({"https://example.org": ROOT / "README.md"}, online=lambda: False) == 0
    assert "no internet: 1 external links not checked" in capsys.readouterr().out
