"""What every request meets before anything else: headers that keep other pages out, and a limit on its body."""

from __future__ import annotations

import asyncio
import json
from typing import Any

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import ClientDisconnect, Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

LARGEST_BODY = 16_384  # bytes
BODY_WITHIN_S = 10.0
HEADERS = {
    "content-security-policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; "
    "connect-src 'self'; manifest-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "permissions-policy": "camera=(), geolocation=(), microphone=()",
}
LASTING = "max-age=31536000"  # s, of HTTPS once it was used


class RequestError(Exception):
    """A request that is refused: its HTTP status, the line for its sender, and seconds to wait."""

    def __init__(self, status: int, line: str, retry_after: float = 0.0) -> None:
        super().__init__(line)
        self.status, self.line, self.retry_after = status, line, retry_after


class GuardMiddleware:
    """Puts the headers on every answer; what is not said to be kept is not kept."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""

        async def guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in HEADERS.items():
                    headers[name] = value
                headers.setdefault("cache-control", "no-store")
                if scope.get("scheme") == "https":
                    headers["strict-transport-security"] = LASTING
            await send(message)

        await self._app(scope, receive, guarded if scope["type"] == "http" else send)


def check_origin(request: Request) -> None:
    """Refuse a request that another page has made.

    Raises
    ------
    RequestError
    """
    headers: Headers = request.headers
    origin, own = headers.get("origin"), f"{request.url.scheme}://{headers.get('host', '')}"
    site = headers.get("sec-fetch-site", "same-origin")
    if (origin is not None and origin != own) or site not in ("same-origin", "none"):
        raise RequestError(403, f"expected a request of the page at {own}, got one of {(origin or site)!r:.80}")


async def json_body(request: Request) -> dict[str, Any]:
    """The body of a request, an object in JSON.

    Raises
    ------
    RequestError
        When it is something else, too long, or does not come.
    """
    if request.headers.get("content-type", "").partition(";")[0].strip() != "application/json":
        raise RequestError(415, "expected a body of application/json")
    body = bytearray()
    try:
        async with asyncio.timeout(BODY_WITHIN_S):
            async for chunk in request.stream():
                body += chunk
                if len(body) > LARGEST_BODY:
                    raise RequestError(413, f"expected a body of at most {LARGEST_BODY} bytes")
    except (TimeoutError, ClientDisconnect):
        raise RequestError(408, f"expected the body within {BODY_WITHIN_S:.0f} s") from None
    try:
        content = json.loads(body)
    except (ValueError, RecursionError):
        content = None
    if not isinstance(content, dict):
        raise RequestError(400, "expected an object in JSON")
    return content


def text_of(content: dict[str, Any], name: str, longest: int = 256) -> str:
    """A text of a body.

    Raises
    ------
    RequestError
        When it is missing, or something else.
    """
    value = content.get(name)
    if not isinstance(value, str) or not 0 < len(value) <= longest:
        raise RequestError(400, f"{name}: expected a text of 1 to {longest} characters")
    return value
