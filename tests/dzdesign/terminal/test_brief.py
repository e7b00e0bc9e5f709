"""One screen: what identify and design print fits 80 columns and 24 lines; `explain` has the rest of a code."""

from dataclasses import replace

import pytest

from dzdesign import api
from dzdesign.command_line.cli import main
from dzdesign.identify.data_quality.catalogue import catalogue
from dzdesign.identify.valve.model import Warning_
from dzdesign.terminal import brief
from dzdesign.terminal.progress import reporting
from dzdesign.verify import requirements
from tests.support.designs import designed
from tests.support.synthetic import needs_compiler


@pytest.fixture
def screen(monkeypatch, capsys):
    """What a terminal of 80 columns shows of a printer."""
    from rich.console import Console

    terminal = Console(highlight=False, width=80, force_terminal=True, color_system=None)
    monkeypatch.setattr(brief, "new_console", lambda: terminal)

    def shown(printer, result):
        printer(result)
        return [line.rstrip() for line in capsys.readouterr().out.splitlines()]

    return shown


#: Lines that the command prints below: where it was written, and what comes next.
BELOW = 2


@pytest.mark.parametrize("sides", [1, 2])
def test_a_valve_and_a_design_fit_one_screen(sides, example_valve, screen):
    side = example_valve.positive
    valve = example_valve if sides == 1 else replace(example_valve, sides={"positive": side, "negative": side})
    made = designed(valve, **({} if sides == 1 else {"command_signal": "-10..10 V x 0.12 + 1.5 V"}))
    # The example has six pressure drops; of two sides twelve take two rows more than there are.
    for printer, result, more in ((brief.print_valve, valve, 2 * (sides - 1)), (brief.print_design, made, 0)):
        lines = screen(printer, result)
        assert len(lines) + BELOW <= 24 + more, "\n".join(lines)
        assert max(map(len, lines)) <= 80


def test_a_warning_of_both_sides_stands_once_and_many_share_the_last_line():
    twice = [Warning_(code="few-repeats", text="a text " * 30, source=name) for name in ("a.csv", "b.csv")]
    (line,) = brief.warning_lines(twice)
    assert "(2)" in line and line.endswith("...") and len(line) <= 80
    *first, last = brief.warning_lines([*twice, *(Warning_(code=code, text="a text", source=None) for code in "abcd")])
    assert [line.split()[1] for line in first] == ["[few-repeats]", "[a]", "[b]"]
    assert last == "further warnings: c, d"


@needs_compiler
@pytest.mark.slow
def test_a_verification_fits_one_screen_and_says_what_does_not_hold(example_folder, tmp_path, screen):
    valve = api.identify(example_folder / "ramps" / "ramp_dP[135]_1.csv.gz", meter_lag="0.1 s", curve="line")
    api.generate(api.design(valve), target="host", output=tmp_path / "firmware")
    found = api.verify(tmp_path / "firmware")
    lines = screen(brief.print_result, found)
    assert len(lines) + BELOW <= 24 and max(map(len, lines)) <= 80
    assert any("27" in line and "0 wrong" in line for line in lines)
    (tmp_path / "firmware" / "core" / "dz_drive.c").unlink()
    lines = screen(brief.print_result, api.verify(tmp_path / "firmware"))
    assert any(line.startswith("DOES NOT HOLD") for line in lines)


def test_verbose_prints_everything(example_valve, screen, capsys):
    with reporting(quiet=False, verbose=True):
        brief.print_valve(example_valve)
        brief.print_design(designed(example_valve))
    full = capsys.readouterr().out
    assert "trend with dP" in full and "rounding and the beta table" in full


@pytest.mark.parametrize("code", ["few-repeats", "[onset-hidden]", "over-compensation"])
def test_a_code_is_explained(code, capsys):
    assert main(["explain", code]) == 0
    assert len(capsys.readouterr().out) > 40


def test_every_code_has_an_explanation_without_a_link_and_another_is_refused(capsys):
    known = [each.id for each in vars(requirements).values() if isinstance(each, requirements.Requirement)]
    for code in (*catalogue(), *known):
        assert main(["explain", code]) == 0
        assert "](" not in capsys.readouterr().out, code
    assert main(["explain", "onset-hiden"]) == 2
    assert "did you mean 'onset-hidden'" in capsys.readouterr().err
