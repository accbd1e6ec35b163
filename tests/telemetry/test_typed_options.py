"""A command takes objects made of its options, in the order of its help."""

from dataclasses import dataclass

import click
from click.testing import CliRunner

from telemetry.runtime.typed_options import gather_options


@dataclass(frozen=True)
class Ground:
    declination: float
    gravity: float = 9.81


@dataclass(frozen=True)
class Frame:
    north: str
    declination: float


@dataclass(frozen=True)
class Well:
    ground: Ground
    page: str
    depth: float = 3.0


def length_of(page: str) -> int:
    return len(page)


@click.command()
@gather_options(
    click.option("--north", default="true"),
    click.option("--declination", type=float, default=0.5),
    click.option("--page", default="here"),
    click.option("--json", "as_json", is_flag=True),
    ground=Ground,
    frame=Frame,
    well=Well,
    page=length_of,
)
def command(**given: object) -> None:
    click.echo(repr(sorted(given.items())))


def output(*words: str) -> str:
    done = CliRunner().invoke(command, list(words), catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done.output.strip()


def test_objects_take_their_options_share_some_and_stand_in_one_another() -> None:
    ground = Ground(0.25)
    expected = {
        "as_json": True,
        "frame": Frame("true", 0.25),
        "page": 4,
        "well": Well(ground, "here"),
    }
    assert output("--declination", "0.25", "--json") == repr(sorted(expected.items()))


def test_an_object_may_bear_the_name_of_an_option_that_others_take() -> None:
    assert "('page', 9)" in output("--page", "elsewhere")
    assert "page='elsewhere'" in output("--page", "elsewhere")


def test_help_lists_options_in_the_order_in_which_they_are_given() -> None:
    shown = output("--help")
    places = [shown.index(name) for name in ("--north", "--declination", "--page", "--json")]
    assert places == sorted(places)
