"""The folder of a rig's keys, from the command line and from beside it."""

from __future__ import annotations

import datetime
import os
import stat
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from cryptography import x509
from sealed_string import NOW, make_folder

from borechain.cli.pki.pki import pki
from borechain.pki.access import read_access
from borechain.pki.rig_keys import add_tube, init_rig, read_secret, revoke_tube, rotate_keys, tubes_of
from groundstation.gateway.page.passwords import is_right, read_passwords
from telemetry.application.seals import Keys, seals_of
from telemetry.errors import KeyFileError
from telemetry.media.credentials import DEPTH_SOURCE, credentials_for, credentials_of, file_name, needs_tls
from telemetry.messages import BASE, ENCODER, Side
from telemetry.transport.certificate_dates import certificate_trouble
from telemetry.transport.key_ring import key_file, read_ring

SECRETS = (".keys", ".key", ".secret")


def run(folder: Path, *words: str) -> Result:
    return CliRunner().invoke(pki, [words[0], *words[1:], "--folder", str(folder)])


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return make_folder(tmp_path / "stick")


def test_a_rig_is_made_a_tube_is_added_revoked_and_all_keys_are_changed(tmp_path: Path) -> None:
    stick = tmp_path / "stick"
    assert run(stick, "init", "--rig", "rig-7", "--tubes", "1").exit_code == 0
    assert run(stick, "tube", "7").output == f"{stick / 'tube-7.keys'}\n"
    assert tubes_of(stick) == [1, 7]
    assert "generation 2 is in every other file" in run(stick, "revoke", "1").output
    assert tubes_of(stick) == [7]
    assert not list(stick.glob("tube-1.*"))
    assert "generation 2 is valid until" in run(stick, "rotate").output
    secret = read_secret(stick)
    assert (secret.rig, [g.number for g in secret.generations], secret.revoked) == ("rig-7", [2, 3], {1})
    ring = read_ring(stick / "tube-7.keys", 7)
    assert ([g.number for g in ring.generations], ring.revoked) == ([2, 3], {1})
    assert ring.seal_key(3, "joint", 1) is None


def test_what_is_secret_is_for_its_owner_alone_and_never_printed(tmp_path: Path) -> None:
    stick = tmp_path / "stick"
    said = "".join(run(stick, *words).output for words in (("init",), ("tube", "3"), ("rotate",), ("revoke", "3")))
    secrets = [path for path in stick.iterdir() if path.suffix in SECRETS]
    assert {"rig.secret", "ca.key", "base.keys", "router.key"} <= {path.name for path in secrets}
    assert all(stat.S_IMODE(path.stat().st_mode) == 0o600 for path in secrets)
    assert stat.S_IMODE(stick.stat().st_mode) == 0o700
    keys = [line.split('"')[-2] for path in secrets for line in path.read_text().splitlines() if line.endswith('"')]
    assert not any(key in said for key in keys if len(key) >= 32)


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("init",), "expected a folder without keys"),
        (("tube", "0"), "expected 1..250, got 0"),
        (("tube", "251"), "expected 1..250, got 251"),
        (("revoke", "400"), "expected 1..250, got 400"),
        (("tube", "2"), "its keys were revoked"),
    ],
)
def test_what_cannot_be_is_refused_in_words(folder: Path, words: tuple[str, ...], named: str) -> None:
    revoke_tube(folder, 2, NOW)
    done = run(folder, *words)
    assert done.exit_code == 2
    assert named in done.output
    assert "Traceback" not in done.output


def test_a_folder_with_keys_is_left_alone_where_that_is_asked_for(folder: Path) -> None:
    before = (folder / "rig.secret").read_text()
    assert run(folder, "init", "--if-new").exit_code == 0
    assert (folder / "rig.secret").read_text() == before
    assert run(folder.parent / "none", "tube", "1").exit_code == 2


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o644, 0o660, 0o610])
@pytest.mark.parametrize("name", ["tube-1.keys", "rig.secret"])
def test_a_key_file_that_others_may_read_is_refused(folder: Path, name: str, mode: int) -> None:
    (folder / name).chmod(mode)
    with pytest.raises(KeyFileError, match=f"expected permissions 0600, got {mode:04o}"):
        read_ring(folder / name, 1) if name.endswith(".keys") else read_secret(folder)


@pytest.mark.parametrize(
    "damage",
    [
        lambda text: "",
        lambda text: text[: len(text) // 2],
        lambda text: text.replace("format = 1", "format = 2"),
        lambda text: text.replace('"end.1" = "', '"end.1" = "00'),
        lambda text: text.replace("number = 1", "number = 0"),
        lambda text: text.replace("address = 1", "address = 300"),
        lambda text: text.replace("+00:00", ""),
        lambda text: "[[generation]]\n" * 3,
        lambda text: "not a key file",
    ],
)
def test_a_key_file_that_is_damaged_is_refused_and_not_repeated(folder: Path, damage: object) -> None:
    path = folder / "tube-1.keys"
    text = path.read_text()
    path.write_text(damage(text))  # type: ignore[operator]
    with pytest.raises(KeyFileError, match="expected keys as borechain pki writes them") as refusal:
        read_ring(path, 1)
    assert not any(len(word) > 30 and word in text for word in str(refusal.value).split('"'))
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(KeyFileError, match="not text"):
        read_ring(path, 1)


def test_keys_of_another_process_or_of_nobody_are_refused(folder: Path) -> None:
    with pytest.raises(KeyFileError, match="expected keys of tube-2, got those of tube-1"):
        seals_of(folder / "tube-1.keys", 2, Side)
    with pytest.raises(KeyFileError, match=r"tube-9\.keys: No such file"):
        seals_of(folder, 9, Side)
    with pytest.raises(KeyFileError, match="expected keys of rig-2, got those of rig-1"):
        seals_of(folder, 1, Side, rig="rig-2")
    with pytest.raises(KeyFileError, match="a reach of 2"):
        seals_of(folder, 1, Side, reach=2)
    assert seals_of(None, 1, Side) is None


def test_a_clock_that_is_wrong_warns_and_stops_nobody(folder: Path) -> None:
    ring = read_ring(folder / "tube-1.keys", 1, NOW - datetime.timedelta(days=3))
    assert len(ring.warnings) == 1
    assert "which is in the future" in ring.warnings[0]
    assert ring.newest == 1
    assert read_ring(folder / "tube-1.keys", 1, NOW).warnings == ()


def test_the_keys_of_before_are_warned_of_after_a_day_and_end_when_the_crew_says_so(folder: Path) -> None:
    rotate_keys(folder, NOW)
    path, day = folder / "tube-1.keys", datetime.timedelta(days=1)
    rings = [read_ring(path, 1, NOW + k * day / 2) for k in (0, 1, 3, 10_000)]
    assert [[g.number for g in ring.generations] for ring in rings] == [[1, 2]] * 4
    assert [len(ring.warnings) for ring in rings] == [0, 0, 1, 1]
    assert "generation 1 was valid until 2026-05-05 06:00 UTC" in rings[2].warnings[0]
    rotate_keys(folder, NOW)
    assert [g.number for g in read_ring(path, 1, NOW).generations] == [2, 3]
    assert run(folder, "retire").output == f"generation 3 alone is in every file of {folder}\n"
    assert [g.number for g in read_ring(path, 1, NOW + 9 * day).generations] == [3]
    assert read_ring(path, 1, NOW + 9 * day).warnings == ()


def test_a_key_file_that_changes_badly_while_its_process_runs_is_told_and_not_used(folder: Path) -> None:
    path = key_file(folder, 1)
    keys = Keys(path, 1)
    text = path.read_text()
    assert not keys.refresh()
    path.write_text("damaged")
    assert not keys.refresh()
    assert "expected keys" in keys.fault
    assert keys.ring.newest == 1
    path.write_text(text + "# touched\n")
    os.utime(path, ns=(1, 1))
    assert keys.refresh()
    assert keys.fault == ""


def test_each_process_is_given_what_it_needs_and_nothing_else(folder: Path) -> None:
    names = {
        address: set(read_ring(key_file(folder, address), address).generations[0].keys)
        for address in (1, 2, ENCODER, BASE, DEPTH_SOURCE)
    }
    assert names[DEPTH_SOURCE] == {("depth", 0)}
    assert {name for name in names[1] if name[0] in ("end", "block")} == {("end", 1), ("block", 1)}
    assert {other for purpose, other in names[1] if purpose == "joint"} == set(range(252)) - {1}
    assert ("depth", 0) not in names[1] | names[ENCODER]
    assert {("end", 1), ("end", 2), ("end", ENCODER), ("depth", 0)} <= names[BASE]
    assert ("block", ENCODER) not in names[ENCODER]


def test_both_ends_of_a_joint_and_both_ends_of_a_string_have_the_same_key(folder: Path) -> None:
    rings = {address: read_ring(key_file(folder, address), address) for address in (1, 2, ENCODER, BASE)}

    def raw(address: int, purpose: str, other: int) -> bytes:
        return rings[address].generations[0].keys[purpose, other]

    assert raw(1, "joint", 2) == raw(2, "joint", 1) != raw(1, "joint", ENCODER)
    assert raw(1, "end", 1) == raw(BASE, "end", 1) != raw(2, "end", 2)
    assert raw(1, "block", 1) == raw(BASE, "block", 1)
    other = make_folder(folder.parent / "other", 0)
    init_rig(folder.parent / "third", "rig-1", NOW)
    third = read_ring(folder.parent / "third" / "encoder.keys", ENCODER).generations[0]
    assert third.keys["call", 0] != raw(1, "call", 0)
    assert read_secret(other).rig == "rig-1"


def test_certificates_name_their_holder_and_say_what_for(folder: Path) -> None:
    day = datetime.timedelta(days=1)
    for name, purpose, least, most in (
        ("router", "serverAuth", 700, 800),
        ("base", "clientAuth", 700, 800),
        ("tube-1", "clientAuth", 20 * 365, 31 * 365),  # no stick reaches it in the hole
        ("driller", "clientAuth", 150, 200),
    ):
        certificate = x509.load_pem_x509_certificate((folder / f"{name}.pem").read_bytes())
        assert [a.value for a in certificate.subject] == [name]
        (use,) = certificate.extensions.get_extension_for_class(x509.ExtendedKeyUsage).value
        assert use._name == purpose
        certificate.verify_directly_issued_by(x509.load_pem_x509_certificate((folder / "ca.pem").read_bytes()))
        assert least * day < certificate.not_valid_after_utc - NOW < most * day


def let_in(folder: Path) -> dict[str, set[str]]:
    """Messages that each common name may send, as the router's rules say."""
    found = read_access(folder)
    rules = {rule["id"]: rule for rule in found["rules"]}
    names = {one["id"]: one["cert_common_names"] for one in found["subjects"]}
    return {
        name: {
            f"{key} {message}"
            for rule in policy["rules"]
            if "ingress" in rules[rule]["flows"]
            for key in rules[rule]["key_exprs"]
            for message in rules[rule]["messages"]
        }
        for policy in found["policies"]
        for subject in policy["subjects"]
        for name in names[subject]
    }


def common_name_of(path: Path) -> str:
    (name,) = x509.load_pem_x509_certificate(path.read_bytes()).subject
    return str(name.value)


def test_a_person_has_a_certificate_and_rights_of_its_own_until_it_is_revoked_by_name(folder: Path) -> None:
    tubes = {path.name: path.read_bytes() for path in folder.glob("*.keys")}
    assert run(folder, "person", "anna", "--role", "driller").output == f"{folder / 'anna.pem'}\n"
    assert run(folder, "person", "otto", "--role", "operator").exit_code == 0
    rights = let_in(folder)
    assert rights["anna"] == rights["driller"] != rights["otto"] == rights["operator"]
    assert [name for name, may in rights.items() if any("/cmd/" in one and one.endswith(" query") for one in may)] == [
        "driller", "anna",
    ]  # fmt: skip
    assert "take" in run(folder, "revoke", "anna").output
    assert "anna" not in let_in(folder)
    assert set(let_in(folder)) == set(rights) - {"anna"}
    assert not list(folder.glob("anna.*"))
    assert {path.name: path.read_bytes() for path in folder.glob("*.keys")} == tubes  # no tube in the hole is touched


def test_who_comes_back_has_another_name_at_the_router_for_ever(folder: Path) -> None:
    seen = []
    for _ in range(3):
        assert run(folder, "person", "anna", "--role", "driller").exit_code == 0
        seen.append(common_name_of(folder / "anna.pem"))
        assert [name for name in let_in(folder) if name.startswith("anna")] == seen[-1:]
        assert run(folder, "renew", "anna").exit_code == 0
        assert common_name_of(folder / "anna.pem") == seen[-1]
        assert run(folder, "revoke", "anna").exit_code == 0
    assert len(set(seen)) == 3
    rotate_keys(folder, NOW)
    revoke_tube(folder, 1, NOW)
    assert not [name for name in let_in(folder) if name.startswith("anna")]
    assert "expected one of" in run(folder, "renew", "anna").output


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("person", "router", "--role", "driller"), "that no process has"),
        (("person", "tube-3", "--role", "driller"), "that no process has"),
        (("person", "17", "--role", "driller"), "letters"),
        (("person", "an.na", "--role", "driller"), "letters"),
        (("person", "../anna", "--role", "driller"), "letters"),
        (("person", "driller", "--role", "operator"), "expected the role driller that it has"),
        (("revoke", "carla"), "expected a tube's number or one of driller, operator"),
        (("renew", "tube-9"), "expected one of router, medium, base, encoder, depth, tube-1, tube-2"),
    ],
)
def test_a_name_that_cannot_be_is_refused_in_a_line(folder: Path, words: tuple[str, ...], named: str) -> None:
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    done = run(folder, *words)
    assert (done.exit_code, "Traceback" in done.output) == (2, False)
    assert named in " ".join(done.output.split())
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_a_folder_from_before_there_were_persons_is_read_and_its_roles_can_be_revoked(folder: Path) -> None:
    path = folder / "rig.secret"
    path.write_text(path.read_text().partition("\n[[person]]")[0])
    assert run(folder, "revoke", "driller").exit_code == 0
    assert {"operator", "base"} < set(let_in(folder))
    assert "driller" not in let_in(folder)


@pytest.mark.parametrize(
    ("days", "said"),
    [(0, ""), (152, ""), (154, "ends in 29 days"), (182, "ends in 1 days"), (184, "has ended"), (-2, "in the future")],
)
def test_a_certificate_is_told_of_a_month_before_its_end_and_of_tomorrow(folder: Path, days: int, said: str) -> None:
    trouble = certificate_trouble(folder / "driller.pem", NOW + datetime.timedelta(days=days))
    assert said in trouble
    assert bool(trouble) == bool(said)
    assert ("pki renew driller" in trouble) == ("end" in said)
    (folder / "driller.pem").write_text("none")
    assert "expected a certificate" in certificate_trouble(folder / "driller.pem", NOW)


def test_a_revoked_tube_has_no_rights_at_the_router(folder: Path) -> None:
    add_tube(folder, 7, NOW)
    before = {subject["id"] for subject in read_access(folder)["subjects"]}
    revoke_tube(folder, 7, NOW)
    after = {subject["id"] for subject in read_access(folder)["subjects"]}
    assert before - after == {"tube-7"}
    with pytest.raises(KeyFileError, match="expected the access control"):
        read_access(folder.parent)


@pytest.mark.parametrize(
    ("endpoint", "needs"),
    [
        ("tcp/127.0.0.1:7447", False),
        ("tcp/127.8.9.1:7447", False),
        ("tcp/localhost:7447", False),
        ("tcp/[::1]:7447", False),
        ("tls/10.0.0.1:7447", False),
        ("unixsock-stream/a:1", False),
        ("tcp/0.0.0.0:7447", True),
        ("tcp/10.0.0.1:7447", True),
        ("tcp/[::]:7447", True),
        ("tcp/router:7447", True),
        ("udp/192.168.0.2:7447", True),
        ("quic/router:7447", True),
    ],
)
def test_an_endpoint_on_a_network_needs_tls(endpoint: str, needs: bool) -> None:
    assert needs_tls(endpoint) == needs


def test_credentials_are_named_by_what_is_missing(folder: Path) -> None:
    assert credentials_for("tcp/127.0.0.1:1", None, "tube-1") is None
    with pytest.raises(OSError, match="expected --keys with it"):
        credentials_for("tls/127.0.0.1:1", None, "tube-1")
    assert credentials_of(folder / "tube-1.keys", file_name(1)).key == folder / "tube-1.key"
    with pytest.raises(OSError, match=r"tube-9\.pem, which borechain pki makes"):
        credentials_of(folder, "tube-9")


@pytest.mark.slow
def test_a_password_of_the_page_is_kept_as_its_hash_for_its_owner_alone(tmp_path: Path) -> None:
    file = tmp_path / "passwords"
    for role, word in (("driller", "a long enough word"), ("operator", "another long word")):
        done = CliRunner().invoke(pki, ["password", role, "--file", str(file)], input=f"{word}\n")
        assert done.exit_code == 0, done.output
        assert word not in done.output
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    found = read_passwords(file)
    assert sorted(found) == ["driller", "operator"]
    assert is_right("a long enough word", found["driller"])
    short = CliRunner().invoke(pki, ["password", "driller", "--file", str(file)], input="short\n")
    assert (short.exit_code, "expected 8 to 256 characters, got 5" in short.output) == (2, True)
    assert read_passwords(file) == found
