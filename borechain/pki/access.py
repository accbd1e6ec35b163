"""Who may do what at the router: zenoh's access control, by the common name of a client's certificate.

A process is known by its own name; a person by a name of its own, which stands here for a role.

What no rule allows is denied. A process writes its own port and nothing else, hears the ports of others, since the
order of a string is found, and takes its steps where a stepper drives it. All tubes that there can be are listed at
once, so one that comes later needs no restart of the router.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from borechain.pki.private_files import write_file
from telemetry import keys
from telemetry.errors import KeyFileError
from telemetry.messages import MAX_TUBE

ROUTER = "router"
ACCESS_FILE = "access.json"
OPERATOR = "operator"  # reads what the ground station serves
DRILLER = "driller"  # an operator who may order
MEDIUM = "medium"  # the simulated world: it joins the ports of all
TOKEN = "borechain/{rig}/@liveliness/"
LEASES = "borechain/{rig}/@lease/*"

WRITES = ("writes", ("put", "delete"), ())
IS_TOLD = ("is told", (), ("declare_subscriber",))  # who listens, which a port must know of its other end
READS = ("reads", ("declare_subscriber",), ("put", "delete"))
ASKS = ("asks", ("query",), ("reply", "declare_queryable"))
ANSWERS = ("answers", ("declare_queryable", "reply"), ("query",))
LIVES = ("lives", ("liveliness_token",), ())
WATCHES = ("watches", ("liveliness_query", "declare_liveliness_subscriber"), ("liveliness_token",))
Way = tuple[str, tuple[str, ...], tuple[str, ...]]  # name, messages that come in, messages that go out


@dataclass(frozen=True, slots=True)
class Grant:
    """Rights of a subject on some keys."""

    way: Way
    expressions: tuple[str, ...]


def grants_of(rig: str, subject: str) -> list[Grant]:
    """Everything that the holder of a certificate may do; ``subject`` is a process, or the role of a person."""
    ground = keys.GROUND.format(rig=rig, path="**")
    # a query need not name the rig: the authority, and so the router, is that of one rig
    ground_of_any, command_of_any = keys.GROUND.format(rig="*", path="**"), keys.COMMAND.format(rig="*", name="**")
    intake = keys.INTAKE.format(rig=rig)  # what the ground station takes in, for a recording
    intake_of_any = keys.INTAKE.format(rig="*")
    depth, tokens = keys.DEPTH.format(rig=rig), TOKEN.format(rig=rig)
    everything = (f"borechain/{rig}/**",)
    told = Grant(IS_TOLD, everything)
    if subject == MEDIUM:
        return [told] + [Grant(way, everything) for way in (WRITES, READS, ASKS)] + [Grant(WATCHES, (f"{tokens}*",))]
    if subject in (OPERATOR, DRILLER):
        read = (ground_of_any, intake_of_any)
        asked = (*read, command_of_any) if subject == DRILLER else read
        return [
            Grant(READS, (*read, depth)),
            Grant(ASKS, asked),
            Grant(WATCHES, (f"{tokens}*", LEASES.format(rig="*"))),
        ]
    if subject == "depth":
        return [told, Grant(WRITES, (depth,))]
    own = subject.removeprefix("tube-")
    ports = f"borechain/{rig}/port"
    grants = [
        told,
        Grant(WRITES, (f"{ports}/{own}/*/tx", keys.DONE.format(rig=rig, process=own))),
        Grant(READS, (f"{ports}/*/*/tx", f"{ports}/{own}/*/rx", keys.STEP.format(rig=rig, process=own))),
        Grant(LIVES, (f"{tokens}{own}",)),
    ]
    if subject == "base":
        grants += [
            Grant(WRITES, (ground, intake)),
            Grant(READS, (depth,)),
            Grant(ANSWERS, (ground_of_any, command_of_any, intake_of_any)),
            Grant(LIVES, (LEASES.format(rig=rig),)),
            Grant(WATCHES, (LEASES.format(rig=rig),)),
        ]
    return grants


def subjects_of(persons: Mapping[str, str], revoked: Iterable[int] = ()) -> dict[str, str]:
    """What each common name that the router knows is let in as: a process as itself, a person by its role."""
    tubes = [f"tube-{tube}" for tube in range(1, MAX_TUBE + 1) if tube not in set(revoked)]
    processes = ["base", "encoder", "depth", MEDIUM, *tubes]
    return dict(persons) | dict(zip(processes, processes, strict=True))


def access_control(rig: str, subjects: Mapping[str, str]) -> dict[str, Any]:
    """The value of zenoh's ``access_control``; ``subjects`` as of ``subjects_of``."""
    rules, policies = [], []
    for name, subject in subjects.items():
        ids = []
        for number, grant in enumerate(grants_of(rig, subject)):
            what, comes, goes = grant.way
            for flow, messages in (("ingress", comes), ("egress", goes)):
                if messages:
                    ids.append(f"{name} {what} {number} {flow}")
                    rules.append(
                        {
                            "id": ids[-1],
                            "permission": "allow",
                            "flows": [flow],
                            "messages": list(messages),
                            "key_exprs": list(grant.expressions),
                        }
                    )
        policies.append({"rules": ids, "subjects": [name]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [{"id": name, "cert_common_names": [name]} for name in subjects],
        "policies": policies,
    }


def write_access(folder: Path, rig: str, persons: Mapping[str, str], revoked: Iterable[int]) -> None:
    """Write the access rules of a rig's router, as a part of its configuration.

    Raises
    ------
    KeyFileError
        When it cannot be written.
    """
    settings = {"access_control": access_control(rig, subjects_of(persons, revoked))}
    write_file(folder / ACCESS_FILE, json.dumps(settings, indent=1) + "\n")


def read_access(folder: Path) -> dict[str, Any]:
    """Return the access rules of a rig's router.

    Raises
    ------
    KeyFileError
        When the folder does not say it.
    """
    path = folder / ACCESS_FILE
    try:
        found = json.loads(path.read_text())["access_control"]
    except (OSError, ValueError, LookupError, TypeError):
        found = None
    if not isinstance(found, dict):
        raise KeyFileError(f"{path}: expected the access control that borechain pki writes, got none")
    return found
