"""A replay served to a browser on this machine, until it is closed."""

from __future__ import annotations

import contextlib
import socket
import threading
import webbrowser
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from types import TracebackType
from typing import Any

from gaitopt.errors import InputError
from gaitopt.files import StrPath
from gaitopt.inputs import check_count
from gaitopt.plan.plan import Plan
from gaitopt.viewing.replay.page import POLICY
from gaitopt.viewing.replay.replay import replay_html

LOOPBACK = "127.0.0.1"
PATIENCE = 10.0
"""How long a connection may stay silent [s]."""


def view(
    plan: Plan,
    *,
    open_browser: bool = True,
    port: int = 0,
    title: str | None = None,
    meshes: bool | StrPath = False,
) -> LiveView:
    """Show a plan in the browser, served from this machine to this machine only.

    ::

        with gaitopt.view(plan) as url:
            input(f"{url} is open until you press Enter")

    or ``shown = gaitopt.view(plan)`` and later ``shown.close()``.

    Args:
        plan: the motion.
        open_browser: whether to open the address in the default browser.
        port: TCP port on 127.0.0.1; 0 takes a free one.
        title, meshes: as for :func:`gaitopt.replay`.

    Raises:
        InputError: the port is no port or is taken, or a mesh is missing.
    """
    check_count("port", port, 0, 65535)
    shown = LiveView(replay_html(plan, title=title, meshes=meshes), port)
    if open_browser:
        webbrowser.open(shown.url)
    return shown


class LiveView:
    """A page that is served on 127.0.0.1 until :meth:`close`; as a context it gives its address.

    Attributes:
        url: where it is, ``http://127.0.0.1:<port>/``.
    """

    def __init__(self, page: str, port: int = 0) -> None:
        try:
            self._server = _Server(page.encode("utf-8"), port)
        except OSError as error:
            raise InputError(
                f"cannot serve on {LOOPBACK}:{port}: {error.strerror or error}; "
                "port=0 takes a free port"
            ) from error
        self.url = f"http://{LOOPBACK}:{self._server.server_port}/"
        # A daemon, so that a view that nobody closes does not keep Python from ending.
        self._thread = threading.Thread(
            target=self._server.serve_forever, kwargs={"poll_interval": 0.05},
            name="gaitopt view", daemon=True,
        )  # fmt: skip
        self._thread.start()

    @property
    def closed(self) -> bool:
        """Whether it is no longer served."""
        return not self._thread.is_alive()

    def close(self) -> None:
        """Stop serving: no thread and no socket is left. Closing twice does no harm."""
        if not self.closed:
            self._server.shutdown()
            self._thread.join()
            self._server.hang_up()
            self._server.server_close()

    def __enter__(self) -> str:
        return self.url

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"LiveView({self.url!r}{', closed' if self.closed else ''})"


class _Server(ThreadingHTTPServer):
    # Threads of requests are joined when the server closes, and hang_up() lets them end at once.
    daemon_threads = False

    def __init__(self, page: bytes, port: int) -> None:
        self.page = page
        self._open: set[socket.socket] = set()
        self._lock = threading.Lock()
        super().__init__((LOOPBACK, port), _Handler)

    def server_bind(self) -> None:
        # HTTPServer would look its own name up, which can take seconds without a network.
        self.socket.bind(self.server_address)
        self.server_address = self.socket.getsockname()
        self.server_name, self.server_port = LOOPBACK, int(self.server_address[1])

    def process_request(self, request: Any, client_address: Any) -> None:
        with self._lock:
            self._open.add(request)
        super().process_request(request, client_address)

    def shutdown_request(self, request: Any) -> None:
        with self._lock:
            self._open.discard(request)
        super().shutdown_request(request)

    def hang_up(self) -> None:
        """End connections that a browser holds open without asking for anything."""
        with self._lock:
            for connection in self._open:
                with contextlib.suppress(OSError):
                    connection.shutdown(socket.SHUT_RDWR)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A browser that goes away in the middle is no error of ours."""


class _Handler(BaseHTTPRequestHandler):
    server: _Server
    server_version, sys_version = "gaitopt", ""
    timeout = PATIENCE

    def do_GET(self) -> None:
        self._answer(with_body=True)

    def do_HEAD(self) -> None:
        self._answer(with_body=False)

    def _answer(self, with_body: bool) -> None:
        # A foreign page whose name was made to point here still sends its own name as Host.
        hosts = {f"{name}:{self.server.server_port}" for name in (LOOPBACK, "localhost")}
        if self.headers.get("Host", "") not in hosts:
            self.send_error(HTTPStatus.FORBIDDEN, "unknown host")
            return
        if self.path not in ("/", "/index.html"):
            self.send_error(HTTPStatus.NOT_FOUND)
            return
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", "text/html; charset=utf-8")
        self.send_header("Content-Length", str(len(self.server.page)))
        self.send_header("Content-Security-Policy", f"{POLICY}; frame-ancestors 'none'")
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Referrer-Policy", "no-referrer")
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        if with_body:
            self.wfile.write(self.server.page)

    def log_message(self, format: str, *args: object) -> None:
        """Nothing is printed."""
