"""What is read from the paper's numbers (`published.py`) and is not printed itself."""

import sympy

from dzdesign.derivation.account.published import DP1_MPA, METER_ACCURACY_PERCENT, METER_RANGE_L_MIN

#: Accuracy of the flow meter, of its range.
METER_ACCURACY_L_MIN = sympy.Rational(METER_RANGE_L_MIN) * sympy.Rational(METER_ACCURACY_PERCENT) / 100
#: Where a number of the second valve depends on it.
DROP_ASSUMED = f"at {DP1_MPA} MPa, which the paper does not say of this valve"
