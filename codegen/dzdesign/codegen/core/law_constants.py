"""The law of one side in integers: every table of the core, and every `#define` of its arithmetic."""

from dataclasses import dataclass

from dzdesign.codegen.core.constants import Define, Table
from dzdesign.codegen.core.integer_form import IntegerForm
from dzdesign.codegen.core.table_form import TableForm, segments_of
from dzdesign.codegen.telemetry.frame import beta_factor
from dzdesign.derivation.law import Law, law
from dzdesign.derivation.presentation.formulas import to_text
from dzdesign.derivation.symbols import k
from dzdesign.design.compensator import Compensator
from dzdesign.design.signals import SIDE_NAMES

HERE = "codegen/dzdesign/codegen/core/integer_form.py"
#: Of the numerators over a power of two, by design/dzdesign/design/designing.py.
KAPPA_ROUNDING, U_MIN0_ROUNDING = "rounded to nearest", "rounded down with a margin of half a PWM count"
#: What every coefficient of the sum over the law's own contains.
SCALED = ("signals.compare_max", "signals.command", "beta_denominator", "beta_step_codes")


def equation_of(chosen: Law) -> str:
    """Return where a law comes from, as a reader looks for it."""
    return f"Eq. {chosen.equation}" if chosen.equation.startswith("(") else chosen.equation.replace("(", "Eq. (")


@dataclass(frozen=True, slots=True, kw_only=True)
class LawConstants:
    """The law of one side: its tables, its integers, and the division."""

    compensator: Compensator
    form: IntegerForm
    sign: int
    narrow: bool

    @property
    def key(self) -> str:
        """Key of the side in compensator.json."""
        return "sides.positive" if self.sign > 0 else "sides.negative"

    @property
    def unit(self) -> int:
        """What stands for beta = 1 in the tables."""
        return self.form.scale_beta * self.compensator.beta_denominator * self.compensator.beta_step_codes

    @property
    def uses_low_word(self) -> bool:
        """True if anything but the half is added to the lower 32 bits of beta's product."""
        return bool(self.form.transition or (self.form.linear << self.form.linear_shift) % 2**32)

    def table(self, at_zero: bool, rows: TableForm) -> Table:
        """Return the law's table, or the one of the certified beta at zero command."""
        c, form = self.compensator, self.form
        numerators = form.zero_table if at_zero else form.table
        turn = -1 if rows.falls else 1
        segments = segments_of(numerators, c.beta_step_codes)
        unit = form.scale_beta * c.beta_denominator
        low, high = (end(numerators[:-2]) / unit for end in (min, max))
        key = "transition_beta" if form.zero_table and not at_zero else "beta"
        guard = c.side(self.sign).certificate.guard
        what = f"certified beta of the {guard} threshold" if at_zero else "beta of the law"
        return Table(
            symbol="zero_segment" if at_zero else "law_segment",
            value=tuple((start % 2**32, turn * change) for start, change in segments),
            equation=f"Eq. (7), {what} times {self.unit}: start {rows.change_sign} change * dP modulo 2^32, dP in "
            "codes of sensor A; the first row is the smallest beta, for pressures that can't be right",
            engineering=f"beta {low:.6f} to {high:.6f}",
            rounding=f"nodes rounded down to 1/{c.beta_denominator}, so that the certificate holds, and not again"
            if key == "beta"
            else f"nodes rounded down to 1/{c.beta_denominator}, and not again",
            data=(f"{self.key}.{key}", "beta_denominator", "beta_step_codes"),
            generator=HERE,
        )

    def arithmetic(self) -> list[Define]:
        """Return the law's integers."""
        limit = [self._limit()] if self.form.exceeds else []
        division = self._estimate() if self.narrow else self._reciprocal()
        return [*self._factor(), *self._straight(), *self._half(), *limit, *division, *self._beta()]

    def _constant(
        self, symbol: str, value: int, equation: str, engineering: str, data: tuple[str, ...] = (), **how: str
    ) -> Define:
        how.setdefault("literal", "uint32")
        how.setdefault("generator", HERE)
        return Define(symbol=symbol, value=value, equation=equation, engineering=engineering, data=data, **how)

    def _per_volt(self, count: int) -> float:
        """Return u_O/u_i of a coefficient of the command in the sum."""
        form, signals = self.form, self.compensator.signals
        codes = signals.command.span(self.sign) * (self.compensator.transition_codes or 1)
        return count * codes / (form.divisor << form.shift) / signals.compare_max

    def _drive(self, count: int, form: str) -> str:
        """Return u_O of a term of the sum, in the unit that a person sees."""
        of_sum, c = self.form, self.compensator
        volts = count / (of_sum.divisor << of_sum.shift) / c.signals.compare_max * float(c.u_max_V)
        return c.valve.recorded_units.of_side(SIDE_NAMES[self.sign]).text(volts, form)

    def _factor(self) -> list[Define]:
        """Return what beta multiplies, by command and alone, and what the transition takes away."""
        c, form, side = self.compensator, self.form, self.compensator.side(self.sign)
        chosen = law(c.law)
        equation = equation_of(chosen)
        kappa, u_min0 = side.drive_range_over_u_max, side.u_min0_over_u_max
        kappa_key, u_min0_key = f"{self.key}.drive_range_over_u_max", f"{self.key}.u_min0_over_u_max"
        u_min0_text = f"u_min0/u_max = {u_min0}; that fraction was {U_MIN0_ROUNDING}"
        transition = ("transition_codes",) if c.transition_codes else ()
        found = []
        size = ", its size" if self.narrow and form.slope < 0 else ""
        if form.slope:
            factor = to_text(chosen.gain_by_beta(1)).replace("*", " ")
            found.append(
                self._constant(
                    "FACTOR_SLOPE",
                    -form.slope if self.narrow and form.slope < 0 else form.slope,
                    f"{equation}, coefficient of beta * u_i in u_O{size}",
                    f"{factor} = {self._per_volt(form.slope * self.unit):.6f}",
                    (kappa_key, *transition, *SCALED),
                    rounding=f"exact from k x_max/u_max = {kappa}, {KAPPA_ROUNDING}",
                    literal="uint32" if self.narrow else "int32",
                )
            )
        found.append(
            self._constant(
                "FACTOR_OFFSET",
                form.offset % 2**32 if self.narrow else form.offset,
                f"{equation}, coefficient of beta in u_O",
                f"u_min0 = {self._drive(form.offset * self.unit, '.6f V')}",
                (u_min0_key, "u_max_V", *SCALED),
                rounding=f"exact from {u_min0_text}",
                literal="uint32" if self.narrow else "int32",
            )
        )
        if form.transition:
            found.append(
                self._constant(
                    "TRANSITION_FACTOR",
                    form.transition,
                    "transition, coefficient of (beta - beta_zero) in u_O, for each code of command missing to its end",
                    f"u_min0/{c.transition_codes} = {self._drive(form.transition * self.unit, '.6g dV')}",
                    (u_min0_key, "transition_codes", "u_max_V", *SCALED),
                    rounding=f"exact from {u_min0_text}",
                    literal="uint32" if self.narrow else "int32",
                )
            )
        return found

    def _straight(self) -> list[Define]:
        """Return the coefficient of the command that beta does not touch."""
        c, form = self.compensator, self.form
        if not form.linear:
            return []
        total = form.linear << form.linear_shift
        chosen = law(c.law)
        equation = f"{equation_of(chosen)}, coefficient of u_i alone in u_O"
        engineering = f"{self._per_volt(total):.6f}"
        kappa = (f"{self.key}.drive_range_over_u_max",) if chosen.gain_by_beta(0).has(k) else ()
        data = (*kappa, *SCALED)
        high, low = divmod(total, 1 << 32)
        if low == 0:
            return [self._constant("COMMAND_HIGH_WORD", high, f"{equation}, over 2^32", engineering, data,
                                   literal="plain" if high < 1 << 16 and self.narrow and not c.transition_codes
                                   else "uint32")]  # fmt: skip
        if not self.narrow:
            return [
                self._constant("COMMAND_TERM", form.linear, f"{equation}, over 2^{form.linear_shift}", engineering,
                               data, literal="uint64"),
                self._constant("COMMAND_SHIFT", form.linear_shift, "the power of two in that coefficient",
                               f"2^{form.linear_shift}", data, literal="plain"),
            ]  # fmt: skip
        found = [self._constant("COMMAND_LOW_WORD", low, f"{equation}, its lower 32 bits", engineering, data)]
        if high:
            found.append(self._constant("COMMAND_HIGH_WORD", high, f"{equation}, its bits above 32", engineering, data,
                                        literal="plain" if high < 1 << 16 else "uint32"))  # fmt: skip
        return found

    def _half(self) -> list[Define]:
        """Return the half count that rounds to nearest, and the shift that drops the fraction."""
        form = self.form
        data = SCALED
        equation = "Eq. (32), half a count, so that shift and division round to the nearest, a half up"
        engineering = self._drive(form.half, ".3g dV")
        high, low = divmod(form.half, 1 << 32)
        shift = form.shift - (32 if self.narrow else 0)
        shifting = self._constant(
            "HIGH_SHIFT" if self.narrow else "SUM_SHIFT",
            shift,
            f"the sum{' over 2^32' if self.narrow else ''} is u_O in counts times {form.divisor} * 2^{shift}",
            f"1/2^{shift}",
            data,
            literal="plain",
            rounding="rounded down, the half being in it",
        )
        if not self.narrow:
            return [self._constant("HALF", form.half, equation, engineering, data, literal="uint64"), shifting]
        found = [self._constant("HALF_HIGH", high, f"{equation}, its bits above 32", engineering, data)]
        if low and self.uses_low_word:
            found.append(self._constant("HALF_LOW", low, f"{equation}, its lower 32 bits", engineering, data))
        if shift:
            found.append(shifting)
        return found

    def _limit(self) -> Define:
        form, c = self.form, self.compensator
        limit = c.drive_functions.compare_limit
        return self._constant(
            "QUOTIENT_LIMIT",
            form.largest,
            f"largest quotient whose compare value is DZ_COMPARE_LIMIT, ({limit} + 1) * {form.divisor} - 1",
            c.valve.recorded_units.of_side(SIDE_NAMES[self.sign]).text(
                limit / c.signals.compare_max * float(c.u_max_V), ".4g V"
            ),
            ("drive_functions.compare_limit", "signals.compare_max", "u_max_V"),
        )

    def _reciprocal(self) -> list[Define]:
        form = self.form
        if form.divisor == 1:
            return []
        shift = form.reciprocal_shift
        return [
            self._constant(
                "RECIPROCAL", form.reciprocal, f"what the quotient is multiplied by to get counts, times 2^{shift}",
                f"1/{form.divisor}",
                rounding=f"one of those above it that are exact for every quotient up to {form.largest}",
            ),
            self._constant("RECIPROCAL_SHIFT", shift, "the power of two in RECIPROCAL", f"2^{shift}", literal="plain"),
        ]  # fmt: skip

    def _estimate(self) -> list[Define]:
        form, estimate = self.form, self.form.estimate
        d = form.divisor
        if d == 1:
            return []
        short = estimate.factor < 1 << 16
        return [
            self._constant("DIVISOR", d, "what the quotient is divided by to get counts", f"{d} to a count",
                           literal="plain"),
            self._constant("ESTIMATE_SHIFT", estimate.shift, "bits of the dividend that the estimate drops",
                           f"1/2^{estimate.shift}", literal="plain", rounding="rounded down"),
            self._constant("ESTIMATE_FACTOR", estimate.factor, f"1/DIVISOR times 2^{16 + estimate.shift}", f"1/{d}",
                           literal="plain" if short else "uint32", rounding="rounded down"),
            self._constant("CORRECTIONS", estimate.corrections,
                           f"by how much the estimate is too small at most, for a dividend up to {form.largest}",
                           f"{estimate.corrections} counts", literal="plain"),
            *(
                self._constant(f"REST_{step}", d * step, f"remainder from which {step} is missing to the quotient",
                               f"{step} count{'s' * (step > 1)} of {d}", literal="plain")
                for step in range(1, estimate.corrections + 1)
            ),
        ]  # fmt: skip

    def _beta(self) -> list[Define]:
        factor, shift = self.beta_scaling()
        rounding = "rounded up, and proved: dz_beta() is beta * 2^15 rounded down for the whole table"
        where = "codegen/dzdesign/codegen/telemetry/frame.py"
        return [
            self._constant("BETA_FACTOR", factor, f"from the table's beta to multiples of 2^-15, times 2^{shift}",
                           f"2^15/{self.unit}", ("beta_denominator", "beta_step_codes"), rounding=rounding,
                           generator=where),
            self._constant("BETA_SHIFT", shift, "the power of two in BETA_FACTOR", f"2^{shift}", literal="plain",
                           generator=where),
        ]  # fmt: skip

    def beta_scaling(self) -> tuple[int, int]:
        """Return factor and shift that bring the table's beta to the 2^-15 of dz_beta()."""
        return beta_factor(self.unit, max(self.form.table) * self.compensator.beta_step_codes)
