"""What others would flash: the same law, table, input checks and rounding in doubles, floats, by CasADi and by SymPy.

All are written or generated here from the same `Compensator`, in the precision that their makers use by default. Every
one treats impossible codes as the product does (a command above its range gives 0, an impossible pressure the smallest
beta), limits to 0...compare_max and rounds a half up; so a row does the same job in every column.
"""

import tempfile
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

import sympy
from contender import Contender

from dzdesign.derivation import symbols
from dzdesign.derivation.law import law
from dzdesign.derivation.scaling import evaluate_line
from dzdesign.design.compensator import Compensator

PROTOTYPE = "uint16_t dz_comp(uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc)"


def rivals(compensator: Compensator) -> list[Contender]:
    """Return all rivals of a compensator."""
    return [
        _naive_double(compensator),
        _slope_table(compensator, checked=True),
        _slope_table(compensator, checked=False),
        _casadi(compensator, "pw_lin"),
        _casadi(compensator, "interpolant"),
        _sympy(compensator),
    ]


def _line_terms(compensator: Compensator) -> tuple[Fraction, Fraction, Fraction]:
    """Return p, q, r of ``counts = beta (p u + r) + q u``: Eq. (18) in counts, exactly."""
    lines = [
        evaluate_line(
            law(compensator.law),
            beta=beta,
            kappa=compensator.positive.drive_range_over_u_max,
            u_min0_over_u_max=compensator.positive.u_min0_over_u_max,
            n_adc=compensator.signals.code_max,
            n_full=compensator.signals.compare_max,
        )
        for beta in (0, 1)
    ]
    return lines[1].slope - lines[0].slope, lines[0].slope, lines[1].start


def _betas(compensator: Compensator) -> list[Fraction]:
    return [Fraction(value, compensator.beta_denominator) for value in compensator.positive.beta]


def _double(value: Fraction) -> str:
    return repr(float(value))


def _single(value: Fraction) -> str:
    return f"{float(value):.9e}f"


def _rows(values: list[str]) -> str:
    return "\n".join("    " + " ".join(f"{value}," for value in values[at : at + 5]) for at in range(0, len(values), 5))


def _naive_double(c: Compensator) -> Contender:
    """Write Eq. (18) as it stands in the paper: volts and megapascals, a search, a division."""
    signals, betas = c.signals, _betas(c)
    u_max = c.u_max_V
    text = f"""\
#include <stdint.h>

static const double dp_node[{len(betas)}] = {{
{_rows([_double(signals.pair(1).dp_MPa(index * c.beta_step_codes)) for index in range(len(betas))])}
}};
static const double beta_node[{len(betas)}] = {{
{_rows([_double(value) for value in betas])}
}};

{PROTOTYPE}
{{
    const double u_i = u_adc * {_double(u_max)} / {signals.code_max}.0;
    const double p_a = p_a_adc * {_double(signals.pressure_a.span_MPa)} / {signals.code_max}.0;
    const double p_b = p_b_adc * {_double(signals.pressure_a.span_MPa)} / {signals.code_max}.0;
    const double dp = p_a - p_b;
    double beta = {_double(c.beta(-c.reverse_codes - 1))}, u_o, compare;

    if (u_adc > {signals.code_max}u) {{
        return 0;
    }}
    if (p_a_adc <= {signals.code_max}u && p_b_adc <= {signals.code_max}u
        && dp > {_double(signals.pair(1).dp_MPa(-c.reverse_codes) - signals.pair(1).dp_MPa(1) / 2)}) {{
        int i = 0;

        if (dp <= 0.0) {{
            beta = beta_node[0];
        }} else {{
            while (dp >= dp_node[i + 1]) {{
                i++;
            }}
            beta = beta_node[i]
                + (beta_node[i + 1] - beta_node[i]) * (dp - dp_node[i]) / (dp_node[i + 1] - dp_node[i]);
        }}
    }}
    u_o = {_naive_law(c)};
    compare = u_o / {_double(u_max)} * {signals.compare_max}.0 + 0.5;
    if (compare < 0.0) {{
        compare = 0.0;
    }}
    if (compare > {signals.compare_max}.0) {{
        compare = {signals.compare_max}.0;
    }}
    return (uint16_t)compare;
}}
"""
    return Contender(
        name="naive float64",
        made="Eq. (18) in volts and MPa as it stands, beta by a search and a division, everything in `double`.",
        sources={"dz_comp.c": text},
        fast=False,
    )


def _naive_law(c: Compensator) -> str:
    share, u_min0 = _double(c.positive.drive_range_over_u_max), _double(c.positive.u_min0_over_u_max * c.u_max_V)
    in_shares = law(c.law).output.subs(symbols.k, symbols.kappa * symbols.u_max / symbols.x_max)
    # The numbers as symbols, so that none of them is computed beforehand.
    return sympy.ccode(in_shares.subs({symbols.kappa: sympy.Symbol(share), symbols.u_min0: sympy.Symbol(u_min0)}))


def _slope_table(c: Compensator, *, checked: bool) -> Contender:
    """Write the usual fast one: the segment by a shift, its start and slope from a table, the law in counts."""
    signals, betas = c.signals, _betas(c)
    step = c.beta_step_codes
    p, q, r = _line_terms(c)
    # beta = start + slope dp over the whole axis, so that the place in the segment is not needed.
    slopes = [(right - left) / step for left, right in pairwise(betas)]
    starts = [left - slope * index * step for index, (left, slope) in enumerate(zip(betas, slopes, strict=False))]
    pairs = [f"{{{_single(start)}, {_single(slope)}}}" for start, slope in zip(starts, slopes, strict=True)]
    command_check = f"""\
    if (u_adc > {signals.code_max}u) {{
        return 0;
    }}
"""
    pressure_check = f"p_a_adc <= {signals.code_max}u && p_b_adc <= {signals.code_max}u && "
    text = f"""\
#include <stdint.h>

static const struct {{ float start, slope; }} segment[{len(pairs)}] = {{
{_rows(pairs)}
}};

{PROTOTYPE}
{{
    const int32_t dp = (int32_t)p_a_adc - (int32_t)p_b_adc;
    const float u = (float)u_adc;
    float beta = {_single(c.beta(-c.reverse_codes - 1))}, compare;

{command_check if checked else ""}\
    if ({pressure_check if checked else ""}dp >= -{c.reverse_codes}) {{
        const int32_t clipped = dp < 0 ? 0 : dp;

        beta = segment[clipped >> {step.bit_length() - 1}].start
            + segment[clipped >> {step.bit_length() - 1}].slope * (float)clipped;
    }}
    compare = beta * ({_single(p)} * u + {_single(r)}) + {_single(q)} * u + 0.5f;
    if (compare < 0.0f) {{
        compare = 0.0f;
    }}
    if (compare > {signals.compare_max}.0f) {{
        compare = {signals.compare_max}.0f;
    }}
    return (uint16_t)compare;
}}
"""
    note = "" if checked else " The same without the checks of impossible command and pressure codes."
    return Contender(
        name="float32 slope table" + ("" if checked else ", unchecked"),
        made="Segment by a shift, beta = start + slope dP from a table, the law in counts, all in `float`." + note,
        sources={"dz_comp.c": text},
    )


def _wrapped(c: Compensator, declaration: str, call: str) -> str:
    """Return a ``dz_comp`` around a generated law of command code and pressure-difference code in doubles."""
    signals = c.signals
    return f"""\
#include <stdint.h>

{declaration}

{PROTOTYPE}
{{
    double u = u_adc, dp = (double)((int32_t)p_a_adc - (int32_t)p_b_adc), counts;

    if (u_adc > {signals.code_max}u) {{
        return 0;
    }}
    if (p_a_adc > {signals.code_max}u || p_b_adc > {signals.code_max}u) {{
        dp = -{signals.code_max}.0;
    }}
{call}
    counts += 0.5;
    if (counts < 0.0) {{
        counts = 0.0;
    }}
    if (counts > {signals.compare_max}.0) {{
        counts = {signals.compare_max}.0;
    }}
    return (uint16_t)counts;
}}
"""


def _casadi(c: Compensator, lookup: str) -> Contender:
    """Let CasADi generate the law with its own piecewise linear function, or its interpolant."""
    import casadi

    kind = casadi.SX if lookup == "pw_lin" else casadi.MX
    u, dp = kind.sym("u"), kind.sym("dp")
    betas = [float(value) for value in _betas(c)]
    nodes = [float(index * c.beta_step_codes) for index in range(len(betas))]
    inside = casadi.fmax(dp, 0)
    if lookup == "pw_lin":
        beta = casadi.pw_lin(inside, casadi.DM(nodes), casadi.DM(betas))
    else:
        beta = casadi.interpolant("beta", "linear", [nodes], betas, {"lookup_mode": ["exact"]})(inside)
    beta = casadi.if_else(dp < -c.reverse_codes, float(c.beta(-c.reverse_codes - 1)), beta)
    p, q, r = (float(value) for value in _line_terms(c))
    function = casadi.Function("law", [u, dp], [beta * (p * u + r) + q * u])
    with tempfile.TemporaryDirectory() as folder:
        generator = casadi.CodeGenerator("law.c", {"with_header": False})
        generator.add(function)
        generator.generate(folder + "/")
        law_c = (Path(folder) / "law.c").read_text(encoding="utf-8")
    declaration = "int law(const double **arg, double **res, long long int *iw, double *w, int mem);"
    call = f"""\
    {{
        const double *arg[{function.sz_arg()}] = {{&u, &dp}};
        double *res[{function.sz_res()}] = {{&counts}};
        long long int iw[{function.sz_iw() + 1}];
        double w[{function.sz_w() + 1}];

        (void)law(arg, res, iw, w, 0);
    }}"""
    how = {
        "pw_lin": "`casadi.pw_lin` over SX",
        "interpolant": "`casadi.interpolant`, linear, `lookup_mode` exact (the grid is even), over MX",
    }[lookup]
    return Contender(
        name=f"casadi {lookup}",
        made=f"{how}, generated by `CodeGenerator` with its default `double`, in a wrapper that checks and rounds.",
        sources={"law.c": law_c, "dz_comp.c": _wrapped(c, declaration, call)},
        fast=False,
    )


def _sympy(c: Compensator) -> Contender:
    """Let SymPy print beta as a Piecewise and the law, both exact, as C."""
    import sympy

    u, dp, beta = sympy.symbols("u dp beta")

    def exact(value: Fraction) -> sympy.Rational:
        return sympy.Rational(value.numerator, value.denominator)

    betas, step = [exact(value) for value in _betas(c)], c.beta_step_codes
    branches = [(exact(c.beta(-c.reverse_codes - 1)), dp < -c.reverse_codes), (betas[0], dp < 0)]
    for index, (left, right) in enumerate(pairwise(betas)):
        piece = left + (right - left) / step * (dp - index * step)
        branches.append((sympy.expand(piece), True if index == len(betas) - 2 else dp < (index + 1) * step))
    p, q, r = (exact(value) for value in _line_terms(c))
    law_c = "\n".join(
        (
            sympy.ccode(sympy.Piecewise(*branches, evaluate=False), assign_to="beta"),
            sympy.ccode(beta * (p * u + r) + q * u, assign_to="counts"),
        )
    )
    return Contender(
        name="sympy ccode",
        made="`sympy.ccode` of beta as a `Piecewise` in dP and of the law, in `double`, in the same wrapper.",
        sources={"dz_comp.c": _wrapped(c, "", "    double beta;\n" + law_c)},
        fast=False,
    )
