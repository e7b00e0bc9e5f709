"""A small file can't take the machine's memory, and what people write is read as TOML says."""

import time

import pytest

from dzdesign.core.errors import InputError
from dzdesign.core.toml_documents import MOST_PARTS, read_toml

DOTTED = ".".join("a" * 100_000)


@pytest.mark.parametrize("text", [
    f"{DOTTED} = 1", f"[{DOTTED}]", f"[[{DOTTED}]]", f"x = {{ {DOTTED} = 1 }}", f"x = [{{ {DOTTED} = 1 }}]",
    " . ".join(["'a b'", '"c.d"'] * 50) + " = 1", "\n" * 1000 + f"\t{DOTTED}=1",
])  # fmt: skip
def test_a_deep_key_is_refused_before_it_is_parsed(text):
    begin = time.process_time()
    with pytest.raises(InputError, match=f"more than {MOST_PARTS} parts"):
        read_toml(text.encode(), "options.toml", "options")
    assert time.process_time() - begin < 1


@pytest.mark.parametrize("piece", ["a", "a ", "a.", "'", '"', "'a", "a\t", ". ", "a . ", '"a"."', "-."])
def test_the_search_takes_a_time_as_long_as_the_file(piece):
    begin = time.process_time()
    with pytest.raises(InputError):
        read_toml((piece * 300_000).encode(), "options.toml", "options")
    assert time.process_time() - begin < 2


def test_three_thousand_nested_headers_take_no_second():
    deepest = ".".join("a" * MOST_PARTS)
    text = "\n".join(f"[{deepest}{number}]" for number in range(3000))
    begin = time.process_time()
    assert read_toml(text.encode(), "options.toml", "options")
    assert time.process_time() - begin < 1


@pytest.mark.parametrize("text", ["x = " + "[" * 5000, "x = " + "{a = " * 5000, "x = 1\nx = 2", "x", "\xff"])
def test_what_is_no_toml_is_said_to_be_none(text):
    with pytest.raises(InputError, match="expected options"):
        read_toml(text.encode("latin-1"), "options.toml", "options")


def test_numbers_texts_and_prose_with_many_points_are_read():
    numbers = ", ".join(["0.1"] * 100)
    prose = "Span, 2.5 V. Zero, 0.5 V. " * 20
    text = f'x = [{numbers}]\ny = "{prose}"\n[machine]\nsupply.least = 18.0\n'
    found = read_toml(text.encode(), "options.toml", "options", str)
    assert found["x"] == ["0.1"] * 100 and found["machine"] == {"supply": {"least": "18.0"}}


def test_a_number_of_too_many_digits_is_said_without_advice_for_programmers():
    with pytest.raises(InputError, match="4300 digits") as raised:
        read_toml(b"a = " + b"9" * 5000, "a.toml", "lines")
    assert "sys." not in str(raised.value)
