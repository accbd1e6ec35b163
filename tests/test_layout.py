"""The repository against its own promises."""

import importlib
import re
import tomllib
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement

ROOT = Path(__file__).parents[1]
PACKAGES = ("borechain", "node", "groundstation", "telemetry", "sim")


@pytest.mark.parametrize("name", PACKAGES)
def test_packages_come_from_this_checkout(name: str) -> None:
    assert Path(str(importlib.import_module(name).__file__)).parent == ROOT / name


def test_the_lock_holds_every_dependency_with_a_hash_and_no_address() -> None:
    lock = (ROOT / "requirements.lock").read_text()
    assert "://" not in lock
    pinned = set(re.findall(r"^([a-z0-9-]+)==", lock, re.MULTILINE))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    named = [*project["dependencies"], *(d for extra in project["optional-dependencies"].values() for d in extra)]
    assert {re.split(r"[\[><=]", d)[0].lower() for d in named} <= pinned
    assert lock.count("--hash=sha256:") >= len(pinned)


def named_with(asked: list[str], extra: str, found: dict[str, set[str]]) -> dict[str, set[str]]:
    """Names of the distributions that these requirements need, each with the extras that it is needed with."""
    for text in asked:
        needed = Requirement(text)
        if needed.marker is not None and not needed.marker.evaluate({"extra": extra}):
            continue
        extras = found.setdefault(re.sub(r"[-_.]+", "-", needed.name.lower()), set())
        for inner in {"", *needed.extras} - extras:
            extras.add(inner)
            named_with(metadata.requires(needed.name) or [], inner, found)
    return found


def test_a_rig_is_set_up_with_all_that_its_extras_need_and_nothing_else() -> None:
    """The list of ``make rig`` is that of ``make lock``, which a lock without it would leave behind."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    needed = named_with([*project["dependencies"], *extras["ground"], *extras["build"]], "", {}).keys()
    assert (ROOT / "deploy" / "rig-packages.txt").read_text().split() == sorted(needed)
    lock = (ROOT / "requirements.lock").read_text()
    assert needed <= set(re.findall(r"^([a-z0-9-]+)==", lock, re.MULTILINE))


def test_documented_keys_are_the_table_of_the_code() -> None:
    from groundstation.service.answers.answer_table import known_keys

    text = (ROOT / "docs" / "keys.md").read_text()
    documented = re.findall(r"^\| `(borechain/[^`]+)` \| ([^|]+) \| ([^|]+) \|$", text, re.MULTILINE)
    assert documented == [(key.template, key.kind, key.meaning) for key in known_keys()]


def test_every_equation_named_in_a_kernel_is_in_the_document() -> None:
    text = (ROOT / "docs" / "equations.md").read_text()
    listed = set(re.findall(r"`((?:node\.kernels|groundstation\.survey|sim\.studies)\.[a-z0-9_.]+)`", text))
    for name in listed:
        module, _, function = name.rpartition(".")
        assert hasattr(importlib.import_module(module), function), name
    assert {
        "node.kernels.filter.float64.strapdown.yaw_rate",
        "node.kernels.filter.float64.propagation.propagate_covariance",
        "node.kernels.filter.float64.update.joseph_update",
    } <= listed


def test_the_readme_has_the_two_commands() -> None:
    text = (ROOT / "README.md").read_text()
    assert "make rig" in text
    assert "make test" in text
