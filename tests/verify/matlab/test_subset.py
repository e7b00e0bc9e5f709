"""The subset of the language that is verified: what is of it, and what is refused, with its line."""

import pytest

from dzdesign.core.errors import InputError
from dzdesign.verify.matlab.subset import read_functions
from tests.support.octave import compensator_of, output_of
from tests.support.paths import GOLDENS

GOOD = """function [compare, status, beta] = dz_comp(u_adc, p_a_adc, p_b_adc)
% Help.
    x = min(int32(u_adc), ...
        int32(3)); % as it is
    if nargin ~= 3 || isempty(p_a_adc)
        error('dz_comp:x', 'it''s %d.', nargin);
    end
    compare = uint16(x); status = compare; beta = mine(p_b_adc);
end

function y = mine(values)
    y = values(:);
    y(values > 2) = 0;
end
"""


def test_what_is_generated_is_of_it():
    text = output_of(compensator_of(GOLDENS)).files["dz_comp.m"].decode()
    assert [each.name for each in read_functions(text, "dz_comp.m")] == ["dz_comp", "codes_of", "shape_of", "column_of"]
    assert [each.name for each in read_functions(GOOD, "dz_comp.m")] == ["dz_comp", "mine"]


@pytest.mark.parametrize(
    "new",
    [
        "system('ls')", "x(1) = eval('2')", "y = fopen(u_adc)", "f = @min", "x = feval('ls', 1)", "x += 1", "x++",
        'y = "text"', "y = u_adc'", "y = u_adc.'", "y = u_adc ./ 2", "y = u_adc / 2", "y = u_adc .^ 2", "y = 0.5",
        "y = 1e3", "y = u_adc.field", "!ls", "y = !u_adc", "y = 1 # no", "%{\n ls\n%}", "for k = 1:3\n end",
        "while 1\n end", "x = 1\n endif", "global x", "persistent x", "y = pi", "y = idivide(u_adc, 2)", "cd ..",
        "rm x", "unwind_protect", "y = `ls`", "y = \\ 2", "min = 3", "mine = 3", "end = 3", "y = é", "y = 'open",
        "if x", "try", "return", "y = z", "y = 2^3.5", "ans = 1; y = builtin('x')", "[y, z] = fileparts('x')",
        "error = 3", "function y = other(x)",
    ],
)  # fmt: skip
def test_what_is_not_of_it_is_refused(new):
    with pytest.raises(InputError, match=r"dz_comp\.m"):
        read_functions(GOOD.replace("    x = min(", f"    {new};\n    x = min(", 1), "dz_comp.m")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("function [compare", "x = 1;\nfunction [compare"),
        ("function [compare", "1;\nfunction [compare"),
        ("[compare, status, beta]", "[compare, beta, status]"),
        ("(u_adc, p_a_adc, p_b_adc)\n%", "(u_adc, p_b_adc, p_a_adc)\n%"),
        ("= dz_comp(", "= dz_other("),
        ("(values)\n", "(varargin)\n"),
        ("function y = mine(values)", "function mine(values)"),
        ("    end\n", "\n"),
    ],
)
def test_another_heading_is_refused(old, new):
    assert old in GOOD
    with pytest.raises(InputError, match=r"dz_comp\.m"):
        read_functions(GOOD.replace(old, new, 1), "dz_comp.m")


def test_the_line_is_said():
    with pytest.raises(InputError, match=r"dz_comp\.m, line 8: pi is outside"):
        read_functions(GOOD.replace("compare = uint16(x)", "compare = pi"), "dz_comp.m")
