"""The function of other designs: without a transition, of another law, with unlike and inverted signals."""

import pytest

from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.test_vectors import PreparedInputs
from dzdesign.verify.matlab import operations
from dzdesign.verify.matlab.checks import NAMES, judged_in_octave
from dzdesign.verify.matlab.operations import corner_inputs, operations_check
from dzdesign.verify.matlab.subset import read_functions
from tests.support.core_variants import variant
from tests.support.octave import OCTAVE, needs_octave, output_of, sampled_codes, written
from tests.support.synthetic import needs_compiler

DESIGNS = ("no transition", "target law, no transition", "live zero", "inverted", "bipolar, all options")


@pytest.fixture
def some(monkeypatch):
    """Let the inputs be some of them."""
    thinned = lambda prepared: tuple(each[::7] for each in corner_inputs(prepared))  # noqa: E731
    monkeypatch.setattr(operations, "corner_inputs", thinned)


@pytest.mark.slow
@pytest.mark.parametrize("name", DESIGNS)
def test_no_operation_leaves_its_class_and_the_text_is_the_exact_law(name, some):
    made = variant(name)
    files = output_of(made).files
    for sign in made.signals.signs:
        function = read_functions(files[f"{NAMES[sign]}.m"].decode(), f"{NAMES[sign]}.m")[0]
        check = operations_check(function, PreparedInputs(ExactLaw(made, sign)))
        assert check.holds, check.text


@needs_octave
@needs_compiler
@pytest.mark.slow
@pytest.mark.parametrize(("name", "sign"), [("live zero", 1), ("bipolar, all options", -1)])
def test_it_is_the_exact_law_in_octave_on_a_sample(name, sign, tmp_path):
    made = variant(name)
    folder = written(made, tmp_path / "matlab")
    with sampled_codes(folder, made, sign) as asked:
        found = judged_in_octave(OCTAVE, NAMES[sign], (folder / f"{NAMES[sign]}.m").read_bytes(), asked)
        assert found.faults == 0 and found.outputs_hash == asked.compiled.outputs_hash
