"""The page's addresses asked as any program would ask them."""

from __future__ import annotations

import http.client
import json
import socket
import ssl
from dataclasses import dataclass, field
from typing import Any

PATIENCE = 60.0  # s
PASSWORD = "a long enough word"


def free_port() -> int:
    """Return a TCP port that is free now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@dataclass(frozen=True, slots=True)
class Answer:
    """What came back."""

    status: int
    headers: dict[str, str]
    body: bytes

    @property
    def content(self) -> Any:
        return json.loads(self.body)


@dataclass
class PageClient:
    """Asks one page; signs in and orders as the page itself does."""

    port: int
    headers: dict[str, str] = field(default_factory=dict)
    context: ssl.SSLContext | None = None  # over HTTPS

    def ask(self, method: str, address: str, body: object = None, **headers: str) -> Answer:
        if self.context is None:
            connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE)
        else:
            connection = http.client.HTTPSConnection("127.0.0.1", self.port, timeout=PATIENCE, context=self.context)
        try:
            sent = {"content-type": "application/json"} | self.headers | headers
            payload = body if isinstance(body, bytes | None) else json.dumps(body).encode()
            connection.request(method, address, payload, sent)
            response = connection.getresponse()
            return Answer(
                response.status, {name.lower(): value for name, value in response.getheaders()}, response.read()
            )
        finally:
            connection.close()

    def get(self, address: str, **headers: str) -> Answer:
        return self.ask("GET", address, **headers)

    def post(self, address: str, body: object, **headers: str) -> Answer:
        return self.ask("POST", address, body, **headers)

    def sign_in(self, role: str = "driller", password: str = PASSWORD, name: str = "anna") -> Answer:
        answer = self.post("/api/session", {"role": role, "name": name, "password": password})
        if answer.status == 200:
            self.headers = {
                "cookie": answer.headers["set-cookie"].partition(";")[0],
                "x-csrf-token": answer.content["csrf"],
            }
        return answer
