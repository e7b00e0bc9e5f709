"""The requirements that verification consists of, each with the figures in a sentence."""

from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from typing import Any

from dzdesign.core.artefact_files import TOOL, sha256_of
from dzdesign.core.errors import InputError, RequirementError, and_more
from dzdesign.core.units import span_MPa
from dzdesign.design.certificate import prove_certificates
from dzdesign.design.compensator import Compensator
from dzdesign.design.redesign_check import prove_derived
from dzdesign.identify.valve.model import ValveModel
from dzdesign.verify.closed_loop.loop import NO_FLOW_L_MIN, LoopComparison
from dzdesign.verify.closed_loop.plant import Plant
from dzdesign.verify.closed_loop.scenarios import ScenarioResult
from dzdesign.verify.exhaustive.all_inputs import InputCheck
from dzdesign.verify.exhaustive.drive_check import SEED, CompiledDrive, PreparedDrive
from dzdesign.verify.exhaustive.lot_check import NAMED
from dzdesign.verify.toolchain.host_compiler import check_strictly, find_compilers

#: Share of full command by which the opening of a plant may differ from the identified valve's: rounding, a quick ramp.
SAME_THRESHOLD = 0.03
#: Endings of C, C++, assembly, of what they include, of linker files and of projects.
SOURCES = {
    ".c", ".h", ".cc", ".cpp", ".cxx", ".hh", ".hpp", ".hxx", ".inc", ".inl", ".s", ".sx", ".asm", ".ld", ".lds",
    ".lcf", ".cmd", ".icf", ".sct", ".def", ".mk", ".mak", ".cmake", ".projectspec", ".ccxml", ".gel", ".syscfg",
    ".ioc", ".uvprojx", ".ewp", ".cproj", ".vcxproj",
}  # fmt: skip
#: Folder of a firmware for files of the user's own, beside those that were generated.
OWN = "board"
#: Endings of precompiled headers, files or folders: a compiler takes one in place of the header beside it.
PRECOMPILED = (".gch", ".pch", ".pcm")
BUILD_FILES = {"makefile", "gnumakefile", "cmakelists.txt", "meson.build", ".project", ".cproject", ".ccsproject"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """One requirement: its name, whether it holds (None: it could not be checked), and the figures in a sentence."""

    name: str
    holds: bool | None
    text: str


def files_unchanged(folder: Path, manifest: dict[str, Any]) -> Check:
    """Tell which generated files differ from the manifest: what is checked must be what was generated."""
    changed = [
        name
        for name, digest in manifest["files"].items()
        if not (folder / name).is_file() or sha256_of((folder / name).read_bytes()) != digest
    ]
    board = set(manifest.get("board", ()))
    filled_in, changed = ([name for name in changed if (name in board) is yours] for yours in (True, False))
    present = [f"core/{path.name}" for path in sorted((folder / "core").glob("*.[ch]"))]
    foreign = [name for name in present if name not in manifest["files"]]
    unlisted = [name for name in present if name in manifest["files"] and name not in manifest["core"]]
    ours = {PurePosixPath(name).name for name in manifest["files"]}
    built = _cmake_trees(folder, manifest)
    others = [
        path.relative_to(folder).as_posix()
        for path in sorted(folder.rglob("*"))
        if _is_source(path) and not built.intersection(path.parents)
    ]
    others = [name for name in others if name not in manifest["files"]]
    shadows = [name for name in others if _header_of(PurePosixPath(name).name) in ours]
    own = own_files(folder, manifest)
    others = [name for name in others if name not in own]
    claimed = [name for name in sorted(board) if not _may_be_filled_in(name, manifest)]
    if claimed:
        fault = f"the manifest calls {', '.join(claimed)} the user's to fill in, which is none of a target's files"
    elif changed:
        fault = f"changed or missing: {', '.join(changed)}"
    elif foreign:
        fault = f"{', '.join(foreign)}: not generated; core/ is the compensator alone, keep files of your own in {OWN}/"
    elif unlisted or not manifest["core"]:
        fault = f"the manifest does not name {', '.join(unlisted) or 'any file of the core'}"
    elif shadows:
        fault = f"{', '.join(shadows)}: not generated, but named as a generated file, for which it may be taken"
    elif others:
        fault = f"the manifest does not name {', '.join(others)}; keep source and project files of your own in {OWN}/, "
        fault += "beside core/, or outside"
    else:
        fault = ""
    text = fault or f"{len(manifest['files']) - len(filled_in)} files as generated"
    if filled_in and not fault:
        text += f"; yours, changed, and not checked: {', '.join(filled_in)}"
    if own and not fault:
        text += f"; yours, in {OWN}/, and not checked: {and_more(own, NAMED)}"
    if built and not fault:
        text += f"; built by CMake, and not checked: {', '.join(sorted(tree.name for tree in built))}"
    return Check(name="files as generated", holds=not fault, text=text)


def _header_of(name: str) -> str:
    """Return the name under which a compiler looks for a file: a precompiled header's is the header's."""
    for ending in PRECOMPILED:
        name = name.removesuffix(ending)
    return name


def own_files(folder: Path, manifest: dict[str, Any]) -> list[str]:
    """Return the files of the user's own: those in the folder kept for them, in which nothing is generated.

    Parameters
    ----------
    folder : Path
        Of the firmware.
    manifest : dict
        Of `read_firmware_manifest`.
    """
    found = [path.relative_to(folder).as_posix() for path in sorted((folder / OWN).rglob("*")) if _is_source(path)]
    return [name for name in found if name not in manifest["files"]]


def _may_be_filled_in(name: str, manifest: dict[str, Any]) -> bool:
    """Tell whether a file can be its user's: listed, and in a target's folder, not of the core."""
    folder, slash, _ = name.partition("/")
    return bool(slash) and folder != "core" and name in manifest["files"] and name not in manifest["core"]


def _cmake_trees(folder: Path, manifest: dict[str, Any]) -> set[Path]:
    """Return the folders in which CMake has built, with makefiles and C of its own, and in which nothing is ours."""
    ours = {parent for name in manifest["files"] for parent in (folder / name).parents}
    return {path.parent for path in folder.rglob("CMakeCache.txt")} - ours - {folder}


def _is_source(path: Path) -> bool:
    """Tell whether a compiler, a linker or a build reads a file; what they write may lie about."""
    if path.name.lower().endswith(PRECOMPILED):
        return True
    return path.is_file() and (path.suffix.lower() in SOURCES or path.name.lower() in BUILD_FILES)


def certificate_follows(compensator: Compensator) -> Check:
    """Tell whether what the header promises follows from the valve that the compensator was made from."""
    name = "the certificate follows from the valve"
    try:
        prove_certificates(compensator)
    except InputError as error:
        return Check(name=name, holds=False, text=str(error))
    certificate = compensator.positive.certificate
    common = f"of {compensator.common_valves} valves the one in compensator.json: " if compensator.common_valves else ""
    return Check(
        name=name,
        holds=True,
        text=f"{common}the {certificate.guard} threshold's {100 * certificate.confidence:.6g}% lower bound, "
        f"{span_MPa(*map(float, certificate.dp_MPa))}, proved again at every difference of pressure codes",
    )


def law_follows(compensator: Compensator, document: dict[str, Any]) -> Check:
    """Tell whether designing again gives the same numbers, which a file without its options does not let anyone do.

    Parameters
    ----------
    compensator : Compensator
    document : dict
        Its file. Another version of dzdesign may have chosen other tables, and none the worse.
    """
    name = "the law follows from the valve and the options"
    if compensator.request is None:
        text = "compensator.json does not say for which target and with which options it was designed, so no number of "
        return Check(name=name, holds=None, text=f"{text}it can be derived again; make it again with `dzdesign design`")
    try:
        prove_derived(compensator)
    except InputError as error:
        version = document.get("tool", {}).get("version")
        known = version == TOOL["version"]
        text = str(error) if known else f"designed by dzdesign {version}, and this is {TOOL['version']}: {error}"
        return Check(name=name, holds=False if known else None, text=text)
    target = compensator.request.target.name
    text = f"designed again from the valve and the options in compensator.json, for {target}: every number the same"
    return Check(name=name, holds=True, text=text)


def drive_follows(folder: Path, compensator: Compensator) -> Check:
    """Tell whether the drive around the law does what its model in rational numbers does."""
    name, prepared = "the drive follows its model", PreparedDrive(compensator)
    try:
        found = CompiledDrive(folder).check(prepared)
    except RequirementError as error:
        return Check(name=name, holds=False, text=str(error))
    text = f"outputs and state after each of {found.ticks} PWM periods, {len(prepared.samples)} samples of corners, "
    text += f"steps, noise and random codes (seed {SEED}): {found.wrong} wrong"
    text += f" ({found.first_wrong})" if found.wrong else ""
    return Check(name=name, holds=found.wrong == 0, text=text)


def compiles_strictly(folder: Path, manifest: dict[str, Any]) -> Check:
    """Tell whether every compiler on this machine takes the core with every warning an error."""
    compilers = find_compilers()
    try:
        for compiler in compilers:
            for name in manifest["core"]:
                if name.endswith(".c"):
                    check_strictly(folder / name, compiler)
    except RequirementError as error:
        return Check(name="compiles without a warning", holds=False, text=str(error))
    names = ", ".join(sorted({Path(compiler).name for compiler in compilers}))
    return Check(
        name="compiles without a warning",
        holds=True,
        text=f"-std=c99 -Wall -Wextra -Wconversion -Wpedantic -Werror: {names}",
    )


def lot_checked(inputs: tuple[InputCheck, ...], document: dict[str, Any]) -> list[Check]:
    """Tell whether the core of a common setting over-compensates any valve of its lot; nothing of a valve's own.

    Parameters
    ----------
    inputs : tuple of InputCheck
        One a sign of command.
    document : dict
        compensator.json.
    """
    name, count = "no over-compensation of any valve of the lot", document.get("common_valves", 0)
    if not count:
        return []
    found = [each.lot for each in inputs if each.lot is not None]
    if not found:
        text = f"compensator.json is of {count} valves and holds the bounds of one; run `dzdesign batch` again, and "
        return [Check(name=name, holds=None, text=f"{text}make the firmware from its common_compensator.json")]
    worst = min(found, key=lambda each: each.smallest_margin_V)
    least, most = (f"{100 * ends:.6g}" for ends in worst.confidence)
    text = (
        f"{min(each.valves for each in found)} of {count} valves, each at every difference of pressure codes that it "
        f"was tested over, against its own bounds ({least if least == most else f'{least} to {most}'} % for each): "
    )
    over = list(dict.fromkeys(name for each in found for name in each.over_compensated))
    text += f"{len(over)} over-compensated" + (f": {and_more(over, NAMED)}" if over else "")
    text += f"; smallest margin of the C's compare values {1e3 * worst.smallest_margin_V:.3f} mV: {worst.worst}, "
    text += f"{worst.worst_dp_MPa:.2f} MPa"
    all_there = all(each.valves == count for each in found)
    return [Check(name=name, holds=not over and all_there, text=text)]


def input_checks(inputs: InputCheck, both: bool) -> list[Check]:
    """Return one requirement per property of the input check; of two sides each says which."""
    found = inputs.first_wrong or ""
    checks = [
        Check(
            name="equals the exactly rounded law",
            holds=inputs.wrong == 0,
            text=f"{inputs.inputs} inputs checked, {inputs.wrong} wrong" + (f" ({found})" if found else "")
            + f"; hash of all compare values {inputs.outputs_hash}, object {inputs.object_sha256}",
        ),
        Check(
            name="within range, monotone",
            holds=not (inputs.out_of_range or inputs.not_monotone_in_u or inputs.not_monotone_in_dp),
            text=f"{inputs.out_of_range} out of range, {inputs.not_monotone_in_u} falls with rising command, "
            f"{inputs.not_monotone_in_dp} steps against the law in dP",
        ),
        Check(
            name="no over-compensation on the tested interval",
            holds=inputs.over_compensated == 0,
            text=f"{inputs.over_compensated} pressure codes above the threshold's lower bound, "
            f"smallest margin of the C's compare values {1e3 * inputs.smallest_margin_V:.3f} mV",
        ),
        Check(
            name="depends on the pressures by their difference only",
            holds=inputs.odd_pairs == 0,
            text=f"{inputs.odd_pairs} of {inputs.pressure_pairs} pairs of pressure codes differ (the commands of each "
            "difference take its pairs in turn; at zero command all pairs that the law follows or that lie outside the "
            "sensors' valid range)",
        ),
        Check(
            name="codes outside their signal's valid range fall back",
            holds=not (inputs.bad_fallbacks or inputs.bad_status or inputs.bad_betas),
            text=f"{inputs.bad_fallbacks} such codes without the safe value, {inputs.bad_status} "
            f"status words that say otherwise, {inputs.bad_betas} values of dz_beta() that are not the law's",
        ),
    ]
    label = ("positive" if inputs.sign > 0 else "negative") + " commands: " if both else ""
    return [replace(check, name=label + check.name) for check in checks]


def plant_opens(loops: tuple[LoopComparison, ...]) -> Check:
    """Tell whether flow passes at full command: of a plant that stays shut, or whose motion is not finite, the other
    figures of the closed loop say nothing."""
    least = min(loops, key=lambda loop: loop.result.q_max_L_min).result
    return Check(
        name="the plant of the closed loop opens",
        holds=least.q_max_L_min > NO_FLOW_L_MIN,
        text=f"{least.q_max_L_min:.4g} L/min at full command and {least.dp_MPa:.2f} MPa, where it is least",
    )


def plant_is_the_valve(loops: tuple[LoopComparison, ...], valve: ValveModel) -> Check:
    """Tell whether the plant opens where the ramp tests say that the valve does."""

    def opens_V(loop: LoopComparison) -> tuple[float, float]:
        tests = valve.sides[loop.result.side].tests
        test = min(tests, key=lambda test: abs((test.dp_MPa or 0.0) - loop.result.dp_MPa))
        known = test.u_guard_V if test.u_knee_rising_V is None else test.u_knee_rising_V
        return loop.result.dead_zone_opening * valve.u_max_V, known

    loop = max(loops, key=lambda loop: abs(float.__sub__(*opens_V(loop))))
    plant_V, valve_V = opens_V(loop)
    holds = abs(plant_V - valve_V) <= SAME_THRESHOLD * valve.u_max_V
    text = f"at {plant_V:.2f} V, the ramp tests at {valve_V:.2f} V (at {loop.result.dp_MPa:.2f} MPa, the worst)"
    if not holds:
        text += "; the closed loop is of another valve: correct preload, spring or force in --plant"
    return Check(name="the plant opens where the identified valve does", holds=holds, text=text)


def no_flow_at_zero(loops: tuple[LoopComparison, ...], document: dict[str, Any], plant: Plant | None) -> Check:
    """Tell whether the valve is shut at zero command, after closing."""
    name = "no flow at zero command in the closed loop"
    worst = max(loops, key=lambda loop: loop.result.q_zero_L_min).result
    designed = {side_name: side["certificate"]["guard"] for side_name, side in document["sides"].items() if side}
    chosen = [
        guard
        for side_name, guard in designed.items()
        if guard != document["valve"]["sides"][side_name]["certificate"]["guard"]
    ]
    if chosen:
        return Check(
            name=name,
            holds=None,
            text=f"the {chosen[0]} threshold was chosen to be guarded, above the one at which the valve closes: "
            f"{worst.q_zero_L_min:.4g} L/min after closing (at {worst.dp_MPa:.2f} MPa) is the price of that choice. "
            "Design with --guard closing to have none",
        )
    if plant is None and "opening" in designed.values():
        return Check(
            name=name,
            holds=None,
            text="no falling branch was recorded, so where the valve closes is not known; valves close below where "
            "they open, and flow at zero command after closing is to be expected. Record the falling branch",
        )
    return Check(
        name=name,
        holds=worst.q_zero_L_min <= NO_FLOW_L_MIN,
        text=f"at most {worst.q_zero_L_min:.4g} L/min after closing (at {worst.dp_MPa:.2f} MPa), "
        f"{max(loop.result.q_zero_without_beta_L_min for loop in loops):.3g} L/min without beta",
    )


def shut_after_scenarios(scenarios: tuple[ScenarioResult, ...], ramps: Check, plant: Plant | None) -> Check:
    """Tell whether the valve is shut at zero command after everything that a core can know of, and what it can't."""
    name = "no flow at zero command after any scenario"
    required = [each for each in scenarios if each.must_shut]
    worst = max(required, key=lambda each: each.q_zero_L_min)
    text = f"{len(required)} runs of {len({each.name for each in required})} scenarios: at most "
    text += f"{worst.q_zero_L_min:.4g} L/min ({worst.name}, at {worst.dp_MPa:.2f} MPa)"
    if hidden := [each for each in scenarios if not each.must_shut]:
        leak = max(hidden, key=lambda each: each.q_zero_L_min)
        text += f"; not required, as no core can know: {leak.name}, {leak.q_zero_L_min:.2g} L/min"
    if plant is None:
        text += "; load steps and frozen sensors were not tried, which needs a plant (--plant)"
    if ramps.holds is None:
        return Check(name=name, holds=None, text=f"{text}; see the ramps")
    return Check(name=name, holds=worst.q_zero_L_min <= NO_FLOW_L_MIN, text=text)
