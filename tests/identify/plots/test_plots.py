"""`identify --plots`: what is drawn is what was identified, and the same valve gives the same bytes."""

import dataclasses
import re
import subprocess
import sys

import numpy as np
import pytest
from matplotlib.figure import Figure

from dzdesign.command_line.cli import main
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.plots.style import plot_style, pressure_names
from dzdesign.identify.plots.valve_curves import BOUND_NAME, draw_thresholds
from dzdesign.identify.plots.valve_plots import MOST_POINTS, RESIDUAL_EDGE, draw_figures, plot_files
from tests.support.repeatable_valves import identify_sides
from tests.support.synthetic import L_MIN, Truth, synthetic_ramp

PRESSURES = (0.5, 1.0, 4.0)
HEADER = "time_s,u_V,dP_MPa,Q_Lmin"
#: An SVG larger than this is slow to open and to send.
LARGEST_SVG = 500_000


def ramp_of(dp, **options):
    truth = Truth(knee_rising=5.5 - 0.06 * dp, slope=4 * np.sqrt(dp), floor=0.6)
    return synthetic_ramp(dp, truth, **options)


def with_drop_outs(test, every):
    q = test.q.copy()
    q[::every] = 0.0
    return dataclasses.replace(test, q=q)


def figures_of(found):
    with plot_style():
        return dict(draw_figures(found))


def thresholds_of(curve):
    """Return a side under a premise, and the axes with its thresholds."""
    model = identify_sides([ramp_of(dp) for dp in PRESSURES], IdentifyOptions(curve=curve)).model
    axes = Figure().subplots()
    draw_thresholds(axes, model.positive, model.positive.curve, model.recorded_units)
    return model.positive, axes


def labelled(axes, label):
    """Return the one artist of these axes with this label."""
    artists = [artist for artist in axes.get_children() if artist.get_label() == label]
    assert len(artists) == 1, (label, [artist.get_label() for artist in axes.get_children()])
    return artists[0]


def panel(figure, title):
    return next(axes for axes in figure.axes if axes.get_title("left").startswith(title))


def shown_text(figure):
    return [text for text in figure.findobj(lambda artist: hasattr(artist, "get_fontsize")) if text.get_text()]


@pytest.fixture(scope="module")
def found():
    return identify_sides([with_drop_outs(ramp_of(dp), 97) for dp in PRESSURES])


@pytest.fixture(scope="module")
def figures(found):
    return figures_of(found)


@pytest.fixture(scope="module")
def single():
    """One recording without a pressure drop, and without its falling branch."""
    test = ramp_of(1.0, falling=False)
    return identify_sides([dataclasses.replace(test, dp=None)])


def write_csv(path, test):
    rows = np.column_stack([test.time, test.u, test.dp / 1e6, test.q / L_MIN])
    path.write_text("\n".join([HEADER, *(",".join(f"{value:.4f}" for value in row) for row in rows)]) + "\n")


@pytest.fixture
def bench(tmp_path, monkeypatch, capsys):
    """Two ramp tests in the working folder."""
    monkeypatch.chdir(tmp_path)
    for name, dp in (("a.csv", 1.0), ("b.csv", 4.0)):
        write_csv(tmp_path / name, ramp_of(dp, ramp_s=20, rate_Hz=25))
    return tmp_path


class TestFlow:
    @pytest.mark.slow
    @pytest.mark.parametrize("row", range(len(PRESSURES)))
    @pytest.mark.parametrize("title", ["whole range", "the edge"])
    def test_marks_stand_where_they_were_identified(self, found, figures, row, title):
        test = found.model.positive.tests[row]
        axes = panel(figures[f"flow_{test.dp_MPa:.3g}_MPa"], title)
        for label, u in (
            ("knee opening", test.u_knee_rising_V),
            ("knee closing", test.u_knee_falling_V),
            ("onset opening", test.u_onset_rising_V),
            ("onset closing", test.u_onset_falling_V),
        ):
            assert labelled(axes, label).get_xydata().tolist() == [[u, 0]]
            assert axes.get_xlim()[0] < u < axes.get_xlim()[1]
        assert set(labelled(axes, "certified bound").get_xdata()) == {test.u_guard_lower_V}
        assert set(labelled(axes, "meter's floor").get_ydata()) == {found.model.meter.floor_L_min}

    def test_the_solid_line_spans_the_window_and_the_dashed_one_goes_on_to_the_knee(self, found, figures):
        test, item = found.model.positive.tests[0], found.sides["positive"].described.tests[0]
        axes = panel(figures["flow_0.5_MPa"], "whole range")
        slopes = []
        for column, (name, knee) in enumerate((("opening", test.u_knee_rising_V), ("closing", test.u_knee_falling_V))):
            solid = labelled(axes, f"line {name}")
            ends = [item.shapes[column].y_max / L_MIN * share for share in item.shapes[column].line.window]
            slope = found.sides["positive"].knees.slope[0, column] / L_MIN
            assert solid.get_linestyle() == "-"
            assert solid.get_ydata() == pytest.approx(ends, abs=0.1)
            assert solid.get_ydata() == pytest.approx(slope * (solid.get_xdata() - knee))
            dashed = [
                line for line in axes.lines if line.get_linestyle() == "--" and line.get_color() == solid.get_color()
            ]
            assert len(dashed) == 1
            assert dashed[0].get_xydata()[0] == pytest.approx([knee, 0])
            assert dashed[0].get_xydata()[1] == pytest.approx(solid.get_xydata()[0])
            slopes.append(np.diff(solid.get_ydata()) / np.diff(solid.get_xdata()))
        assert np.mean(slopes) == pytest.approx(test.slope_L_min_V)

    def test_samples_are_the_measured_ones_at_the_nominal_pressure_and_few(self, figures):
        test = with_drop_outs(ramp_of(4.0), 97)
        measured = {tuple(row) for row in np.round(np.column_stack([test.u, test.q / L_MIN]), 6)}
        axes = panel(figures["flow_4_MPa"], "whole range")
        for name, direction in (("opening", 1), ("closing", -1)):
            points = labelled(axes, f"samples {name}")
            assert 500 < points.get_xdata().size <= MOST_POINTS
            assert points.get_rasterized()
            assert {tuple(row) for row in np.round(points.get_xydata(), 6)} <= measured
            assert np.all(direction * np.diff(points.get_xdata()) > 0)

    def test_residuals_have_the_deviation_one_and_every_gated_sample_is_marked(self, found, figures):
        test = found.model.positive.tests[1]
        axes = panel(figures["flow_1_MPa"], "about the straight lines")
        gated = [line for line in axes.lines if line.get_label().startswith("outlier")]
        assert sum(line.get_xdata().size for line in gated) == test.outliers > 30
        assert all(np.all(line.get_ydata() == -RESIDUAL_EDGE) for line in gated)  # drop-outs: far below the line
        used = [line for line in axes.lines if line.get_rasterized() and line not in gated]
        assert len(used) == 2
        for line in used:
            assert np.std(line.get_ydata()) == pytest.approx(1, abs=0.1)
            assert abs(np.mean(line.get_ydata())) < 0.1

    def test_names_have_the_digits_that_tell_pressures_apart(self):
        assert pressure_names(["flow", "flow"], (1.2341, 1.2349)) == ["flow_1.234_MPa", "flow_1.235_MPa"]
        assert pressure_names(["flow"], [None]) == ["flow"]


class TestOverPressure:
    def test_thresholds_are_those_of_the_valve(self, found, figures):
        side = found.model.positive
        axes = figures["thresholds"].axes[0]
        dp = [test.dp_MPa for test in side.tests]
        guard = [test.u_guard_V for test in side.tests]
        bound = [test.u_guard_lower_V for test in side.tests]
        for label, u in (("guarded threshold", guard), ("lower bound, at the test", bound)):
            assert labelled(axes, label).get_xydata().tolist() == np.column_stack([dp, u]).tolist()
        band = labelled(axes, "from lower bound to threshold").get_segments()
        assert np.array(band).tolist() == [[[x, a], [x, b]] for x, a, b in zip(dp, bound, guard, strict=True)]
        bars = {container.get_label(): container for container in axes.containers}
        for name, branch in (("opening", "rising"), ("closing", "falling")):
            for threshold in ("knee", "onset"):
                points, _, (spread,) = bars[f"{threshold} {name} ± 2 s.e."]
                key = f"u_{threshold}_{branch}"
                assert points.get_ydata().tolist() == [getattr(test, f"{key}_V") for test in side.tests]
                ends = np.array(spread.get_segments())[:, :, 1]
                assert np.diff(ends).ravel() == pytest.approx([4 * getattr(test, f"{key}_se_V") for test in side.tests])

    @pytest.mark.parametrize("curve", ["line", "smooth", "monotone"])
    def test_bound_and_offset_are_certified(self, curve):
        side, axes = thresholds_of(curve)
        dp, bound = labelled(axes, BOUND_NAME).get_xydata().T
        assert bound.tolist() == list(side.curve.bound_V) and dp.tolist() == list(side.curve.bound_dp_MPa)
        offset = labelled(axes, "largest certified offset").get_xydata()
        assert offset.tolist() == np.column_stack([side.curve.offset_dp_MPa, side.curve.offset_V]).tolist()
        assert np.all(np.interp(dp, *offset.T) <= bound + 1e-6)

    def test_beta_lies_under_its_bounds(self, found, figures):
        side = found.model.positive
        axes = figures["beta"].axes[0]
        bars = {container.get_label(): container for container in axes.containers}
        for name, found_curve in side.identified.items():
            points, _, (spread,) = bars[f"β(dP) {name} ± 2 s.e."]
            nodes = np.column_stack([found_curve.dp_MPa, found_curve.beta])
            assert points.get_xydata().tolist() == nodes.tolist()
            ends = np.array(spread.get_segments())[:, :, 1]
            assert np.diff(ends).ravel() == pytest.approx([4 * se for se in found_curve.beta_se])
        bound = labelled(axes, "lower bound / u_min0, at the test").get_ydata()
        assert bound * side.reference.u_min_V == pytest.approx([test.u_guard_lower_V for test in side.tests])
        offset = labelled(axes, "largest certified offset / u_min0").get_ydata()
        assert offset * side.reference.u_min_V == pytest.approx(side.curve.offset_V)
        assert labelled(axes, "dP0, where β = 1").get_xydata().tolist() == [[side.reference.dp_MPa, 1]]


class TestOneTest:
    def test_one_branch_without_a_pressure_drop(self, single):
        figures = figures_of(single)
        assert list(figures) == ["flow", "thresholds"]
        labels = {text.get_text() for text in shown_text(figures["flow"])}
        assert "knee opening" in labels
        assert not any("closing" in label for label in labels)
        axes = figures["thresholds"].axes[0]
        test = single.model.positive.tests[0]
        assert labelled(axes, "guarded threshold").get_ydata().tolist() == [test.u_guard_V]
        assert labelled(axes, "largest certified offset").get_ydata() == [single.model.positive.curve.u_min0_V]
        assert axes.get_xticks().size == 0
        assert "not recorded" in axes.get_xlabel()

    def test_one_known_pressure_drop_has_no_plot_of_beta(self):
        assert list(figures_of(identify_sides([ramp_of(1.0)]))) == ["flow_1_MPa", "thresholds"]


class TestReadability:
    @pytest.mark.parametrize("name", ["flow_1_MPa", "thresholds", "beta"])
    def test_axes_have_units_and_no_text_is_small(self, figures, name):
        for axes in figures[name].axes:
            assert not axes.get_xlabel() or re.search(r"\((V|MPa)\)", axes.get_xlabel())
            assert re.search(r"\((V|L/min|σ|no unit)\)", axes.get_ylabel())
            assert axes.get_legend() is None  # all in the figure's, below
        assert min(text.get_fontsize() for text in shown_text(figures[name])) >= 8

    @pytest.mark.slow
    @pytest.mark.parametrize("name", ["flow_1_MPa", "thresholds", "beta"])
    def test_nothing_leaves_the_page_and_the_legend_covers_no_panel(self, figures, name):
        figure = figures[name]
        figure.canvas.draw()
        page, legend = figure.bbox, figure.legends[0].get_window_extent()
        for box in [legend, figure._suptitle.get_window_extent(), *(axes.get_tightbbox() for axes in figure.axes)]:
            assert page.x0 <= box.x0 < box.x1 <= page.x1
            assert page.y0 <= box.y0 < box.y1 <= page.y1
        assert not any(legend.overlaps(axes.get_tightbbox()) for axes in figure.axes)
        assert not any(figure._suptitle.get_window_extent().overlaps(axes.get_tightbbox()) for axes in figure.axes)

    @pytest.mark.slow
    def test_a_file_with_an_odd_name_is_drawn(self):
        name = "ventil_中_$x$_" + 40 * "lang" + ".csv"
        found = identify_sides([ramp_of(1.0, source=name)])
        title = figures_of(found)["flow_1_MPa"]._suptitle
        assert "中_$x$_lang" in title.get_text()
        assert plot_files(found)["flow_1_MPa.png"].startswith(b"\x89PNG")

    def test_a_title_names_the_side_of_a_valve_with_two(self):
        """On either side the axis runs from zero up, so nothing else tells them apart."""
        tests = [ramp_of(dp) for dp in (1.0, 4.0)]
        tests += [
            dataclasses.replace(each, u=-each.u, q=-each.q, source=f"other_{each.source}", sha256="1" * 64)
            for each in tests
        ]
        figures = figures_of(identify_sides(tests))
        assert len(figures) == 8
        for name, figure in figures.items():
            assert f", {name.partition('_')[0]} commands: " in figure._suptitle.get_text().replace("\n", " ")
        one = figures_of(identify_sides(tests[:2]))
        assert not any("commands" in figure._suptitle.get_text() for figure in one.values())


class TestFiles:
    @pytest.mark.slow
    def test_files_are_small_and_say_neither_day_nor_version(self, found):
        files = plot_files(found)
        names = ("flow_0.5_MPa", "flow_1_MPa", "flow_4_MPa", "thresholds", "beta")
        assert list(files) == [f"{name}.{suffix}" for name in names for suffix in ("svg", "png")]
        for name, content in files.items():
            assert not re.search(rb"Matplotlib|Software|dc:date", content), name
            assert len(content) < LARGEST_SVG

    @pytest.mark.slow
    def test_plots_do_not_depend_on_a_users_settings(self, single):
        from matplotlib import rc_context

        expected = plot_files(single)
        with rc_context({"font.size": 20, "axes.facecolor": "black", "svg.hashsalt": None, "savefig.bbox": "tight"}):
            assert plot_files(single) == expected

    @pytest.mark.slow
    def test_the_command_writes_and_overwrites_them(self, bench, capsys):
        argv = ["identify", "a.csv", "b.csv", "-o", "valve.json", "--plots", "deep/plots"]
        assert main(argv) == 0
        assert "plots in deep/plots" in capsys.readouterr().out
        folder = bench / "deep" / "plots"
        before = {path.name: path.read_bytes() for path in folder.iterdir()}
        names = ("flow_1_MPa", "flow_4_MPa", "thresholds", "beta")
        assert sorted(before) == sorted(f"{name}.{suffix}" for name in names for suffix in ("svg", "png"))
        (folder / "beta.svg").write_text("older")
        (folder / "notes.txt").write_text("mine")
        assert main(argv) == 0
        after = {path.name: path.read_bytes() for path in folder.iterdir()}
        assert after == {**before, "notes.txt": b"mine"}

    @pytest.mark.slow
    def test_two_processes_write_the_same_bytes(self, bench):
        contents = []
        code = "import sys; from dzdesign.command_line.cli import main; sys.exit(main(sys.argv[1:]))"
        for folder, seed in (("one", "1"), ("two", "2")):
            subprocess.run(
                [sys.executable, "-c", code, "identify", "a.csv", "-o", "valve.json", "--plots", folder],
                cwd=bench, check=True, capture_output=True, env={"PYTHONHASHSEED": seed, "HOME": str(bench)},
            )  # fmt: skip
            contents.append({path.name: path.read_bytes() for path in (bench / folder).iterdir()})
        assert contents[0] == contents[1]
        assert contents[0]

    @pytest.mark.slow
    def test_without_the_option_nothing_is_drawn(self, bench):
        code = (
            "import sys; from dzdesign.command_line.cli import main; main(['identify', 'a.csv', '--json']); "
            "print('matplotlib' in sys.modules, file=sys.stderr)"
        )
        done = subprocess.run([sys.executable, "-c", code], cwd=bench, capture_output=True, text=True, check=True)
        assert done.stderr.splitlines()[-1] == "False"
        assert {path.name for path in bench.iterdir()} == {"a.csv", "b.csv", "valve.json"}


class TestBadFolder:
    def test_a_link_to_nothing_is_refused_before_anything_is_done(self, bench, capsys):
        (bench / "loose").symlink_to("nowhere")
        before = {path.name for path in bench.iterdir()}
        assert main(["identify", "a.csv", "-o", "valve.json", "--plots", "loose"]) == 2
        assert re.search("'loose' is a link.*--plots", capsys.readouterr().err)
        assert {path.name for path in bench.iterdir()} == before

    @pytest.mark.slow
    def test_a_folder_in_the_place_of_a_plot_is_left_alone(self, bench, capsys, wording):
        (bench / "plots" / "thresholds.svg").mkdir(parents=True)
        assert main(["identify", "a.csv", "-o", "valve.json", "--plots", "plots"]) == 2
        wording.of_test(capsys.readouterr().err)
        assert (bench / "plots" / "thresholds.svg").is_dir()


def test_plots_of_identify_assess_and_the_report_share_one_style():
    """Only what a page needs differs: no background, text as text, and sizes for a narrower figure."""
    import matplotlib as mpl

    from dzdesign.identify.plots.style import STYLE, plot_style
    from dzdesign.report.figure import figure_style

    with plot_style():
        in_files = dict(mpl.rcParams)
    with mpl.rc_context({"lines.linewidth": 7}), figure_style():  # a matplotlibrc of the user's changes nothing
        on_the_page = dict(mpl.rcParams)
    differing = {name for name, value in in_files.items() if on_the_page[name] != value}
    assert differing == {"axes.facecolor", "axes.titlesize", "xtick.labelsize", "ytick.labelsize", "legend.fontsize",
                         "svg.fonttype"}  # fmt: skip
    assert all(in_files[name] == value for name, value in STYLE.items() if name != "font.family")
