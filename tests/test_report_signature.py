"""Reports that are signed: who signed is told, every changed byte too, and another program agrees."""

from __future__ import annotations

import datetime
import random
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest
from click.testing import CliRunner, Result
from cryptography import x509

from borechain.cli.pki.pki import pki
from borechain.pki.pdf_revisions import SignedFileError, signed_revisions
from borechain.pki.report_signature import sign_report, verify_report
from borechain.pki.rig_keys import add_person, init_rig
from groundstation.report.document import Document, Origin, ReportSection, report_pdf
from telemetry.errors import KeyFileError

NOW = datetime.datetime(2026, 11, 27, 11, 0, 0, tzinfo=datetime.UTC)
PAPER = Document(
    "Column report", "Column K021", "Station square", "Column K021 is within tolerance", True, [("Project", "lot 3")],
    [ReportSection("Stations", rows=[("0.00", "0.1")], columns=("MD m", "incl. deg"))],
    Origin(NOW.date(), "1.2.3", [("SHA-256 of wall.toml", "ab" * 32)]),
)  # fmt: skip


class Signed(NamedTuple):
    """A folder of keys, a report, and the report signed by one and by two persons."""

    folder: Path
    plain: bytes
    once: bytes
    twice: bytes


@pytest.fixture(scope="module")
def signed(tmp_path_factory: pytest.TempPathFactory) -> Signed:
    folder = tmp_path_factory.mktemp("stick") / "keys"
    folder.mkdir()
    init_rig(folder, "rig-1", NOW)
    add_person(folder, "anna", "driller", NOW)
    plain = report_pdf(PAPER)
    once = sign_report(plain, folder / "anna.pem", NOW)
    return Signed(folder, plain, once, sign_report(once, folder / "operator.pem", NOW + datetime.timedelta(days=1)))


def verify(signed: Signed, content: bytes) -> list[str]:
    return [signer.name for signer in verify_report(content, signed.folder / "ca.pem")]


def test_who_signed_when_is_told(signed: Signed) -> None:
    (anna,) = verify_report(signed.once, signed.folder / "ca.pem")
    assert (anna.name, anna.at) == ("anna", NOW)
    assert verify(signed, signed.twice) == ["anna", "operator"]
    assert signed.once.startswith(signed.plain)
    assert signed.twice.startswith(signed.once)


def test_the_newest_catalog_lists_every_signature(signed: Signed) -> None:
    """Other programs look there for the fields of signatures, and see those alone."""
    listed = [re.findall(rb"(\d+) 0 R", fields) for fields in re.findall(rb"/Fields\[([^\]]*)\]", signed.twice)]
    assert [len(fields) for fields in listed] == [1, 2]
    assert listed[0][0] == listed[1][0]
    for field in listed[1]:
        assert re.search(rb"\n%b 0 obj\n<</FT/Sig/" % field, signed.twice)


def test_every_byte_that_is_changed_is_told(signed: Signed) -> None:
    """All of what the signatures appended, and a sample of the report itself, a bit at a time."""
    lot = random.Random(7)
    appended = range(len(signed.plain), len(signed.twice))
    for place in (*appended, *lot.sample(range(len(signed.plain)), 1000)):
        changed = bytearray(signed.twice)
        changed[place] ^= 1 << lot.randrange(8)
        with pytest.raises(SignedFileError):
            verify(signed, bytes(changed))


def test_a_certificate_whose_number_was_changed_to_one_below_zero_is_no_signature(signed: Signed) -> None:
    """Which bit that is depends on the number, so the bytes above meet it in some runs and not in others."""
    number = verify_report(signed.once, signed.folder / "ca.pem")[0].serial
    written = number.to_bytes(number.bit_length() // 8 + 1, "big")
    negative = bytes([written[0] | 0x80]) + written[1:]
    changed = signed.once.replace(written.hex().encode(), negative.hex().encode(), 1)
    assert changed != signed.once
    with pytest.raises(SignedFileError, match="it was changed: signature 1, anna, is no signature"):
        verify(signed, changed)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda s: s.plain, "expected a signed report, got one without a signature"),
        (lambda s: s.once + b"\n", "it was changed: 1 bytes were appended after the signatures"),
        (lambda s: s.once + s.once[len(s.plain) :], "it was changed"),
        (lambda s: s.once[:-2], "it was changed"),
        (lambda s: s.once.replace(b"/Name(anna)", b"/Name(otto)"), "it was changed"),
        (lambda s: s.once.replace(b"/M(D:2026", b"/M(D:2027"), "it was changed"),
        (lambda s: s.twice.replace(s.twice[len(s.plain) : len(s.once)], b""), "expected a report as this program"),
        (lambda s: b"", "without a signature"),
    ],
)
def test_what_was_done_to_a_report_is_told(signed: Signed, change: Callable[[Signed], bytes], told: str) -> None:
    with pytest.raises(SignedFileError, match=told):
        verify(signed, change(signed))


def test_a_signature_of_another_report_is_none(signed: Signed) -> None:
    other = sign_report(signed.plain, signed.folder / "anna.pem", NOW + datetime.timedelta(seconds=1))
    mine, theirs = (content.split(b"/Contents<")[1].split(b">")[0] for content in (signed.once, other))
    mixed = signed.once.replace(mine, theirs)
    with pytest.raises(SignedFileError, match="it was changed"):
        verify(signed, mixed)


def test_a_stranger_is_no_signer(signed: Signed, tmp_path: Path) -> None:
    init_rig(tmp_path, "rig-2", NOW)
    add_person(tmp_path, "anna", "driller", NOW)
    forged = sign_report(signed.plain, tmp_path / "anna.pem", NOW)
    assert [signer.name for signer in verify_report(forged, tmp_path / "ca.pem")] == ["anna"]
    with pytest.raises(SignedFileError, match="signature 1, anna: its certificate is not of this authority, borechain"):
        verify(signed, forged)


@pytest.mark.parametrize(
    ("days", "name", "told"),
    [
        (0, "none", "none.pem: No such file or directory; expected a .pem file of borechain pki"),
        (200, "anna", "it is good from 2026-11-26 to 2027-05-29, not at 2027-06-15 11:00"),
        (-2, "anna", "it is good from"),
    ],
)
def test_a_certificate_that_is_not_good_signs_nothing(signed: Signed, days: int, name: str, told: str) -> None:
    with pytest.raises(KeyFileError, match=told):
        sign_report(signed.plain, signed.folder / f"{name}.pem", NOW + datetime.timedelta(days=days))


def test_a_key_of_another_and_a_file_that_is_no_report_sign_nothing(signed: Signed, tmp_path: Path) -> None:
    for name, of in (("mixed.pem", "anna.pem"), ("mixed.key", "driller.key")):
        shutil.copy(signed.folder / of, tmp_path / name)
    with pytest.raises(KeyFileError, match=r"mixed\.pem: expected that of mixed\.key"):
        sign_report(signed.plain, tmp_path / "mixed.pem", NOW)
    for content in (b"", b"text", b"%PDF-1.7\nstartxref\n9\n%%EOF\n", signed.plain[:-20], signed.once + b"%"):
        with pytest.raises(SignedFileError):
            sign_report(content, signed.folder / "anna.pem", NOW)


def test_another_program_verifies_the_signature(signed: Signed, tmp_path: Path) -> None:
    """OpenSSL: the range of bytes that the file names, against the authority; and not with a byte changed."""
    if (openssl := shutil.which("openssl")) is None:
        pytest.skip("no openssl on this machine")
    (one,) = signed_revisions(signed.once)
    words = signed.once.split(b"/ByteRange[")[1].split(b"]")[0].split()
    first, second, length = map(int, words[1:])
    content = signed.once[:first] + signed.once[second : second + length]
    assert second + length == len(signed.once)
    assert signed.once[first : first + 1] + signed.once[second - 1 : second] == b"<>"
    (tmp_path / "s.der").write_bytes(one.signature)
    command = [
        openssl,
        "cms",
        "-verify",
        "-inform",
        "DER",
        "-in",
        "s.der",
        "-content",
        "c",
        "-binary",
        "-purpose",
        "any",
    ]
    command += ["-CAfile", str(signed.folder / "ca.pem"), "-out", "o", "-attime", str(int(NOW.timestamp()))]
    for text, is_good in ((content, True), (content.replace(b"anna", b"otto"), False)):
        (tmp_path / "c").write_bytes(text)
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, check=False)
        assert (done.returncode == 0) is is_good, done.stderr


def test_a_persons_certificate_is_good_for_signing_what_is_read(signed: Signed) -> None:
    """Readers of PDF trust no other: its key commits to contents; that of the router and the authority does not."""
    for name, commits in (("anna", True), ("operator", True), ("router", False), ("ca", False)):
        certificate = x509.load_pem_x509_certificate((signed.folder / f"{name}.pem").read_bytes())
        usage = certificate.extensions.get_extension_for_class(x509.KeyUsage)
        assert (usage.critical, usage.value.digital_signature, usage.value.content_commitment) == (True, True, commits)


PYHANKO = """
import sys
from pyhanko.keys import load_cert_from_pemder
from pyhanko.pdf_utils.reader import PdfFileReader
from pyhanko.sign.validation import validate_pdf_signature
from pyhanko_certvalidator import ValidationContext

context = ValidationContext(trust_roots=[load_cert_from_pemder(sys.argv[2])], allow_fetching=False)
for one in PdfFileReader(open(sys.argv[1], "rb")).embedded_signatures:
    found = validate_pdf_signature(one, context)
    print(one.field_name, found.trusted, found.bottom_line)
"""


@pytest.mark.install
@pytest.mark.statistical
def test_a_library_of_pdf_signatures_trusts_the_authority_and_no_other(tmp_path: Path) -> None:
    """pyHanko with an environment of its own: trusted with our authority as its root, and not with another."""
    now = datetime.datetime.now(datetime.UTC).replace(microsecond=0)
    for rig in ("rig-1", "rig-2"):
        (tmp_path / rig).mkdir()
        init_rig(tmp_path / rig, rig, now)
    python = tmp_path / "hanko" / "bin" / "python"
    subprocess.run([sys.executable, "-m", "venv", tmp_path / "hanko"], check=True)
    subprocess.run([python, "-m", "pip", "install", "--quiet", "pyhanko>=0.29"], check=True, capture_output=True)
    once = sign_report(report_pdf(PAPER), tmp_path / "rig-1" / "driller.pem", now)
    report = tmp_path / "report.pdf"
    report.write_bytes(sign_report(once, tmp_path / "rig-1" / "operator.pem", now))
    for rig, trusted in (("rig-1", "True True"), ("rig-2", "False False")):
        command = [python, "-c", PYHANKO, report, tmp_path / rig / "ca.pem"]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        assert done.stdout.splitlines() == [f"Signature{number} {trusted}" for number in (1, 2)]


def run(*words: object) -> Result:
    return CliRunner().invoke(pki, [*map(str, words)])


def test_the_commands_sign_and_verify(signed: Signed, tmp_path: Path) -> None:
    report, authority = tmp_path / "K021.pdf", signed.folder / "ca.pem"
    now = datetime.datetime.now(datetime.UTC)
    init_rig(tmp_path / "now", "rig-1", now)
    add_person(tmp_path / "now", "anna", "driller", now)
    report.write_bytes(signed.plain)
    assert run("verify", report, "--authority", authority).exit_code == 3
    done = run("sign", report, "--certificate", tmp_path / "now" / "anna.pem")
    assert (done.exit_code, done.output) == (0, f"{report}: signed by anna\n")
    found = run("verify", report, "--authority", tmp_path / "now" / "ca.pem")
    assert (found.exit_code, f"{report}: signed by anna at {now:%Y-%m-%d}" in found.output) == (0, True)
    foreign = run("verify", report, "--authority", authority)
    assert (foreign.exit_code, "NOT GOOD: signature 1, anna: its certificate is not" in foreign.stderr) == (3, True)
    content = bytearray(report.read_bytes())
    content[300] ^= 1
    report.write_bytes(content)
    changed = run("verify", report, "--authority", tmp_path / "now" / "ca.pem")
    assert (changed.exit_code, "it was changed after signature 1, anna, signed it" in changed.stderr) == (3, True)
    for words in (
        ("verify", tmp_path / "none.pdf", "--authority", authority),
        ("verify", report, "--authority", report),
    ):
        assert run(*words).exit_code == 2
    assert run("sign", authority, "--certificate", tmp_path / "now" / "anna.pem").exit_code == 2
