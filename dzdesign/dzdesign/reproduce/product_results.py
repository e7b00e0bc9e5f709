"""Table (B): the product on the paper's valves, beside what the paper prints and the ideal line."""

from collections.abc import Iterator

from dzdesign.derivation.account.published import DP1_MPA, LARGEST_CODE
from dzdesign.reproduce.artefact import ProductResult
from dzdesign.reproduce.law_numbers import DIGITS, METER_L_MIN, ONE_RECORD_PERCENT, PRINTED_NONE_L_MIN, around
from dzdesign.reproduce.recovered_valves import METER_START_L_MIN, printed_at
from dzdesign.reproduce.runs import DIRECT, PRESSURES_MPA, PRODUCT, WITHOUT_BETA, ValveRuns

#: By how much the end of the product's transition may lie off the opening threshold, and with it its dead zone off the
#: ideal line: four codes of the command, in percent of full command.
OF_TRANSITION_PERCENT = 400 / int(LARGEST_CODE)


def product_results(valves: list[ValveRuns]) -> Iterator[ProductResult]:
    """Yield the product on each recovered valve at each pressure drop."""
    for runs in valves:
        for dp_MPa in PRESSURES_MPA:
            yield _result(runs, dp_MPa)


def _result(runs: ValveRuns, dp_MPa: float) -> ProductResult:
    valve, printed = runs.valve.published, printed_at(runs.valve.published, dp_MPa)
    without, dead_zone = (runs.dead_zone_percent(drive, dp_MPa) for drive in (DIRECT, PRODUCT))
    largest, zero = runs.largest_L_min(PRODUCT, dp_MPa), runs.zero_L_min(PRODUCT, dp_MPa)
    line = 100 * METER_START_L_MIN / float(printed.flow)
    seen, flow = around(printed.dead_zone_percent, ONE_RECORD_PERCENT), around(printed.flow, METER_L_MIN)
    faults = {
        "the recovered valve has another dead zone": seen[0] <= without <= seen[1],
        "flow passes at zero command": zero <= PRINTED_NONE_L_MIN,
        "the dead zone is not that of the ideal line": abs(dead_zone - line) <= OF_TRANSITION_PERCENT,
        "the largest flow is another": flow[0] <= largest <= flow[1],
    }
    return ProductResult(
        valve=valve.name,
        dp_MPa=dp_MPa,
        published_without=printed.dead_zone_percent,
        without=round(without, DIGITS),
        published=valve.residual_percent,
        dead_zone=round(dead_zone, DIGITS),
        ideal_line=round(line, DIGITS),
        published_zero=valve.zero_flow_without_beta if dp_MPa == DP1_MPA else "",
        zero_L_min=round(zero, DIGITS),
        zero_without_beta_L_min=round(runs.zero_L_min(WITHOUT_BETA, dp_MPa), DIGITS),
        published_largest=printed.flow,
        largest_L_min=round(largest, DIGITS),
        faults=tuple(fault for fault, right in faults.items() if not right),
    )
