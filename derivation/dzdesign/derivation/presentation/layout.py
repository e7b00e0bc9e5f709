"""Lays an expression out as the paper writes it: which factor comes first, what stands under which root.

SymPy's printers order sums and products by their own rules, each its own way, and split the roots of positive symbols.
Here an expression becomes a small tree, once for all notations; `typeset.py` writes the tree.
"""

from dataclasses import dataclass
from functools import cache

import sympy
from sympy.core.function import AppliedUndef


@dataclass(frozen=True, slots=True)
class Number:
    digits: str


@dataclass(frozen=True, slots=True)
class Name:
    """A symbol: ``u_min0`` has the base u and the index min0, ``Q_O'`` the index O and a prime."""

    base: str
    index: str = ""
    prime: str = ""


@dataclass(frozen=True, slots=True)
class Derivative:
    """Of a symbol, by another: ordinary by the time t, else partial."""

    of: Name
    by: Name


@dataclass(frozen=True, slots=True)
class Sum:
    """Terms, each with whether it is subtracted."""

    terms: "tuple[tuple[bool, Tree], ...]"


@dataclass(frozen=True, slots=True)
class Product:
    factors: "tuple[Tree, ...]"


@dataclass(frozen=True, slots=True)
class Fraction:
    above: "Tree"
    below: "Tree"


@dataclass(frozen=True, slots=True)
class Power:
    base: "Tree"
    exponent: "Tree"


@dataclass(frozen=True, slots=True)
class Root:
    inside: "Tree"


@dataclass(frozen=True, slots=True)
class Call:
    name: Name
    argument: "Tree"


@dataclass(frozen=True, slots=True)
class Relation:
    """Sides with the signs between them: ``-u_min < u_i < u_min`` has three and two."""

    sides: "tuple[Tree, ...]"
    signs: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Cases:
    """Values, each with its condition; None for `otherwise`."""

    rows: "tuple[tuple[Tree, Relation | None], ...]"


Tree = Number | Name | Derivative | Sum | Product | Fraction | Power | Root | Call | Relation | Cases

#: Names that do not spell their own look.
_NAMES: dict[str, Tree] = {
    "dP": Name("ΔP"),
    "dP0": Name("ΔP", "0"),
    "dP1": Name("ΔP", "1"),
    "Q_neg": Name("Q", "−"),
    "di_dt": Derivative(Name("i"), Name("t")),
    "dx_e_dt": Derivative(Name("x", "e"), Name("t")),
    "dv_dt": Derivative(Name("v"), Name("t")),
    "i(0)": Call(Name("i"), Number("0")),
    "x_e(0)": Call(Name("x", "e"), Number("0")),
    "v(0)": Call(Name("v"), Number("0")),
    "dQ_dC_d": Derivative(Name("Q"), Name("C", "d")),
    "dQ_dk": Derivative(Name("Q"), Name("k")),
    "dQ_dx_max": Derivative(Name("Q"), Name("x", "max")),
}

#: The order in which the paper writes the factors of a product; what is not named here follows by its name. After
#: these come roots, sums in parentheses, and then:
_FACTORS = (
    *("lambda", "n_full", "n_adc", "n_V", "K_c", "beta", "gamma_0", "gamma_1"),
    *("C_d", "K_a", "K_i", "K_fi", "K_0", "K_1", "K_e", "W", "L_c", "m_e", "B_e", "K_et"),
    *("S", "S_0", "S_1", "k", "Q_max", "Q_max0", "Q_max1", "Q_floor", "Q_O", "Q_O'"),
    *("V_pin", "V_adc", "x_max", "s", "x", "x_e", "x_ov"),
)
_COMMANDS = (
    "u_min",
    "u_min0",
    "u_min1",
    "u_max",
    "u_O",
    "u_i'",
    "y",
    "excess",
    "headroom",
    "F_e(s)",
    "x_e(0)",
    "v(0)",
    "i(0)",
)
#: What stands behind a fraction if its coefficient is one: (k x_max / u_max) u_i.
_SIGNALS = (
    *("dv_dt", "dx_e_dt", "di_dt", "u_i", "n_i", "U_i(s)", "i", "I(s)", "X_e(s)", "X_e(a + s)"),
    *("dQ_dC_d", "dQ_dk", "dQ_dx_max"),
)
#: The order of the terms of a sum: by the first of these that a term holds, also within parentheses, ...
_LEADING = (
    *("dv_dt", "dx_e_dt", "x_e", "x_ov", "f_eL", "X_e(s)", "F_eL(s)", "di_dt", "i", "x_e(0)", "v(0)"),
    *("U_i(s)", "U_if(s)", "I(s)", "u_above", "u_below", "u_O", "u_i'", "u_0", "u_no", "x", "Q_O'", "n_i", "u_i"),
)
#: ... and by the first of these that is a factor of it.
_FOLLOWING = ("n_0", "n_no", "u_min0", "u_min1", "u_min", "dP0", "y", "rest", "R_c", "r_p")
#: Distances that tell cases apart end a sum.
_LAST_TERMS = ("headroom", "excess", "guard", "above", "below")
#: What a condition is about stands on its left.
_COMPARED = ("u_i", "u_O", "dP1", "u_min1", "u_min")
_PRESSURES = ("dP", "dP0", "dP1")
_MIRRORED = {"<": ">", ">": "<", "≤": "≥", "≥": "≤", "=": "=", "≠": "≠"}
_SIGNS = {"<": "<", ">": ">", "<=": "≤", ">=": "≥", "==": "=", "!=": "≠"}


@cache
def lay_out(expression: sympy.Basic) -> Tree:
    """Lay an expression or a condition out as the paper would write it.

    Parameters
    ----------
    expression : sympy.Expr, relational, sympy.And or sympy.Piecewise

    Returns
    -------
    Tree

    Raises
    ------
    TypeError
        If it holds a function that has no layout.
    """
    if isinstance(expression, sympy.Piecewise):
        return _cases(expression)
    if isinstance(expression, sympy.And):
        return _chain(expression)
    if isinstance(expression, sympy.core.relational.Relational):
        return _relation(expression)
    if isinstance(expression, sympy.Add):
        return _sum(expression)
    return _product(_with_positive_sign(expression))


def _name(text: str) -> Name:
    bare = text.rstrip("'")
    base, _, index = bare.partition("_")
    return Name(base, index, text[len(bare) :])


def _atom(expression: sympy.Expr) -> Tree:
    """Lay out what is neither a sum nor a product nor a power."""
    if expression.is_Symbol:
        return _NAMES.get(expression.name) or _name(expression.name)
    if expression.is_Integer:
        return Number(str(expression))
    if expression.is_Float:
        return Number(f"{float(expression):.4g}")
    if isinstance(expression, AppliedUndef):
        return Call(_name(expression.func.__name__), lay_out(expression.args[0]))
    if isinstance(expression, sympy.log):
        return Call(Name("ln"), lay_out(expression.args[0]))
    if isinstance(expression, sympy.Add):
        return _sum(expression)
    raise TypeError(f"no layout for {type(expression).__name__}: {expression}")


# --- products -----------------------------------------------------------------------------------------------


def _split_sign(product: sympy.Expr) -> tuple[bool, sympy.Expr]:
    """Return whether a product is negative as it stands, and the product without that sign.

    A factor (-a - b) counts as -(a + b), which is how SymPy keeps it.
    """
    if product.is_Number:
        return product.is_negative, abs(product)
    minus, factors = False, []
    for factor in sympy.Mul.make_args(product):
        negated = _negated(factor)
        minus = minus != (negated is not None)
        factors.append(factor if negated is None else negated)
    return minus, sympy.Mul(*factors, evaluate=False)


def _negated(factor: sympy.Expr) -> sympy.Expr | None:
    """Return a factor without its sign, or None if it has none."""
    if factor.is_Number and factor.is_negative:
        return -factor
    if isinstance(factor, sympy.Add) and all(_split_sign(term)[0] for term in factor.args):
        return sympy.Add(*(-term for term in factor.args))
    return None


def _with_positive_sign(product: sympy.Expr) -> sympy.Expr:
    """Turn -(a - b) c into (b - a) c."""
    minus, positive = _split_sign(product)
    if not minus:
        return positive
    factors = list(sympy.Mul.make_args(positive))
    for index, factor in enumerate(factors):
        if isinstance(factor, sympy.Add) and any(_split_sign(term)[0] for term in factor.args):
            factors[index] = sympy.Add(*(-term for term in factor.args))
            return sympy.Mul(*factors, evaluate=False)
    return product


def _factors(product: sympy.Expr) -> tuple[sympy.Rational, list[tuple[sympy.Expr, sympy.Expr]]]:
    """Return the coefficient of a product, and its other factors as bases and exponents."""
    coefficient, powers = sympy.S.One, []
    for factor in sympy.Mul.make_args(product):
        if factor.is_Rational:
            coefficient *= factor
        elif factor.is_Pow:
            powers.append((factor.base, factor.exp))
        else:
            powers.append((factor, sympy.S.One))
    return coefficient, powers


def _product(product: sympy.Expr) -> Tree:
    coefficient, powers = _factors(product)
    coefficient, root, root_is_below = _collect_root(coefficient, powers)
    rooted = [] if root is None else [(root, sympy.S.One)]
    others = [(base, exponent) for base, exponent in powers if abs(exponent) != sympy.S.Half]
    above = [(base, exponent) for base, exponent in others if not exponent.could_extract_minus_sign()]
    below = [(base, -exponent) for base, exponent in others if exponent.could_extract_minus_sign()]
    numerator = _ordered(abs(coefficient.p), above + ([] if root_is_below else rooted))
    denominator = _ordered(coefficient.q, below + (rooted if root_is_below else []))
    tree = _fraction(numerator, denominator)
    return Sum(((True, tree),)) if coefficient < 0 else tree


def _collect_root(
    coefficient: sympy.Rational, powers: list[tuple[sympy.Expr, sympy.Expr]]
) -> tuple[sympy.Rational, Root | None, bool]:
    """Put everything under a root under one: sqrt(2 dP / rho). It stands where its pressure drop is above.

    Returns the coefficient that remains, the root, and whether it belongs below the fraction bar.
    """
    above = [base for base, exponent in powers if exponent == sympy.S.Half]
    below = [base for base, exponent in powers if exponent == -sympy.S.Half]
    if not above and not below:
        return coefficient, None, False
    turned = any(str(base) in _PRESSURES for base in below) and not any(str(base) in _PRESSURES for base in above)
    if turned:
        above, below = below, above
    # sqrt(2) sits above, or as 2 / sqrt(2) below.
    for number in [base for base in below if base.is_Integer]:
        below.remove(number)
        above.append(number)
        coefficient = coefficient * number if turned else coefficient / number
    inside = sympy.Mul(*above, *(1 / base for base in below), evaluate=False)
    return coefficient, Root(_product(inside)), turned


def _ordered(number: int, powers: "list[tuple[sympy.Expr | Root, sympy.Expr]]") -> list[tuple[Tree, bool]]:
    """Return the factors in order, each with whether it is a signal."""
    factors = [(Number(str(number)), False)] if number != 1 else []
    for base, exponent in sorted(powers, key=_factor_key):
        tree = base if isinstance(base, Root) else _product(base) if base.is_Mul else _atom(base)
        factors.append((tree if exponent == 1 else Power(tree, lay_out(exponent)), str(base) in _SIGNALS))
    return factors


def _factor_key(power: "tuple[sympy.Expr | Root, sympy.Expr]") -> tuple[int, int, str]:
    base, _ = power
    if isinstance(base, Root):
        return 1, 0, ""
    if isinstance(base, sympy.Add):
        return 2, len(str(base)), str(base)
    name = str(base)
    for group, names in ((3, _COMMANDS), (4, _SIGNALS), (0, _FACTORS)):
        if name in names:
            return group, names.index(name), ""
    return 0, len(_FACTORS), name


def _fraction(numerator: list[tuple[Tree, bool]], denominator: list[tuple[Tree, bool]]) -> Tree:
    if not denominator:
        return _joined([tree for tree, _ in numerator])
    below = _joined([tree for tree, _ in denominator])
    coefficient = [tree for tree, is_signal in numerator if not is_signal]
    signals = [tree for tree, is_signal in numerator if is_signal]
    if not coefficient or any(is_signal for _, is_signal in denominator):
        return Fraction(_joined(coefficient + signals), below)
    return _joined([Fraction(_joined(coefficient), below), *signals])


def _joined(factors: list[Tree]) -> Tree:
    if not factors:
        return Number("1")
    return factors[0] if len(factors) == 1 else Product(tuple(factors))


# --- sums ---------------------------------------------------------------------------------------------------


def _sum(expression: sympy.Expr) -> Sum:
    """Order the terms: positive ones first, numbers last unless no other can stand first."""
    terms = [(*_split_sign(term), term.is_Number) for term in sorted(expression.args, key=_term_key)]
    plus = [(minus, value) for minus, value, is_number in terms if not minus and not is_number]
    less = [(minus, value) for minus, value, is_number in terms if minus and not is_number]
    numbers = [(minus, value) for minus, value, is_number in terms if is_number]
    ordered = plus + less + numbers if plus else numbers + less
    return Sum(tuple((minus, _product(value)) for minus, value in ordered))


def _term_key(term: sympy.Expr) -> tuple[bool, int, int, bool, int, list]:
    _, powers = _factors(term)
    names = [str(base) for base, _ in powers]
    inside = {str(atom) for atom in term.atoms(sympy.Symbol, AppliedUndef)}
    order = next((int(exponent) for base, exponent in powers if str(base) == "s"), 0)
    held = [position for position, name in enumerate(_LEADING) if name in inside]
    held += [len(_LEADING) + position for position, name in enumerate(_FOLLOWING) if name in names]
    has_sum = any(isinstance(base, sympy.Add) for base, _ in powers)
    return (
        any(name in _LAST_TERMS for name in names),
        -order,
        min(held, default=len(_LEADING) + len(_FOLLOWING)),
        has_sum != bool(held),
        -len(powers),
        sorted(_factor_key(power) for power in powers),
    )


# --- conditions ---------------------------------------------------------------------------------------------


def _relation(relation: sympy.core.relational.Relational) -> Relation:
    left, sign, right = relation.lhs, _SIGNS[relation.rel_op], relation.rhs
    if _rank(right) < _rank(left):
        left, sign, right = right, _MIRRORED[sign], left
    return Relation((lay_out(left), lay_out(right)), (sign,))


def _rank(side: sympy.Expr) -> int:
    name = str(side)
    return _COMPARED.index(name) if name in _COMPARED else len(_COMPARED)


def _chain(condition: sympy.And) -> Relation:
    """Write a <= u and u < b as a <= u < b."""
    lower, upper = sorted(condition.args, key=lambda part: str(part.lts) in _COMPARED)
    if lower.gts != upper.lts:
        raise TypeError(f"no layout for {condition}")
    signs = tuple(
        "<" if isinstance(part, sympy.StrictLessThan | sympy.StrictGreaterThan) else "≤" for part in (lower, upper)
    )
    return Relation((lay_out(lower.lts), lay_out(lower.gts), lay_out(upper.gts)), signs)


def _cases(expression: sympy.Piecewise) -> Cases:
    rows = [(lay_out(value), None if when == sympy.true else lay_out(when)) for value, when in expression.args]
    first = expression.args[0][1]
    # SymPy drops the condition of the last case; of two, it is the opposite of the first.
    if len(rows) == 2 and rows[1][1] is None and isinstance(first, sympy.core.relational.Relational):
        rows[1] = (rows[1][0], _relation(first.negated))
    return Cases(tuple(rows))
