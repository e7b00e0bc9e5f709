"""A small file can't take the machine's memory, and what people write is read as TOML says."""

import tracemalloc

import pytest

from dzdesign.core.documents import LONGEST_ROW, read_toml
from dzdesign.core.errors import InputError

ROW = LONGEST_ROW - 10


@pytest.mark.parametrize("part", ["a", r'"\""', "'a b'", "a ", '"a."'])
@pytest.mark.parametrize("form", ["{} = 1", "[{}]", "[[{}]]", "x = {{ {} = 1 }}", "x = [{{ {} = 1 }}]"])
def test_a_long_row_is_refused_before_it_is_parsed(form, part):
    dotted = ".".join([part] * (LONGEST_ROW // len(part)))
    assert peak_of(f"y = 1\n{form.format(dotted)}", "row 2 is longer") < 1 << 20


@pytest.mark.parametrize("text", ["#" * 99 + "\n", "aaaaaaaa = 1\n", '"\\"".' * 99 + "a = 1\n"])
def test_a_large_file_is_refused_before_it_is_parsed(text):
    assert peak_of(text * (100_000 // len(text)), "larger than 64 KiB") < 1 << 20


def test_the_deepest_row_that_is_read_takes_no_gigabyte():
    assert peak_of(f"{'.'.join('a' * (ROW // 2))} = 1 x", "is not TOML") < 100 << 20


def peak_of(text, reason):
    """Return how much memory a refusal takes, octets."""
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match=reason):
            read_toml(text.encode(), "options.toml", "options")
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


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
