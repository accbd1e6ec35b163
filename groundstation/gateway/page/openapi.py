"""The OpenAPI document of the page's addresses, made from the code that answers and obeys."""

from __future__ import annotations

import math
import re
from typing import Any

from groundstation.gateway.page.exports import EXPORTED, MEDIA, PARAMETERS
from groundstation.gateway.page.passwords import ROLES
from groundstation.gateway.page.reports import PAPERS, SUBJECTS
from groundstation.service.answers.answer_table import ANSWERS, AnswerKey
from groundstation.service.answers.shapes.answer_fields import object_schema
from telemetry.application.arguments import shown_name
from telemetry.application.commands import COMMANDS, CommandSpec
from telemetry.quantities import ValueKind

View = dict[str, Any]
JSON_TYPES = {ValueKind.NUMBER: "number", ValueKind.INTEGER: "integer", ValueKind.BOOLEAN: "boolean"}
REFUSED = {"type": "object", "properties": {"error": {"type": "string"}}, "required": ["error"]}
TABLES = ("stations", "measurements")  # that the page has buttons for; others are had alike
EXPORT_HELP = {
    "origin": "NORTHING,EASTING,HEIGHT of the collar, m; a wall's file has its own",
    "grid_crs": "code of the grid of those coordinates, such as EPSG:25833",
}
SIGN_IN = {
    "type": "object",
    "properties": {
        "role": {"type": "string", "enum": list(ROLES)},
        "name": {"type": "string", "description": "who orders, for the record"},
        "password": {"type": "string"},
    },
    "required": ["role", "name", "password"],
}
SESSION = {
    "type": "object",
    "properties": {
        "role": {"type": ["string", "null"]},
        "name": {"type": ["string", "null"]},
        "csrf": {"type": ["string", "null"], "description": "to be repeated as x-csrf-token"},
        "reads": {"type": "boolean"},
        "orders": {"type": "boolean"},
        "roles": {"type": "array", "items": {"type": "string"}, "description": "that have a password"},
    },
    "required": ["role", "name", "csrf", "reads", "orders", "roles"],
}


def openapi_document(version: str) -> View:
    """The whole document."""
    answers = {f"/api/{pattern}": {"get": answer_operation(answer)} for pattern, answer in ANSWERS.items()}
    orders = {
        f"/api/cmd/{name}": {"post": command_operation(name)} for name in dict.fromkeys(spec.name for spec in COMMANDS)
    }
    return {
        "openapi": "3.1.0",
        "info": {
            "title": "borechain ground station",
            "version": version,
            "description": "The keys of one rig over HTTP. Reading needs no session on loopback; ordering needs one of "
            "the role driller, and its csrf value in the header x-csrf-token.",
        },
        "paths": answers | table_paths() | report_paths() | export_paths() | orders | session_paths() | stream_path(),
        "components": {"securitySchemes": {"session": {"type": "apiKey", "in": "cookie", "name": "borechain"}}},
    }


def answer_operation(answer: AnswerKey) -> View:
    """One answer."""
    inside = [{"name": name, "in": "path", "required": True, "schema": {"type": "integer"}} for name in answer.numbers]
    query = [{"name": name, "in": "query", "schema": {"type": "string"}} for name in answer.parameters]
    return {
        "operationId": "ask_" + re.sub(r"[^a-z_]+", "_", answer.path).strip("_"),
        "parameters": inside + query,
        "responses": {"200": content_of("the answer", object_schema(answer.fields))} | error_responses(400, 401, 404),
    }


def table_paths() -> View:
    """Answers with a list of rows as files of CSV."""
    text = {"text/csv": {"schema": {"type": "string"}}}
    return {
        f"/api/tables/{name}.csv": {
            "get": {
                "operationId": f"table_{name}",
                "responses": {"200": {"description": "the rows of the answer, with a header", "content": text}}
                | error_responses(400, 401),
            }
        }
        for name in TABLES
    }


def report_paths() -> View:
    """Reports to be signed as PDF."""
    pdf = {"application/pdf": {"schema": {"type": "string", "format": "binary"}}}
    return {
        f"/api/reports/{subject}.pdf": {
            "get": {
                "operationId": f"report_{subject}",
                "parameters": [
                    {"name": name, "in": "query", "schema": {"type": "string"}, "description": told}
                    for name, told in PAPERS.items()
                ],
                "responses": {"200": {"description": f"what is known of the {subject} now", "content": pdf}}
                | error_responses(400, 401, 404, 409, 501, 503),
            }
        }
        for subject in SUBJECTS
    }


def export_paths() -> View:
    """The hole and the wall as files of other programs."""
    return {
        f"/api/exports/{what}.{form}": {
            "get": {
                "operationId": f"export_{what}_{form}",
                "parameters": [
                    {"name": name, "in": "query", "schema": {"type": "string"}, "description": EXPORT_HELP[name]}
                    for name in PARAMETERS
                ],
                "responses": {
                    "200": {
                        "description": f"what is known of the {what} now",
                        "content": {media: {"schema": {"type": "string"}}},
                    }
                }
                | error_responses(400, 401, 404, 409, 501),
            }
        }
        for what in EXPORTED
        for form, media in MEDIA.items()
    }


def command_operation(name: str) -> View:
    """One command, with all its actions."""
    specs = [spec for spec in COMMANDS if spec.name == name]
    schemas = [arguments_of(spec) for spec in specs]
    body = schemas[0] if len(schemas) == 1 else {"oneOf": schemas}
    order = object_schema(ANSWERS["orders/{n}"].fields)
    return {
        "operationId": f"order_{name}",
        "description": "; ".join(f"{spec.action}: {spec.meaning}" if spec.action else spec.meaning for spec in specs),
        "security": [{"session": []}],
        "parameters": [
            {
                "name": "wait",
                "in": "query",
                "schema": {"type": "string", "enum": ["true"]},
                "description": "for the tube",
            },
            {"name": "x-csrf-token", "in": "header", "required": True, "schema": {"type": "string"}},
        ],
        "requestBody": {"required": True, "content": {"application/json": {"schema": body}}},
        "responses": {
            "200": content_of("the order, answered", order),
            "202": content_of("the order; its course is /api/orders/{n}", order),
        }
        | error_responses(400, 401, 403, 408, 413, 415),
    }


def arguments_of(spec: CommandSpec) -> View:
    """JSON schema of the body of one command."""
    properties: View = {}
    if spec.action:
        properties["action"] = {"const": spec.action}
    else:
        properties["tube"] = {"type": "integer", "description": "number of the tube"}
    for argument in spec.arguments:
        q = argument.quantity
        turn = math.degrees(1.0) if q.unit == "rad" else 1.0
        limits = {"minimum": q.low * turn, "maximum": q.high * turn} if q.kind in JSON_TYPES else {}
        properties[shown_name(q)] = {
            "type": JSON_TYPES.get(q.kind, "string"),
            "description": q.meaning,
            **{name: value for name, value in limits.items() if math.isfinite(value)},
            **({"enum": list(q.choices)} if q.choices else {}),
        }
    needed = ["action" if spec.action else "tube"]
    needed += [shown_name(argument.quantity) for argument in spec.arguments if argument.needed]
    return {"type": "object", "properties": properties, "required": needed, "additionalProperties": False}


def session_paths() -> View:
    """Who is signed in."""
    shown = {"200": content_of("who is signed in", SESSION)}
    body = {"required": True, "content": {"application/json": {"schema": SIGN_IN}}}
    return {
        "/api/session": {
            "get": {"operationId": "session", "responses": shown},
            "post": {
                "operationId": "sign_in",
                "requestBody": body,
                "responses": shown | error_responses(400, 401, 403, 408, 413, 415, 429),
            },
            "delete": {
                "operationId": "sign_out",
                "security": [{"session": []}],
                "responses": shown | error_responses(401, 403),
            },
        }
    }


def stream_path() -> View:
    """The stream."""
    text = {"text/event-stream": {"schema": {"type": "string"}}}
    told = "hello once, then answer with {path, answer}: everything at first, and then what changes"
    return {
        "/api/stream": {
            "get": {
                "operationId": "follow",
                "responses": {"200": {"description": told, "content": text}} | error_responses(401, 503),
            }
        }
    }


def content_of(description: str, schema: View) -> View:
    """A response in JSON."""
    return {"description": description, "content": {"application/json": {"schema": schema}}}


def error_responses(*statuses: int) -> View:
    """Responses that say in a line what is wrong."""
    return {str(status): content_of("refused, and why", REFUSED) for status in statuses}
