"""The live view: on this machine only, to this machine's browser only, and gone when closed."""

import http.client
import socket
import threading
import time
import urllib.error
import urllib.request
import webbrowser

import pytest

from gaitopt.errors import InputError
from gaitopt.planners.crawl import plan_crawl
from gaitopt.robots.catalog import load_robot
from gaitopt.terrain.columns import s_columns
from gaitopt.viewing.replay.live import view
from gaitopt.viewing.replay.replay import replay_html


@pytest.fixture(scope="module")
def walk():
    return plan_crawl(load_robot("wang2020"), s_columns(0, columns=2, forward=0.09))


def ask(url, path="/", host=None, method="GET"):
    port = int(url.rsplit(":", 1)[1].strip("/"))
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=5)
    connection.request(method, path, headers={} if host is None else {"Host": host})
    answer = connection.getresponse()
    body = answer.read()
    connection.close()
    return answer, body


def test_it_serves_the_replay_and_is_gone_afterwards(walk):
    before = set(threading.enumerate())
    with view(walk, open_browser=False, title="a walk") as url:
        assert url.startswith("http://127.0.0.1:")
        answer, body = ask(url)
        assert answer.status == 200
        assert body.decode() == replay_html(walk, title="a walk")
        assert "default-src 'none'" in answer.headers["Content-Security-Policy"]
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(url, timeout=2)
    assert set(threading.enumerate()) == before


def test_it_listens_on_the_loopback_address_alone(walk):
    with view(walk, open_browser=False) as url:
        port = int(url.rsplit(":", 1)[1].strip("/"))
        with socket.create_connection(("127.0.0.1", port), timeout=2):
            pass
        # A server on every interface would answer on this address of the same machine as well.
        with pytest.raises(OSError), socket.create_connection(("127.0.0.2", port), timeout=2):
            pass


@pytest.mark.parametrize("host", ["evil.example", "evil.example:80", "127.0.0.1", ""])
def test_a_foreign_host_name_is_refused(walk, host):
    with view(walk, open_browser=False) as url:
        answer, body = ask(url, host=host)
        assert answer.status == 403
        assert b"gaitopt" not in body


def test_there_is_one_page_and_no_way_to_any_file(walk):
    with view(walk, open_browser=False) as url:
        assert ask(url, "/../../etc/passwd")[0].status == 404
        assert ask(url, "/favicon.ico")[0].status == 404
        answer, body = ask(url, method="HEAD")
        assert (answer.status, body) == (200, b"")
        assert ask(url, method="POST")[0].status == 501


def test_it_works_without_with_and_closes_twice(walk, monkeypatch):
    opened = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    shown = view(walk)
    assert opened == [shown.url]
    assert not shown.closed
    shown.close()
    shown.close()
    assert shown.closed
    assert "closed" in repr(shown)


def test_a_silent_browser_does_not_hold_it_open(walk):
    before = set(threading.enumerate())
    shown = view(walk, open_browser=False)
    port = int(shown.url.rsplit(":", 1)[1].strip("/"))
    with socket.create_connection(("127.0.0.1", port)) as idle:
        idle.sendall(b"GET / HT")
        time.sleep(0.1)
        start = time.perf_counter()
        shown.close()
        assert time.perf_counter() - start < 2
    assert set(threading.enumerate()) == before


def test_it_closes_after_an_error_too(walk):
    with pytest.raises(RuntimeError), view(walk, open_browser=False) as url:
        raise RuntimeError
    with pytest.raises(OSError):
        ask(url)


def test_a_port_that_cannot_be_had_is_named(walk):
    with view(walk, open_browser=False) as url:
        port = int(url.rsplit(":", 1)[1].strip("/"))
        with pytest.raises(InputError, match=f"{port}.*port=0"):
            view(walk, open_browser=False, port=port)
    for bad in (-1, 70000, True, "80"):
        with pytest.raises(InputError, match="port must be"):
            view(walk, open_browser=False, port=bad)
