"""What is declared of an option is what its readers and the command line go by."""

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass
from typing import Annotated

import pytest

from dzdesign.core.errors import InputError
from dzdesign.core.option_readers import number, percent_range, quantity, whole_number
from dzdesign.core.options import AnyPath, Option, Paths, Table, Text, arguments_of, paths_of, read_options, texts_of


@dataclass(frozen=True)
class Pump:
    oil: Annotated["Oil | AnyPath", Option("OIL")]  # noqa: F821
    """Oil."""
    others: Annotated[Paths, Option("OIL")] = ()
    """Others."""
    _: KW_ONLY
    lag: Annotated[Text, Option("T", default="0.1 s", read=quantity("time"))] = None
    """Lag."""
    ports: Annotated[Table, Option("MAP")] = None
    """Ports."""
    record: Annotated[Mapping[str, object] | None, Option("ENTRY", by_entry=True)] = None
    """Record."""
    fast: Annotated[bool, Option()] = False
    """Fast."""
    output: Annotated[AnyPath | None, Option("FILE", command_default="pump.json")] = None
    """Output."""


def test_a_declaration_says_how_each_option_is_taken():
    declared = {argument.name: argument for argument in arguments_of(Pump)}
    assert list(declared) == ["oil", "others", "lag", "ports", "record", "fast", "output"]

    def those(which):
        return {name for name, argument in declared.items() if which(argument)}

    assert those(lambda argument: argument.is_positional) == {"oil", "others"}
    assert those(lambda argument: argument.required) == {"oil"}
    assert those(lambda argument: argument.is_path) == {"oil", "others", "output"}
    assert those(lambda argument: argument.is_repeatable) == {"others", "record"}
    assert those(lambda argument: argument.is_table) == {"ports", "record"}
    assert those(lambda argument: bool in argument.kinds) == {"fast"}
    assert declared["oil"].result_class == "Oil"
    texts = {name: argument.default_text for name, argument in declared.items() if argument.default_text}
    assert texts == {"lag": "0.1 s", "output": "pump.json"}


def test_an_option_that_was_not_given_is_read_as_its_default():
    assert read_options(Pump("x"), ["lag", "ports"]) == {"lag": 0.1, "ports": None}
    assert read_options(Pump("x", lag="2 s"), ["lag"]) == {"lag": 2.0}
    with pytest.raises(InputError, match=r"--lag is '2' without a unit"):
        read_options(Pump("x", lag="2"), ["lag"])


@pytest.mark.parametrize(
    ("read", "text", "value"),
    [
        (number("a number"), "0.5", 0.5),
        (number("a number"), 0.5, 0.5),
        (number("a number"), "half", None),
        (number("a number", between=(0, 9)), "9", None),
        (number("a number", between=(0, 9)), "nan", None),
        (whole_number("a count"), "012", 12),
        (whole_number("a count"), 12, 12),
        (whole_number("a count"), -1, None),
        (whole_number("a count"), "1.5", None),
        (whole_number("a count", least=1), "0", None),
        (whole_number("a count", digits=2), "123", None),
        (percent_range("full"), " 12 % - 50", (0.12, 0.5)),
        (percent_range("full"), "12", None),
    ],
)
def test_readers(read, text, value):
    if value is None:
        with pytest.raises(InputError, match=r"--what is .*, expected "):
            read(text, "--what")
    else:
        assert read(text, "--what") == value


def test_one_or_several():
    assert paths_of("a") == ["a"] and paths_of(iter("ab")) == ["a", "b"]
    assert texts_of("ab") == ["ab"] and texts_of(("a", "b")) == ["a", "b"]
