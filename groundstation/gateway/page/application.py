"""The page as a web application: addresses, files, and what guards them."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Awaitable, Callable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles
from starlette.types import Receive, Scope, Send

from groundstation.gateway.page.answer_hub import Hub
from groundstation.gateway.page.connections import SignedPeers
from groundstation.gateway.page.openapi import openapi_document
from groundstation.gateway.page.page_handlers import PageHandlers
from groundstation.gateway.page.page_settings import PageSettings
from groundstation.gateway.page.request_guard import GuardMiddleware, RequestError
from groundstation.service.process.ground_process import GroundProcess

FILES = Path(__file__).parent / "static"


class EventStream:
    """The address of the stream as a plain application: no part of it is kept back."""

    def __init__(self, follow: Callable[[Scope, Receive, Send], Awaitable[None]]) -> None:
        self._follow = follow

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one reader."""
        await self._follow(scope, receive, send)


class Files(StaticFiles):
    """The page's own files: a browser asks each time whether they are still those it has."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        """One file."""
        response = await super().get_response(path, scope)
        response.headers["cache-control"] = "no-cache"
        return response


def page_application(process: GroundProcess, page: PageSettings, hub: Hub, signed: SignedPeers) -> Starlette:
    """Everything that the page's address serves."""
    handlers = PageHandlers(process, page, hub, signed, files_digest(), program_version())

    async def described(_request: Request) -> Response:
        return JSONResponse(openapi_document(program_version()))

    async def shell(_request: Request) -> Response:
        return FileResponse(FILES / "index.html", headers={"cache-control": "no-cache"})

    async def failed(request: Request, error: Exception) -> Response:
        """Count an internal error and report it in the answer; the next request is answered."""
        process.endpoint.counters["failed_queries"] += 1
        line = f"{request.url.path[:80]}: the ground station failed: {type(error).__name__}"
        return JSONResponse({"error": line}, 500)

    async def alive(_request: Request) -> Response:
        return JSONResponse({"alive": True})

    return Starlette(
        routes=[
            Route("/", shell),
            Route("/alive", alive),
            Mount("/static", Files(directory=FILES)),
            Route("/api/openapi.json", described),
            Route("/api/session", handlers.session, methods=["GET"]),
            Route("/api/session", handlers.sign_in, methods=["POST"]),
            Route("/api/session", handlers.sign_out, methods=["DELETE"]),
            Route("/api/stream", EventStream(handlers.stream)),
            Route("/api/cmd/{name}", handlers.order, methods=["POST"]),
            Route("/api/tables/{path:path}.csv", handlers.table),
            Route("/api/reports/{subject}.pdf", handlers.report),
            Route("/api/exports/{what}.{form}", handlers.export),
            Route("/api/{path:path}", handlers.answer),
        ],
        middleware=[
            Middleware(GuardMiddleware),
            Middleware(TrustedHostMiddleware, allowed_hosts=list(page.names), www_redirect=False),
        ],
        exception_handlers={RequestError: refuse_request, HTTPException: not_served, Exception: failed},
    )


async def refuse_request(_request: Request, error: Exception) -> Response:
    """What is wrong with a request, in a line."""
    if not isinstance(error, RequestError):
        raise error
    headers = {"retry-after": str(math.ceil(error.retry_after))} if error.retry_after else {}
    if error.status in (408, 413):
        headers["connection"] = "close"
    return JSONResponse({"error": error.line}, error.status, headers)


async def not_served(request: Request, error: Exception) -> Response:
    """An address or a method that there is not."""
    if not isinstance(error, HTTPException):
        raise error
    line = f"{request.method} {request.url.path[:80]}: {error.detail}; see /api/openapi.json"
    return JSONResponse({"error": line}, error.status_code, error.headers)


def program_version() -> str:
    """Version of the installed program."""
    try:
        return version("borechain")
    except PackageNotFoundError:
        return "0"


def files_digest() -> str:
    """Name of the files as they are: a page of another build loads itself anew."""
    digest = hashlib.sha256()
    for path in sorted(FILES.rglob("*.*")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
