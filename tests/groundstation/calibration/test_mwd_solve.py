"""Calibration of synthetic MWD tools: derivatives of the cost, convergence, reach, and what must be refused."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.calibration.mwd_cost import Problem
from groundstation.calibration.mwd_design import parameter_covariance, refuse_open
from groundstation.calibration.mwd_model import nominal_triad, tool_face, vectors_of_volts
from groundstation.calibration.mwd_newton import free_parameter_matrix, minimise_cost, newton_step
from groundstation.calibration.mwd_record import accelerometer_record, magnetometer_record
from groundstation.calibration.mwd_solve import solve_accelerometers, solve_magnetometers
from sim.instruments.mwd_jig import DIP, FIELD, Heating, MwdTool, draw_tool, make_design, measure_tool
from sim.studies.mwd.run import ToolOutcome, calibrate_tool, run_study
from telemetry.errors import CalibrationError

TOOLS = 20
FEW = 5  # of them in `make test`
DESIGNS = [Heating.ROOM, Heating.SHUFFLED, Heating.ALTERNATING]


@pytest.fixture(scope="module", params=[FEW, pytest.param(TOOLS, marks=pytest.mark.statistical)])
def outcomes(request: pytest.FixtureRequest) -> dict[Heating, list[ToolOutcome]]:
    """Every tool at every design; a tool that did not converge would raise here."""
    everything = [*DESIGNS, Heating.SINGLE_RAMP]
    return {h: [calibrate_tool(draw_tool(seed), h, seed) for seed in range(1, request.param + 1)] for h in everything}


def problem_of(heating: Heating, seed: int = 1, axes: str = "ABC") -> Problem:
    tool, design = draw_tool(seed), make_design(heating, seed)
    record = measure_tool(tool, design, seed)
    if axes == "ABC":
        made = accelerometer_record(record.gravity_volts, record.temperature, design.tilt)
    else:
        gravity = vectors_of_volts(tool.accelerometers, record.gravity_volts, record.temperature)
        made = magnetometer_record(record.field_volts, record.temperature, gravity, FIELD, DIP)
    return made.problem(12 if heating is Heating.ROOM else 30)


def numbers(problem: Problem, seed: int = 5) -> np.ndarray:
    return 0.01 * np.random.default_rng(seed).standard_normal(12 if problem.powers == 1 else 30)


@pytest.mark.parametrize("axes", ["ABC", "XYZ"])
@pytest.mark.parametrize("heating", [Heating.ROOM, Heating.SHUFFLED])
def test_gradient_hessian_and_jacobian_are_those_of_finite_differences(heating: Heating, axes: str) -> None:
    problem = problem_of(heating, axes=axes)
    x, h = numbers(problem), 1e-6
    terms, jacobian = problem.terms(x), problem.residual_jacobian(x)
    steps = h * np.eye(len(x))
    gradient = np.array([problem.value(x + e) - problem.value(x - e) for e in steps]) / (2.0 * h)
    hessian = np.array([problem.terms(x + e).gradient - problem.terms(x - e).gradient for e in steps]) / (2.0 * h)
    columns = np.array([problem.residuals(x + e) - problem.residuals(x - e) for e in steps]).T / (2.0 * h)
    assert np.allclose(terms.gradient, gradient, rtol=1e-6, atol=1e-7)
    assert np.allclose(terms.hessian, hessian, rtol=1e-6, atol=2e-6)
    assert np.allclose(jacobian, columns, rtol=1e-6, atol=1e-8)
    assert np.allclose(terms.normal, jacobian.T @ jacobian, rtol=1e-11, atol=1e-11)
    assert np.allclose(terms.gradient, 2.0 * jacobian.T @ problem.residuals(x), rtol=1e-10, atol=1e-11)
    assert problem.value(x) == pytest.approx(float(np.sum(problem.residuals(x) ** 2)), rel=1e-12)


def test_derivatives_are_finite_and_smooth_on_the_axis() -> None:
    design = make_design(Heating.ROOM)
    upright = np.where(design.tilt < 1.0, 0.0, math.pi)
    exact = np.column_stack([0.0 * upright, 0.0 * upright, np.cos(upright)])
    w = exact * np.array([1.0, 1.0, -1.0])
    problem = accelerometer_record(3.0 * w, design.temperature, upright).problem(12)
    x = np.zeros(12)
    steps = 1e-5 * np.eye(12)
    hessian = np.array([problem.terms(x + e).gradient - problem.terms(x - e).gradient for e in steps]) / 2e-5
    assert np.allclose(problem.terms(x).hessian, hessian, atol=1e-6)


@pytest.mark.parametrize(("heating", "count"), [(Heating.ROOM, 12), (Heating.SHUFFLED, 30)])
def test_one_direction_is_open_for_accelerometers_and_none_for_magnetometers(heating: Heating, count: int) -> None:
    ideal, design = MwdTool(nominal_triad("ABC", 3.0), nominal_triad("XYZ", 0.06)), make_design(heating, 1)
    record = measure_tool(ideal, design, 1, noise=0.0, jig_std=0.0)
    gravity = vectors_of_volts(ideal.accelerometers, record.gravity_volts, record.temperature)
    accelerometers = accelerometer_record(record.gravity_volts, record.temperature, design.tilt).problem(count)
    magnetometers = magnetometer_record(record.field_volts, record.temperature, gravity, FIELD, DIP).problem(count)
    at_truth = np.zeros(count)
    roll = np.zeros(count)
    roll[count - 6], roll[count - 4] = 1.0, -1.0  # m_AB and m_BA against each other
    assert parameter_covariance(accelerometers, at_truth, np.eye(count)) is None
    assert parameter_covariance(accelerometers, at_truth, free_parameter_matrix(count, "ABC")) is not None
    assert parameter_covariance(magnetometers, at_truth, free_parameter_matrix(count, "XYZ")) is not None
    assert np.max(np.abs(accelerometers.terms(at_truth).hessian @ roll)) < 1e-12
    assert np.linalg.norm(magnetometers.terms(at_truth).hessian @ roll) > 1.0


def test_the_hessian_is_indefinite_at_the_start_and_the_step_leads_down_all_the_same() -> None:
    indefinite = 0
    for seed in range(TOOLS):
        problem, free = problem_of(Heating.SINGLE_RAMP, seed), free_parameter_matrix(30, "ABC")
        terms = problem.terms(np.zeros(30))
        indefinite += np.linalg.eigvalsh(free.T @ terms.hessian @ free)[0] < 0.0
        assert terms.gradient @ free @ newton_step(terms, free) < 0.0
    assert indefinite > TOOLS // 2


@pytest.mark.slow
@pytest.mark.parametrize("heating", DESIGNS)
def test_good_designs_converge_within_ten_iterations(outcomes: dict, heating: Heating) -> None:
    for outcome in outcomes[heating]:
        assert outcome.accelerometers.iterations <= 10
        assert outcome.magnetometers.iterations <= 10


@pytest.mark.parametrize(
    ("heating", "size", "tilt_deg"),
    [(Heating.ROOM, 2e-4, 0.01), (Heating.SHUFFLED, 6e-4, 0.03)],
)
def test_reach_on_four_hundred_fresh_attitudes(outcomes: dict, heating: Heating, size: float, tilt_deg: float) -> None:
    before = np.median([o.before for o in outcomes[heating]], axis=0)
    assert before[0] == pytest.approx(0.044, abs=0.010)
    assert before[1] == pytest.approx(1.8, abs=0.4)
    for outcome in outcomes[heating]:
        assert outcome.after[0] <= size
        assert outcome.after[1] <= tilt_deg


def test_a_single_ramp_is_ten_times_worse_and_says_so(outcomes: dict) -> None:
    good, poor = outcomes[Heating.SHUFFLED], outcomes[Heating.SINGLE_RAMP]
    assert np.median([o.after[0] for o in poor]) > 5.0 * np.median([o.after[0] for o in good])
    assert all("poor design" in o.accelerometers.warnings[0] for o in poor)
    assert not any(o.accelerometers.warnings for h in DESIGNS for o in outcomes[h])


@pytest.mark.parametrize("heating", DESIGNS)
def test_control_fails_before_and_passes_after(outcomes: dict, heating: Heating) -> None:
    assert not any(o.passed_before for o in outcomes[heating])
    assert all(o.passed_after for o in outcomes[heating])


@pytest.mark.slow
@pytest.mark.parametrize("tools", [1, pytest.param(FEW, marks=pytest.mark.statistical)])
@pytest.mark.parametrize("heating", [*DESIGNS, Heating.SINGLE_RAMP])
def test_an_independent_solver_ends_in_the_same_minimum(heating: Heating, tools: int) -> None:
    from scipy.optimize import least_squares

    for seed in range(1, tools + 1):
        problem = problem_of(heating, seed)
        free = free_parameter_matrix(12 if problem.powers == 1 else 30, "ABC")
        cost = problem.value(minimise_cost(problem, free)[0])
        other = least_squares(lambda y, p=problem, z=free: p.residuals(z @ y), np.zeros(free.shape[1]))
        assert cost == pytest.approx(2.0 * other.cost, rel=1e-4)


def test_without_noise_the_coefficients_come_back_themselves() -> None:
    tool, design = draw_tool(4), make_design(Heating.SHUFFLED, 4)
    record = measure_tool(tool, design, 4, noise=0.0, jig_std=0.0)
    fit = solve_accelerometers(
        record.gravity_volts, record.temperature, design.tilt, tool_face_reference=design.tool_face
    )
    for name, value in tool.accelerometers.coefficients().items():
        assert fit.coefficients[name] == pytest.approx(value, abs=1e-8), name
    gravity = vectors_of_volts(fit.triad, record.gravity_volts, record.temperature)
    field = solve_magnetometers(record.field_volts, record.temperature, gravity, FIELD, DIP)
    for name, value in tool.magnetometers.coefficients().items():
        assert field.coefficients[name] == pytest.approx(value, abs=1e-6), name


def test_a_tool_face_reference_turns_the_triad_onto_it() -> None:
    tool, design = draw_tool(6), make_design(Heating.SHUFFLED, 6)
    record = measure_tool(tool, design, 6)
    plain = solve_accelerometers(record.gravity_volts, record.temperature, design.tilt)
    held = solve_accelerometers(
        record.gravity_volts, record.temperature, design.tilt, tool_face_reference=design.tool_face + 0.1
    )
    assert plain.coefficients["m_AB"] == pytest.approx(plain.coefficients["m_BA"], abs=1e-15)
    level = np.sin(design.tilt) > 0.5
    seen = tool_face(vectors_of_volts(held.triad, record.gravity_volts, record.temperature))[level]
    assert np.max(np.abs(np.angle(np.exp(1j * (seen - design.tool_face[level] - 0.1))))) < 2e-3
    assert held.cost == plain.cost


@pytest.mark.slow
def test_standard_errors_are_what_repetition_scatters() -> None:
    tool, design = draw_tool(2), make_design(Heating.ROOM)
    fits = []
    for seed in range(60):
        record = measure_tool(tool, design, seed)
        fits.append(solve_accelerometers(record.gravity_volts, record.temperature, design.tilt, 12))
    claimed = np.mean([list(f.standard_errors.values()) for f in fits], axis=0)
    scatter = np.std([list(f.coefficients.values()) for f in fits], axis=0, ddof=1)
    assert list(fits[0].standard_errors) == list(fits[0].coefficients)
    assert np.all(scatter / claimed > 0.5)
    assert np.all(scatter / claimed < 2.0)


def test_before_and_after_are_the_errors_of_the_nominal_and_the_fitted_tool(outcomes: dict) -> None:
    fit = outcomes[Heating.ROOM][0].accelerometers
    assert fit.before.size_max > 50.0 * fit.after.size_max
    assert fit.after.size_rms == pytest.approx(1e-4, rel=0.4)
    tool, design = draw_tool(1), make_design(Heating.ROOM, 1)
    record = measure_tool(tool, design, 1)
    raw = np.linalg.norm(vectors_of_volts(nominal_triad("ABC", 3.0), record.gravity_volts, record.temperature), axis=1)
    assert fit.before.size_max == pytest.approx(float(np.max(np.abs(raw - 1.0))), rel=1e-12)


def test_twelve_parameters_over_a_range_of_temperatures_are_warned_about() -> None:
    tool, design = draw_tool(1), make_design(Heating.ALTERNATING)
    record = measure_tool(tool, design, 1)
    fit = solve_accelerometers(record.gravity_volts, record.temperature, design.tilt, 12)
    assert any("one temperature" in w for w in fit.warnings)


@pytest.mark.slow
def test_table_of_the_experiment_has_a_row_for_each_design() -> None:
    steps: list[int] = []
    table = run_study(2, lambda: steps.append(1))
    assert len(steps) == 2 * len(table["cases"])
    assert all(row["converged"] == 1.0 and row["cost_difference_max"] < 1e-4 for row in table["cases"])


class TestRefusals:
    """Each says which reading and why."""

    @pytest.fixture
    def record(self) -> dict[str, np.ndarray]:
        design = make_design(Heating.ROOM)
        record = measure_tool(draw_tool(1), design, 1)
        return {
            "volts": record.gravity_volts.copy(),
            "temperature": record.temperature.copy(),
            "tilt": design.tilt.copy(),
        }

    @pytest.mark.parametrize("column", ["volts", "temperature", "tilt"])
    def test_what_is_not_finite(self, record: dict, column: str) -> None:
        record[column][6] = math.nan
        with pytest.raises(CalibrationError, match=r"reading 7: .*not finite"):
            solve_accelerometers(**record, parameters=12)

    def test_degrees(self, record: dict) -> None:
        record["tilt"] = np.degrees(record["tilt"])
        with pytest.raises(CalibrationError, match="degrees"):
            solve_accelerometers(**record, parameters=12)

    def test_kelvin(self, record: dict) -> None:
        record["temperature"] += 273.15
        with pytest.raises(CalibrationError, match="kelvin"):
            solve_accelerometers(**record, parameters=12)

    def test_metres_per_second_squared(self, record: dict) -> None:
        record["volts"] *= 9.81
        with pytest.raises(CalibrationError, match=r"reading 1: .*units"):
            solve_accelerometers(**record, parameters=12)

    def test_a_reading_that_moved(self, record: dict) -> None:
        record["tilt"][20] += math.radians(2.0)
        with pytest.raises(CalibrationError, match="reading 21: its angle"):
            solve_accelerometers(**record, parameters=12)

    def test_too_few_readings(self, record: dict) -> None:
        with pytest.raises(CalibrationError, match="at least 15 readings"):
            solve_accelerometers(**{k: v[:14] for k, v in record.items()})

    def test_a_tool_face_reference_with_a_gap(self, record: dict) -> None:
        with pytest.raises(CalibrationError, match="tool-face reference"):
            solve_accelerometers(**record, parameters=12, tool_face_reference=np.full(84, math.nan))

    def test_a_vertical_for_another_number_of_readings(self, record: dict) -> None:
        with pytest.raises(CalibrationError, match="readings of 3 voltages"):
            solve_magnetometers(record["volts"], record["temperature"], np.ones((5, 3)), FIELD, DIP, 12)

    def test_a_number_of_parameters_that_is_none(self, record: dict) -> None:
        with pytest.raises(CalibrationError, match="12 or 30"):
            solve_accelerometers(**record, parameters=20)

    def test_thirty_parameters_at_one_temperature(self, record: dict) -> None:
        with pytest.raises(CalibrationError, match="temperatures"):
            solve_accelerometers(**record)

    @pytest.mark.parametrize("tilt_number", range(7))
    def test_one_tilt(self, record: dict, tilt_number: int) -> None:
        rows = slice(12 * tilt_number, 12 * tilt_number + 12)
        with pytest.raises(CalibrationError, match=r"1 reference angles.*more tilts"):
            solve_accelerometers(**{k: v[rows] for k, v in record.items()}, parameters=12)

    def test_two_tool_faces(self, record: dict) -> None:
        with pytest.raises(CalibrationError, match="three tool faces"):
            solve_accelerometers(**{k: v[::6] for k, v in record.items()}, parameters=12)

    def test_a_design_that_cannot_is_refused_before_the_search(self, record: dict) -> None:
        made = accelerometer_record(*(v[::6] for v in record.values()))
        with pytest.raises(CalibrationError, match="cannot tell"):
            refuse_open(made, made.problem(12), free_parameter_matrix(12, "ABC"))


@pytest.mark.slow
@settings(deadline=None, max_examples=5)
@given(seed=st.integers(0, 10**6))
def test_magnetometers_reach_the_accuracy_of_the_accelerometers(seed: int) -> None:
    tool, design = draw_tool(seed), make_design(Heating.SHUFFLED, seed)
    record = measure_tool(tool, design, seed)
    fit = solve_accelerometers(record.gravity_volts, record.temperature, design.tilt)
    gravity = vectors_of_volts(fit.triad, record.gravity_volts, record.temperature)
    field = solve_magnetometers(record.field_volts, record.temperature, gravity, FIELD, DIP)
    assert field.after.size_rms < 2e-4 * FIELD
    assert field.before.size_rms > 50.0 * field.after.size_rms
    assert field.predicted_size_std < 6e-4 * FIELD


def test_a_fit_is_frozen(outcomes: dict) -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        outcomes[Heating.ROOM][0].accelerometers.cost = 0.0
