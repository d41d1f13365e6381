"""What the tests of doors and places share."""

import socketserver
import threading

import pytest


@pytest.fixture
def server():
    """Yield an address, and the requests that reached it."""
    asked = []

    class Asked(socketserver.StreamRequestHandler):
        def handle(self):
            asked.append(self.rfile.readline())
            self.wfile.write(b"HTTP/1.0 404 Not Found\r\n\r\n")

    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), Asked) as listening:
        # Asked each 10 ms whether to end, not each half second.
        threading.Thread(target=listening.serve_forever, args=(0.01,), daemon=True).start()
        yield f"http://127.0.0.1:{listening.server_address[1]}", asked
        listening.shutdown()
