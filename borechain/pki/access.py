"""Who may do what at the router: zenoh's access control, by the common name of a client's certificate.

What no rule allows is denied. A process writes its own port and nothing else, hears the ports of others, since the order of
a string is found, and takes its steps where a stepper drives it. Everybody who has a certificate may be listed at once:
a tube that comes later needs no restart of the router.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from telemetry import keys
from telemetry.messages import MAX_TUBE

OPERATOR = "operator"  # reads what the ground station serves
DRILLER = "driller"  # an operator who may order
MEDIUM = "medium"  # the simulated world: it joins the ports of all
ROLES = (OPERATOR, DRILLER, MEDIUM)
TOKEN = "borechain/{rig}/@liveliness/"
LEASES = "borechain/{rig}/@lease/*"

WRITES = ("writes", ("put", "delete"), ("declare_subscriber",))
READS = ("reads", ("declare_subscriber",), ("put", "delete"))
ASKS = ("asks", ("query",), ("reply", "declare_queryable"))
ANSWERS = ("answers", ("declare_queryable", "reply"), ("query",))
LIVES = ("lives", ("liveliness_token",), ())
WATCHES = ("watches", ("liveliness_query", "declare_liveliness_subscriber"), ("liveliness_token",))
Way = tuple[str, tuple[str, ...], tuple[str, ...]]  # name, messages that come in, messages that go out


@dataclass(frozen=True, slots=True)
class Grant:
    """What a subject may do with some keys."""

    way: Way
    expressions: tuple[str, ...]


def grants_of(rig: str, subject: str) -> list[Grant]:
    """Everything that the holder of a certificate may do; ``subject`` is its common name."""
    ground, command = keys.GROUND.format(rig=rig, path="**"), keys.COMMAND.format(rig=rig, name="**")
    depth, tokens = keys.DEPTH.format(rig=rig), TOKEN.format(rig=rig)
    if subject == MEDIUM:
        everything = (f"borechain/{rig}/**",)
        return [Grant(way, everything) for way in (WRITES, READS, ASKS)] + [Grant(WATCHES, (f"{tokens}*",))]
    if subject in (OPERATOR, DRILLER):
        asked = (ground, command) if subject == DRILLER else (ground,)
        return [Grant(READS, (ground,)), Grant(ASKS, asked), Grant(WATCHES, (f"{tokens}*",))]
    if subject == "depth":
        return [Grant(WRITES, (depth,))]
    own = subject.removeprefix("tube-")
    ports = f"borechain/{rig}/port"
    grants = [
        Grant(WRITES, (f"{ports}/{own}/*/tx", keys.DONE.format(rig=rig, process=own))),
        Grant(READS, (f"{ports}/*/*/tx", f"{ports}/{own}/*/rx", keys.STEP.format(rig=rig, process=own))),
        Grant(LIVES, (f"{tokens}{own}",)),
    ]
    if subject == "base":
        grants += [
            Grant(WRITES, (ground,)),
            Grant(READS, (depth,)),
            Grant(ANSWERS, (ground, command)),
            Grant(LIVES, (LEASES.format(rig=rig),)),
            Grant(WATCHES, (LEASES.format(rig=rig),)),
        ]
    return grants


def subjects(revoked: Iterable[int] = ()) -> list[str]:
    """Common names that the router knows."""
    tubes = [f"tube-{tube}" for tube in range(1, MAX_TUBE + 1) if tube not in set(revoked)]
    return ["base", "encoder", "depth", *ROLES, *tubes]


def access_control(rig: str, names: Sequence[str]) -> dict[str, Any]:
    """zenoh's ``access_control`` for the holders of certificates with these names."""
    rules, policies = [], []
    for name in names:
        ids = []
        for number, grant in enumerate(grants_of(rig, name)):
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
        "subjects": [{"id": name, "cert_common_names": [name]} for name in names],
        "policies": policies,
    }
