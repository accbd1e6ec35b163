"""Who may do what, by which key and until when: every right of every subject, every date at and beside its bound."""

from __future__ import annotations

import asyncio
import contextlib
import datetime
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from cryptography import x509
from cryptography.x509.oid import NameOID
from starlette.requests import Request
from test_kept_as_told import NOW, MadeBus, beside

from borechain.pki.access import (
    ANSWERS,
    ASKS,
    DRILLER,
    IS_TOLD,
    LIVES,
    MEDIUM,
    OPERATOR,
    READS,
    WATCHES,
    WRITES,
    access_control,
    grants_of,
    subjects_of,
)
from borechain.pki.certificates import make_authority, make_certificate
from borechain.pki.persons import MOST, Person, admitted_roles, person_lines, person_of, with_person, without_person
from borechain.pki.rig_keys import (
    add_person,
    add_tube,
    init_rig,
    read_secret,
    renew_certificate,
    revoke_person,
    revoke_tube,
    rotate_keys,
)
from groundstation.gateway.page.passwords import PasswordBook, find_holder, text_of
from groundstation.gateway.page.request_guard import (
    LARGEST_BODY,
    RequestError,
    check_origin,
    json_body,
)
from groundstation.gateway.page.request_guard import text_of as text_of_body
from groundstation.gateway.page.sessions import REMEMBERED, Sessions, WrongPasswords
from telemetry.errors import KeyFileError
from telemetry.messages import BASE, MAX_TUBE
from telemetry.transport.certificate_dates import certificate_trouble
from telemetry.transport.key_ring import Generation, KeyRing, keys_of

R = "borechain/r"
PORTS, ALL = f"{R}/port", f"{R}/**"
ANY_GROUND, ANY_INTAKE, ANY_COMMAND = "borechain/*/ground/**", "borechain/*/intake", "borechain/*/cmd/**"
DEPTH, TOKENS, LEASES = f"{R}/surface/depth", f"{R}/@liveliness/*", f"{R}/@lease/*"


def of_process(name: str) -> set[tuple[str, tuple[str, ...]]]:
    """What every process of the string may do, and nothing of others."""
    return {
        ("is told", (ALL,)),
        ("writes", (f"{PORTS}/{name}/*/tx", f"{R}/stepper/{name}/done")),
        ("reads", (f"{PORTS}/*/*/tx", f"{PORTS}/{name}/*/rx", f"{R}/stepper/{name}/step")),
        ("lives", (f"{R}/@liveliness/{name}",)),
    }


READ = {("reads", (ANY_GROUND, ANY_INTAKE, DEPTH)), ("watches", (TOKENS, "borechain/*/@lease/*"))}
RIGHTS: dict[str, set[tuple[str, tuple[str, ...]]]] = {
    OPERATOR: READ | {("asks", (ANY_GROUND, ANY_INTAKE))},
    DRILLER: READ | {("asks", (ANY_GROUND, ANY_INTAKE, ANY_COMMAND))},
    "depth": {("is told", (ALL,)), ("writes", (DEPTH,))},
    MEDIUM: {(way, (ALL,)) for way in ("is told", "writes", "reads", "asks")} | {("watches", (TOKENS,))},
    "encoder": of_process("encoder"),
    "tube-7": of_process("7"),
    "base": of_process("base")
    | {
        ("writes", (f"{R}/ground/**", f"{R}/intake")),
        ("reads", (DEPTH,)),
        ("answers", (ANY_GROUND, ANY_COMMAND, ANY_INTAKE)),
        ("lives", (LEASES,)),
        ("watches", (LEASES,)),
    },
}


@pytest.mark.parametrize("subject", RIGHTS)
def test_a_subject_has_these_rights_and_no_other(subject: str) -> None:
    found = [(grant.way[0], grant.expressions) for grant in grants_of("r", subject)]
    assert sorted(found) == sorted(RIGHTS[subject])


def test_a_right_is_these_messages_in_and_out() -> None:
    assert {way[0]: (set(way[1]), set(way[2])) for way in (WRITES, IS_TOLD, READS, ASKS, ANSWERS, LIVES, WATCHES)} == {
        "writes": ({"put", "delete"}, set()),
        "is told": (set(), {"declare_subscriber"}),
        "reads": ({"declare_subscriber"}, {"put", "delete"}),
        "asks": ({"query"}, {"reply", "declare_queryable"}),
        "answers": ({"declare_queryable", "reply"}, {"query"}),
        "lives": ({"liveliness_token"}, set()),
        "watches": ({"liveliness_query", "declare_liveliness_subscriber"}, {"liveliness_token"}),
    }
    rules = access_control("r", {"anna.2": OPERATOR})
    assert (rules["enabled"], rules["default_permission"]) == (True, "deny")
    assert rules["subjects"] == [{"id": "anna.2", "cert_common_names": ["anna.2"]}]
    (policy,) = rules["policies"]
    assert sorted(policy["rules"]) == sorted(rule["id"] for rule in rules["rules"])
    assert {(rule["permission"], *rule["flows"]) for rule in rules["rules"]} == {
        ("allow", "ingress"), ("allow", "egress"),
    }  # fmt: skip


def test_whoever_is_let_in_is_a_process_that_is_not_revoked_or_a_person_by_its_role() -> None:
    found = subjects_of({"anna": DRILLER, "ben.2": OPERATOR}, revoked=[3, MAX_TUBE])
    tubes = {f"tube-{k}" for k in range(1, MAX_TUBE) if k != 3}
    assert set(found) == {"anna", "ben.2", "base", "encoder", "depth", MEDIUM} | tubes
    assert {name: subject for name, subject in found.items() if name != subject} == {"anna": DRILLER, "ben.2": OPERATOR}


# persons


def test_a_person_who_comes_back_has_the_next_number_each_time_and_a_certificate_of_it(tmp_path: Path) -> None:
    init_rig(tmp_path, "rig-1", NOW)
    persons: tuple[Person, ...] = ()
    for number, name in ((1, "anna"), (2, "anna.2"), (3, "anna.3")):
        persons = with_person(persons, "anna", DRILLER)
        assert persons == with_person(persons, "anna", DRILLER)  # again, and nothing changes
        assert admitted_roles(persons) == {name: DRILLER}
        persons = without_person(persons, "anna")
        assert (persons[0].number, admitted_roles(persons)) == (number, {})
    assert person_of({"name": "anna", "role": DRILLER, "number": 3, "revoked": True}) == persons[0]
    assert person_lines(persons)[-1] == "revoked = true"
    assert person_lines([replace(persons[0], is_revoked=False, number=1)])[-1] == "number = 1"
    again = with_person(with_person((), "anna", OPERATOR), "ben", DRILLER)
    assert [person.name for person in again] == ["anna", "ben"]
    add_person(tmp_path, "cora", DRILLER, NOW)
    revoke_person(tmp_path, "cora")
    add_person(tmp_path, "cora", OPERATOR, NOW)
    for made in (tmp_path / "cora.pem", renew_certificate(tmp_path, "cora", NOW)):
        found = x509.load_pem_x509_certificate(made.read_bytes())
        assert found.subject.get_attributes_for_oid(NameOID.COMMON_NAME)[0].value == "cora.2"
        assert found.not_valid_after_utc == NOW + datetime.timedelta(days=183)


@pytest.mark.parametrize(("count", "is_taken"), [(MOST - 1, True), (MOST, False)])
def test_a_rig_has_exactly_so_many_persons(count: int, is_taken: bool) -> None:
    there = tuple(Person(f"p{k}", OPERATOR, is_revoked=k % 2 == 0) for k in range(count))
    with contextlib.nullcontext() if is_taken else pytest.raises(KeyFileError, match=f"at most {MOST} persons"):
        assert len(with_person(there, "anna", OPERATOR)) == count + 1
    assert len(with_person(there, "p0", OPERATOR)) == count  # one who comes back needs no place


def test_of_a_revoked_tube_no_file_is_left_and_every_key_of_before_is_old(tmp_path: Path) -> None:
    init_rig(tmp_path, "rig-1", NOW)
    for tube in (1, 2, 3):
        add_tube(tmp_path, tube, NOW)
    for revoked, numbers in ((2, [1, 2]), (3, [2, 3])):
        secret = revoke_tube(tmp_path, revoked, NOW)
        assert [g.number for g in secret.generations] == numbers
        assert not list(tmp_path.glob(f"tube-{revoked}.*"))
    assert (secret.revoked, read_secret(tmp_path).revoked) == (frozenset({2, 3}), frozenset({2, 3}))
    assert [g.number for g in rotate_keys(tmp_path, NOW).generations] == [3, 4]
    assert list(tmp_path.glob("tube-1.*"))


# keys


def ring(*numbers: int, revoked: frozenset[int] = frozenset()) -> KeyRing:
    made = tuple(Generation(n, keys_of(bytes([n]) * 32, BASE), NOW) for n in numbers)
    return KeyRing("rig-1", BASE, made, revoked)


@pytest.mark.parametrize(
    ("others", "common"), [(0, 4), (3, 4), (4, 4), (5, 4), (6, 6), (7, 6), (8, 8), (9, 8), (255, 8)]
)
def test_the_newest_keys_that_both_have_are_those_up_to_the_others_newest(others: int, common: int) -> None:
    assert ring(4, 6, 8).common(others) == common
    assert ring(4, 6, 8).block_key(3, others) == ring(common).block_key(3)


@pytest.mark.parametrize("purpose", ["end", "joint", "block"])
def test_of_a_revoked_tube_there_is_no_key_of_any_purpose(purpose: str) -> None:
    for tube, is_there in ((3, False), (4, True)):
        one = ring(4, 6, revoked=frozenset({3}))
        found = one.block_key(tube) if purpose == "block" else one.seal_key(6, purpose, tube)
        assert (found is not None) == is_there


MOMENT = datetime.timedelta(seconds=1)
MONTH = datetime.timedelta(days=30)


@pytest.mark.parametrize(
    ("at", "told"),
    [
        ("begin-1", "which is in the future"), ("begin", ""), ("month-1", ""), ("month", "ends in 30 days"),
        ("month+1", "ends in 29 days"), ("end-1", "ends in 0 days"), ("end", "has ended"), ("end+1", "has ended"),
    ],
)  # fmt: skip
def test_a_certificate_is_warned_of_from_exactly_a_month_before_its_end(tmp_path: Path, at: str, told: str) -> None:
    make_authority(tmp_path, "rig-1", NOW)
    make_certificate(tmp_path, "base", NOW, datetime.timedelta(days=100))
    end = NOW + datetime.timedelta(days=100)
    places = {"begin": NOW - datetime.timedelta(days=1), "month": end - MONTH, "end": end}
    name = at.rstrip("+-1")
    now = places[name] + (MOMENT if at.endswith("+1") else -MOMENT if at.endswith("-1") else datetime.timedelta(0))
    found = certificate_trouble(tmp_path / "base.pem", now)
    assert told in found
    assert bool(found) == bool(told)


# the doors of the page


@pytest.mark.parametrize(
    ("kept", "role", "name", "holder"),
    [
        ({"driller"}, "driller", "anna", "driller"), ({"driller"}, "operator", "anna", None),
        ({"driller", "driller/anna"}, "driller", "anna", "driller/anna"),
        ({"driller", "driller/anna"}, "driller", "ben", "driller"), ({"driller/anna"}, "driller", "ben", None),
        # who has a password of her own comes in with that alone, whatever the role
        ({"driller", "operator/anna"}, "driller", "anna", None),
        ({"driller", "operator/anna"}, "operator", "anna", "operator/anna"),
        ({"driller"}, "driller", "", "driller"),
    ],
)  # fmt: skip
def test_a_name_with_a_password_of_its_own_comes_in_with_that_alone(
    kept: set[str], role: str, name: str, holder: str | None
) -> None:
    assert find_holder(dict.fromkeys(kept, "hash"), role, name) == holder


def test_passwords_are_those_of_the_file_as_it_is_now_and_of_a_bad_one_there_are_none(tmp_path: Path) -> None:
    path = tmp_path / "passwords"

    def write(text: str, at: int) -> None:
        path.touch(0o600)
        path.write_text(text)
        os.utime(path, ns=(at, at))

    write(text_of({"driller": "$argon2id$a"}), 5_000_000_000)
    book = PasswordBook({"driller": "$argon2id$a"}, path)
    assert book.current() == {"driller": "$argon2id$a"}
    write(text_of({"driller": "$argon2id$b"}), 5_000_000_001)  # as long, a billionth of a second later
    assert book.current() == {"driller": "$argon2id$b"}
    write("nonsense", 6_000_000_000)
    assert book.current() == {}
    assert "line 1" in book.fault
    write(text_of({"driller": "$argon2id$c"}), 7_000_000_000)
    assert (book.current(), book.fault) == ({"driller": "$argon2id$c"}, "")
    path.unlink()
    assert book.current() == {}
    assert book.fault


def test_a_session_ends_at_exactly_its_time() -> None:
    sessions = Sessions()
    session = sessions.begin("driller", "anna", 100.0)
    assert sessions.find(session.token, session.ends_at - 1e-6) == session
    assert sessions.find(session.token, session.ends_at) is None
    assert sessions.find(session.token, 100.0) is None


def test_a_name_is_known_where_it_has_signed_in_and_nowhere_else_and_the_newest_places_are_remembered() -> None:
    wrong = WrongPasswords()
    for number in range(REMEMBERED + 2):
        wrong.forgive(f"a{number}", "anna")
    wrong.add("elsewhere", 1000.0, "anna")
    free = [name for name in ("a0", "a1", "a2", f"a{REMEMBERED + 1}") if wrong.hold_of(name, 1000.0, "anna") == 0.0]
    assert free == ["a2", f"a{REMEMBERED + 1}"]
    assert wrong.hold_of("new", 1000.0, "anna") == 1.0
    assert wrong.hold_of("new", 1000.0, "ben") == 0.0


def request(body: bytes = b"", **headers: str) -> Request:
    sent = [(name.replace("_", "-").encode(), value.encode()) for name, value in headers.items()]

    async def receive() -> dict[str, Any]:
        return {"type": "http.request", "body": body, "more_body": False}

    scope = {
        "type": "http", "method": "POST", "path": "/", "query_string": b"", "scheme": "http", "server": ("h", 80),
        "headers": [(b"host", b"h:80"), *sent],
    }  # fmt: skip
    return Request(scope, receive)


@pytest.mark.parametrize(
    ("headers", "is_taken"),
    [
        ({}, True), ({"origin": "http://h:80"}, True), ({"origin": "http://other"}, False), ({"origin": "null"}, False),
        ({"origin": "https://h:80"}, False), ({"sec_fetch_site": "same-origin"}, True),
        ({"sec_fetch_site": "none"}, True), ({"sec_fetch_site": "same-site"}, False),
        ({"sec_fetch_site": "cross-site"}, False),
        ({"origin": "http://h:80", "sec_fetch_site": "cross-site"}, False),
    ],
)  # fmt: skip
def test_a_request_of_another_page_is_refused_however_near_it_is(headers: dict[str, str], is_taken: bool) -> None:
    with contextlib.nullcontext() if is_taken else pytest.raises(RequestError, match="expected a request of the page"):
        check_origin(request(**headers))


@pytest.mark.parametrize(
    ("size", "is_taken"), [(LARGEST_BODY - 1, True), (LARGEST_BODY, True), (LARGEST_BODY + 1, False)]
)
def test_a_body_may_be_exactly_so_long(size: int, is_taken: bool) -> None:
    body = b'{"a":"' + b"x" * (size - 8) + b'"}'
    assert len(body) == size
    with contextlib.nullcontext() if is_taken else pytest.raises(RequestError, match="at most 16384 bytes"):
        assert asyncio.run(json_body(request(body, content_type="application/json; charset=utf-8")))


@pytest.mark.parametrize(
    ("text", "is_taken"), [("", False), ("x", True), (5 * "x", True), (6 * "x", False), (7, False)]
)
def test_a_text_of_a_body_may_be_exactly_so_long(text: object, is_taken: bool) -> None:
    with contextlib.nullcontext() if is_taken else pytest.raises(RequestError, match="1 to 5 characters"):
        assert text_of_body({"a": text}, "a", 5) == text


# the lease


def test_a_token_that_its_router_does_not_know_any_more_confirms_nothing() -> None:
    """The session answers for its own token; the router must know it, too."""
    bus = MadeBus()
    lease = bus.lease()
    bus.is_known = False
    bus.now += 5.0
    lease.confirm()
    assert lease.trouble == ""  # for as long as a lease lasts
    bus.now += 0.1
    assert "has not confirmed" in lease.trouble
    bus.others, bus.is_known = [beside(bus, -5)], True  # known again, and another one is in its right
    lease.confirm()
    assert lease.is_lost


# what is kept
