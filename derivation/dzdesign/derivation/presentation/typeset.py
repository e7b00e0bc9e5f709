"""Writes formulas as plain text, as LaTeX and as MathML; `layout.py` says what stands where."""

import re
from abc import ABC, abstractmethod
from collections.abc import Sequence
from html import escape

import sympy

from dzdesign.derivation.presentation.layout import (
    Call,
    Cases,
    Derivative,
    Fraction,
    Name,
    Number,
    Power,
    Product,
    Relation,
    Root,
    Sum,
    Tree,
    lay_out,
)

GREEK = ("beta", "gamma", "kappa", "lambda", "rho")
_GREEK_LETTERS = dict(zip(GREEK, "βγκλρ", strict=True))
_OTHERWISE = "otherwise"


class Notation(ABC):
    """A way to write the parts of a formula; parts come in as text in the same notation."""

    def write(self, tree: Tree) -> str:
        """Return a formula's tree as text in this notation.

        Parameters
        ----------
        tree : Tree

        Returns
        -------
        str
        """
        match tree:
            case Number(digits):
                return self.number(digits)
            case Name():
                return self.name(tree)
            case Derivative(of, by):
                return self.derivative(self.name(of), self.name(by))
            case Sum(terms):
                return self.sum([(minus, self._term(term)) for minus, term in terms])
            case Product(factors):
                return self.product([self._factor(factor) for factor in factors])
            case Fraction(above, below):
                return self.fraction(above, below)
            case Power(base, exponent):
                return self.power(self.write(base) if isinstance(base, Name) else self.group(base), exponent)
            case Root(inside):
                return self.root(self.write(inside))
            case Call(name, argument):
                return self.call(self.name(name), self.write(argument))
            case Relation(sides, signs):
                return self.relation([self.write(side) for side in sides], signs)
            case Cases(rows):
                return self.cases([(self.write(value), when and self.write(when)) for value, when in rows])

    def _term(self, term: Tree) -> str:
        return self.group(term) if isinstance(term, Sum) else self.write(term)

    def _factor(self, factor: Tree) -> str:
        return self.group(factor) if isinstance(factor, Sum) else self.write(factor)

    @abstractmethod
    def number(self, digits: str) -> str:
        """Write a whole number."""

    @abstractmethod
    def name(self, name: Name) -> str:
        """Write a symbol."""

    @abstractmethod
    def derivative(self, of: str, by: str) -> str:
        """Write a derivative: ordinary by t, else partial."""

    @abstractmethod
    def sum(self, terms: Sequence[tuple[bool, str]]) -> str:
        """Write a sum; a term may be subtracted."""

    @abstractmethod
    def product(self, factors: Sequence[str]) -> str:
        """Write a product."""

    @abstractmethod
    def fraction(self, above: Tree, below: Tree) -> str:
        """Write a fraction."""

    @abstractmethod
    def power(self, base: str, exponent: Tree) -> str:
        """Write a power; the base comes with its parentheses."""

    @abstractmethod
    def root(self, inside: str) -> str:
        """Write a square root."""

    @abstractmethod
    def call(self, name: str, argument: str) -> str:
        """Write a function of something."""

    @abstractmethod
    def group(self, tree: Tree) -> str:
        """Write something in parentheses."""

    @abstractmethod
    def relation(self, sides: Sequence[str], signs: Sequence[str]) -> str:
        """Write an equation or an inequality, or a chain of them."""

    @abstractmethod
    def cases(self, rows: Sequence[tuple[str, str | None]]) -> str:
        """Write values with their conditions; the condition None is `otherwise`."""


class PlainText(Notation):
    """ASCII that a person can read and a computer algebra system too, but for the cases, one on a line."""

    def number(self, digits: str) -> str:
        return digits

    def name(self, name: Name) -> str:
        if name.base == "ΔP":
            return "dP" + name.index
        index = name.index.replace("−", "neg")
        return name.base + (f"_{index}" if index else "") + name.prime

    def derivative(self, of: str, by: str) -> str:
        return f"d{of}/d{by}"

    def sum(self, terms: Sequence[tuple[bool, str]]) -> str:
        words = "".join((" - " if minus else " + ") + term for minus, term in terms)
        return "-" + words[3:] if words.startswith(" - ") else words[3:]

    def product(self, factors: Sequence[str]) -> str:
        return "*".join(factors)

    def fraction(self, above: Tree, below: Tree) -> str:
        one_factor = isinstance(below, Name | Number | Power | Root | Call)
        return f"{self._factor(above)}/{self.write(below) if one_factor else self.group(below)}"

    def power(self, base: str, exponent: Tree) -> str:
        return f"{base}^{self.write(exponent) if isinstance(exponent, Number | Name) else self.group(exponent)}"

    def root(self, inside: str) -> str:
        return f"sqrt({inside})"

    def call(self, name: str, argument: str) -> str:
        return f"{name}({argument})"

    def group(self, tree: Tree) -> str:
        return f"({self.write(tree)})"

    def relation(self, sides: Sequence[str], signs: Sequence[str]) -> str:
        ascii_signs = [{"≤": "<=", "≥": ">=", "≠": "!="}.get(sign, sign) for sign in signs]
        return sides[0] + "".join(f" {sign} {side}" for sign, side in zip(ascii_signs, sides[1:], strict=True))

    def cases(self, rows: Sequence[tuple[str, str | None]]) -> str:
        width = max(len(value) for value, _ in rows)
        return "\n".join(f"{{ {value:<{width}}  {f'if {when}' if when else _OTHERWISE}" for value, when in rows)


_PARTS = re.compile(r"[^\W\d]+|\d+|−")


class Latex(Notation):
    """LaTeX for math mode, with amsmath."""

    def number(self, digits: str) -> str:
        return digits

    def name(self, name: Name) -> str:
        index = "".join(map(self._part, _PARTS.findall(name.index)))
        return self._part(name.base) + (f"_{{{index}}}" if index else "") + name.prime

    def derivative(self, of: str, by: str) -> str:
        d = r"\mathrm{d}" if by == "t" else r"\partial "
        return rf"\frac{{{d}{of}}}{{{d}{by}}}"

    def _part(self, part: str) -> str:
        known = {"ΔP": r"\Delta P", "−": "-", "ln": r"\ln"}
        if part in known:
            return known[part]
        if part in GREEK:
            return "\\" + part
        return part if len(part) == 1 or part.isdigit() else rf"\mathrm{{{part}}}"

    def sum(self, terms: Sequence[tuple[bool, str]]) -> str:
        words = "".join((" - " if minus else " + ") + term for minus, term in terms)
        return "-" + words[3:] if words.startswith(" - ") else words[3:]

    def product(self, factors: Sequence[str]) -> str:
        return r" \, ".join(factors)

    def fraction(self, above: Tree, below: Tree) -> str:
        # LaTeX sets the third of nested fractions in five points.
        parts = (
            part.replace(r"\frac", r"\dfrac") if r"\frac" in part.partition(r"\frac")[2] else part
            for part in (self.write(above), self.write(below))
        )
        return r"\frac" + "".join(f"{{{part}}}" for part in parts)

    def power(self, base: str, exponent: Tree) -> str:
        return f"{base}^{{{self.write(exponent)}}}"

    def root(self, inside: str) -> str:
        return rf"\sqrt{{{inside}}}"

    def call(self, name: str, argument: str) -> str:
        tall = r"\frac" in argument
        return rf"{name}\left({argument}\right)" if tall else f"{name}({argument})"

    def group(self, tree: Tree) -> str:
        inside = self.write(tree)
        return rf"\left({inside}\right)" if r"\frac" in inside else f"({inside})"

    def relation(self, sides: Sequence[str], signs: Sequence[str]) -> str:
        known = {"≤": r"\le", "≥": r"\ge", "≠": r"\ne"}
        words = (f" {known.get(sign, sign)} {side}" for sign, side in zip(signs, sides[1:], strict=True))
        return sides[0] + "".join(words)

    def cases(self, rows: Sequence[tuple[str, str | None]]) -> str:
        lines = (rf"{value} & \text{{{'if }' + when if when else _OTHERWISE + '}'}" for value, when in rows)
        return r"\begin{cases} " + r" \\ ".join(lines) + r" \end{cases}"


def _tag(name: str, *content: str) -> str:
    return f"<{name}>{''.join(content)}</{name}>"


class MathML(Notation):
    """Presentation MathML for a browser; each part is one element, so that it can be an argument."""

    def number(self, digits: str) -> str:
        return _tag("mn", digits)

    def name(self, name: Name) -> str:
        text = self._part(name.base)
        prime = "<mo>′</mo>" if name.prime else ""
        if not name.index:
            return _tag("msup", text, prime) if prime else text
        index = _tag("mrow", *map(self._part, _PARTS.findall(name.index)))
        return _tag("msubsup", text, index, prime) if prime else _tag("msub", text, index)

    def _part(self, part: str) -> str:
        if part.isdigit():
            return _tag("mn", part)
        known = {"ΔP": '<mrow><mi mathvariant="normal">Δ</mi><mi>P</mi></mrow>', "−": "<mo>−</mo>"}
        if part in known:
            return known[part]
        return _tag("mi", _GREEK_LETTERS.get(part, escape(part)))

    def derivative(self, of: str, by: str) -> str:
        d = '<mi mathvariant="normal">d</mi>' if by == "<mi>t</mi>" else "<mi>∂</mi>"
        return _tag("mfrac", _tag("mrow", d, of), _tag("mrow", d, by))

    def sum(self, terms: Sequence[tuple[bool, str]]) -> str:
        parts = []
        for position, (minus, term) in enumerate(terms):
            if minus:
                parts.append('<mo form="infix">−</mo>' if position else '<mo form="prefix">−</mo>')
            elif position:
                parts.append("<mo>+</mo>")
            parts.append(term)
        return _tag("mrow", *parts)

    def product(self, factors: Sequence[str]) -> str:
        # A thin space, wider than what a browser leaves between factors, narrower than around a sign.
        return _tag("mrow", '<mspace width="0.17em"/>'.join(factors))

    def fraction(self, above: Tree, below: Tree) -> str:
        return _tag("mfrac", self.write(above), self.write(below))

    def power(self, base: str, exponent: Tree) -> str:
        if base.startswith("<msub>"):
            return _tag("msubsup", base.removeprefix("<msub>").removesuffix("</msub>"), self.write(exponent))
        return _tag("msup", base, self.write(exponent))

    def root(self, inside: str) -> str:
        return _tag("msqrt", inside)

    def call(self, name: str, argument: str) -> str:
        return _tag("mrow", name, "<mo>&#8289;</mo>", self._in_parentheses(argument))

    def group(self, tree: Tree) -> str:
        return self._in_parentheses(self.write(tree))

    def _in_parentheses(self, inside: str) -> str:
        # Chromium sets a stretched parenthesis apart even where it need not be taller.
        stretchy = "true" if "<mfrac" in inside or "<msqrt" in inside else "false"
        return _tag("mrow", f'<mo stretchy="{stretchy}">(</mo>', inside, f'<mo stretchy="{stretchy}">)</mo>')

    def relation(self, sides: Sequence[str], signs: Sequence[str]) -> str:
        parts = [sides[0]]
        for sign, side in zip(signs, sides[1:], strict=True):
            parts += [_tag("mo", escape(sign)), side]
        return _tag("mrow", *parts)

    def cases(self, rows: Sequence[tuple[str, str | None]]) -> str:
        def condition(when: str | None) -> str:
            return f"<mtext>if&#160;</mtext>{when}" if when else _tag("mtext", _OTHERWISE)

        lines = (_tag("mtr", _tag("mtd", value), _tag("mtd", _tag("mrow", condition(when)))) for value, when in rows)
        return _tag(
            "mrow",
            '<mo stretchy="true">{</mo>',
            '<mtable class="cases" displaystyle="true">' + "".join(lines) + "</mtable>",
        )


TEXT, LATEX, MATHML = PlainText(), Latex(), MathML()


def typeset(formula: sympy.Basic | str, notation: Notation) -> str:
    """Return an expression, or a name such as ``u_min0``, in a notation.

    Parameters
    ----------
    formula : sympy.Expr, relational or str
    notation : Notation
        `TEXT`, `LATEX` or `MATHML`.

    Returns
    -------
    str

    Examples
    --------
    >>> from dzdesign.derivation import symbols as s
    >>> typeset((s.k * s.x_max / s.u_max - 1) * s.u_i + s.u_min0, TEXT)
    '(k*x_max/u_max - 1)*u_i + u_min0'
    """
    return notation.write(lay_out(sympy.Symbol(formula) if isinstance(formula, str) else formula))
