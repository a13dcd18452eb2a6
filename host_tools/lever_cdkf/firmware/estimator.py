"""One estimator without CAN hardware: samples or frames in, estimates or frames out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from ..errors import LeverError
from .aircraft import AircraftResponse, Correction, Stability
from .config import CHOICES, Config, choice_value, given
from .library import enum_names, ffi, lib, load, struct_dtype

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

FRAME_SAMPLE: int = lib.LEVER_FRAME_SAMPLE
"""What on_frame() returns when a sample is complete: call step() now."""

DO_NOT_TRUST: int = lib.LEVER_FAULTS_DO_NOT_TRUST
"""Mask of the faults with any of which the estimates are not to be trusted: enum lever_faults says why."""

FEEDTHROUGH_FREQUENCIES = tuple(range(2, 9))
"""What FEEDTHROUGH is sent for on the bus, one after the other [Hz]."""

TEST_RATIOS = tuple(
    ffi.string(lib.lever_test_ratio_name(index)).decode().lower() for index in range(lib.LEVER_TEST_RATIOS)
)
"""The statistics that are watched for faults and changes: "base_stuck"."""

_SAMPLE_VALUES = ("theta", "theta_dot", "tau_m", "z_ddot", "grip_force")
"""What a sample may hold besides its time, each with a flag: lever_sample_t."""

_MODES = enum_names("lever_mode")
_BOUNCE = enum_names("lever_bounce")


class Estimate(NamedTuple):
    """lever_estimate_t: the estimate after the last sample; _sigma: standard deviation, in the unit of its value."""

    time_us: int
    """Time of the sample [µs], wraps at 2**32."""
    theta: float
    """Lever angle [rad]."""
    theta_sigma: float
    theta_dot: float
    """Lever rate [rad/s]."""
    theta_dot_sigma: float
    parameter: tuple[float, float, float]
    """Of the model: name and unit of each are in model_parameters(model)."""
    parameter_sigma: tuple[float, float, float]
    parameter_correlation: tuple[float, float, float]
    """Of their errors [1]: first and second, first and third, second and third."""
    natural_frequency: float
    """Undamped, of arm and lever about the trim [Hz]."""
    natural_frequency_sigma: float
    damping_ratio: float
    """[1]"""
    damping_ratio_sigma: float
    trim: float
    """Angle about which the dynamics are linearised [rad]."""
    nis: float
    """Normalised innovation squared [1], chi-square with nis_size degrees of freedom; 0 without measurement."""
    nis_size: int


class Feedthrough(NamedTuple):
    """lever_feedthrough_t: θ/z̈ of the estimated model at one frequency, and how sure it is."""

    response: complex
    """[rad/(m/s²)]"""
    gain_sigma: float
    """Standard deviation of the gain, relative to it [1]: of the error along the phasor."""
    phase_sigma: float
    """Standard deviation of the phase [rad]: of the error across the phasor."""
    correlation: float
    """Of the errors of gain and phase [1]."""


class Health(NamedTuple):
    """lever_health_t: mode, faults at the last sample, and counts since the start."""

    mode: str
    """A name of enum_names("lever_mode")."""
    faults: tuple[str, ...]
    """Names of enum_names("lever_fault")."""
    samples: int
    lost: int
    corrupt: int
    late: int
    recoveries: int
    excitation: float
    """rms of theta_dot [rad/s]."""
    torque: float
    """What the torque gate asks of the motor until the next sample [N m]."""
    gate_open: bool
    """Whether torque may be other than zero: see lever_idle() of the façade."""


def fault_names(faults: int) -> tuple[str, ...]:
    """Return the names of the bits in a fault mask."""
    return tuple(name for bit, name in enum_names("lever_fault").items() if faults & bit)


def health_of(pointer: Any) -> Health:
    """Return the content of a lever_health_t."""
    values = {name: getattr(pointer, name) for name in Health._fields}
    return Health(**values | {"mode": _MODES[values["mode"]], "faults": fault_names(values["faults"])})


def make_command(request: str = "none", dither_rms: float | None = None, **choices: str | None) -> Any:
    """Return a lever_command_t *; None keeps a choice (of CHOICES) or the dither as it is."""
    command = ffi.new("lever_command_t *", {"dither_rms": lib.LEVER_KEEP if dither_rms is None else dither_rms})
    command.request = choice_value("lever_request", "request", request)
    for what in CHOICES:
        name = choices.get(what)
        setattr(command, what, lib.LEVER_KEEP if name is None else choice_value(f"lever_{what}", what, name))
    return command


class Estimator:
    """An instance of the firmware. Any number may exist; each belongs to one thread at a time.

    Parameters
    ----------
    config
        Its configuration; None: the firmware's defaults.

    Raises
    ------
    LeverError
        Config.pointer was changed after its check, and the firmware refuses it.
    """

    def __init__(self, config: Config | None = None) -> None:
        self._memory = ffi.new("lever_memory_t *")  # holds the instance: both must live as long as this object
        self._config = given(config)
        self.pointer: Any = lib.lever_init(self._memory, self._config.pointer)
        """For calls of `lib`; valid as long as this object."""
        if self.pointer == ffi.NULL:
            raise LeverError("the firmware refused its configuration: Config.pointer was changed after its check")
        self._sample = ffi.new("lever_sample_t *")
        self._estimate = ffi.new("lever_estimate_t *")
        self._feedthrough = ffi.new("lever_feedthrough_t *")
        self._health = ffi.new("lever_health_t *")
        self._stability = ffi.new("lever_stability_t *")
        self._correction = ffi.new("lever_correction_t *")
        self._aircraft: AircraftResponse | None = None  # which the instance reads
        self._received = ffi.new("lever_frame_t *")
        self._received_data = ffi.buffer(self._received.data)
        self._answer = ffi.new("lever_frame_t *")
        self._answer_data = ffi.buffer(self._answer.data)

    def update(
        self,
        time_us: int,
        theta: float | None = None,
        theta_dot: float | None = None,
        tau_m: float | None = None,
        z_ddot: float | None = None,
        grip_force: float | None = None,
    ) -> str:
        """Take a sample and return the mode after it.

        A value that is None is missing or invalid.

        Parameters
        ----------
        time_us
            Time of the sample [µs]; it is wrapped to 32 bits here.
        theta
            Angle of the lever [rad].
        theta_dot
            Rate of the lever [rad/s].
        tau_m
            Torque of the motor [N m].
        z_ddot
            Vertical acceleration of the base, without gravity [m/s²].
        grip_force
            Force of the hand on the lever [N].

        Returns
        -------
        str
            A name of enum_names("lever_mode").
        """
        sample = self._sample
        sample.time_us = time_us & 0xFFFFFFFF
        for name, value in zip(_SAMPLE_VALUES, (theta, theta_dot, tau_m, z_ddot, grip_force), strict=True):
            setattr(sample, name, 0.0 if value is None else value)
            setattr(sample, f"{name}_valid", value is not None)
        return _MODES[lib.lever_update(self.pointer, sample)]

    def command(
        self,
        request: str = "none",
        *,
        model: str | None = None,
        preload: str | None = None,
        estimator: str | None = None,
        adaptation: str | None = None,
        mitigation: str | None = None,
        dither_rms: float | None = None,
    ) -> None:
        """Carry out a request before the next sample; None keeps a choice as it is.

        Torque and correction fade out a second of sample time after the last command: repeat one.

        Parameters
        ----------
        request
            "none", "run", "freeze" or "reset".
        model, preload, estimator, adaptation, mitigation
            As in Config.
        dither_rms
            The identification torque [N m]; 0 fades it out.

        Raises
        ------
        LeverError
            The firmware refuses the command.
        SettingsError
            A name that the firmware does not know.
        """
        choices = zip(CHOICES, (model, preload, estimator, adaptation, mitigation), strict=True)
        command = make_command(request, dither_rms, **dict(choices))
        if not lib.lever_command(self.pointer, command):
            raise LeverError(f"the firmware refused the command {request!r}, dither_rms = {dither_rms} N m")

    def idle(self, elapsed_us: int) -> None:
        """Age the torque gate while no sample comes.

        Parameters
        ----------
        elapsed_us
            Time since the last sample, or the last call of this [µs].
        """
        lib.lever_idle(self.pointer, elapsed_us)

    def estimate(self) -> Estimate:
        """Return the estimate after the last sample.

        Returns
        -------
        Estimate
            Each value with its unit and its standard deviation.
        """
        lib.lever_estimate(self.pointer, self._estimate)
        values = {name: getattr(self._estimate, name) for name in Estimate._fields}
        for name in ("parameter", "parameter_sigma", "parameter_correlation"):
            values[name] = tuple(values[name])
        return Estimate(**values)

    def feedthrough(self, frequency: float) -> Feedthrough:
        """Return the biodynamic feedthrough θ/z̈ after the last sample.

        Parameters
        ----------
        frequency
            Where it is wanted [Hz].

        Returns
        -------
        Feedthrough
            The response [rad/(m/s²)] and how sure it is.
        """
        raw = self._feedthrough
        lib.lever_feedthrough(self.pointer, frequency, raw)
        response = complex(raw.real, raw.imaginary)
        return Feedthrough(response, raw.gain_sigma, raw.phase_sigma, raw.correlation)

    def test_ratios(self) -> dict[str, float]:
        """Return each statistic that is watched for faults and changes, over its threshold.

        Returns
        -------
        dict
            By the names of TEST_RATIOS [1]; above 1 it is evidence.
        """
        ratios = ffi.new("float[]", lib.LEVER_TEST_RATIOS)
        lib.lever_test_ratios(self.pointer, ratios)
        return dict(zip(TEST_RATIOS, ratios, strict=True))

    def watch(self, aircraft: AircraftResponse | None) -> None:
        """Watch the loop with this aircraft from now on.

        Parameters
        ----------
        aircraft
            How the cabin responds to the lever; None: watch no loop.

        Raises
        ------
        LeverError
            The firmware refuses the response.
        """
        if not lib.lever_aircraft(self.pointer, ffi.NULL if aircraft is None else aircraft.pointer):
            raise LeverError(
                "the firmware refused the response of the aircraft: frequencies must rise from above 0, sigmas lie "
                "between 0 and 1, the warning's limit not below the alarm's, and all of it be finite"
            )
        self._aircraft = aircraft

    def stability(self) -> Stability:
        """Return how near the loop is to collective bounce, as of the last publish_period.

        Returns
        -------
        Stability
            Gain margin [dB], modulus [1] and frequency [Hz] with their standard deviations, and the state of the alarm.
        """
        lib.lever_stability(self.pointer, self._stability)
        values = {name: getattr(self._stability, name) for name in Stability._fields}
        return Stability(**values | {"state": _BOUNCE[values["state"]]})

    def correction(self) -> Correction:
        """Return what mitigation adds to the lever's angle, until the next sample.

        Returns
        -------
        Correction
            The angle [rad], and how much of the mitigation is faded in [1].
        """
        lib.lever_correction(self.pointer, self._correction)
        return Correction(self._correction.angle, self._correction.weight)

    def health(self) -> Health:
        """Return mode, faults and counts after the last sample.

        Returns
        -------
        Health
            Names for mode and faults; counts since the start.
        """
        lib.lever_health(self.pointer, self._health)
        return health_of(self._health)

    def state(self) -> bytes:
        """Return all that its future depends on besides configuration, aircraft and what it is given.

        It is to be called between two samples.

        Returns
        -------
        bytes
            For restore(), in the layout of state_layout().
        """
        room = ffi.new("uint8_t[]", lib.LEVER_STATE_BYTES)
        lib.lever_state_save(self.pointer, room)
        return bytes(room)

    def restore(self, state: bytes) -> bool:
        """Go on from the state of an instance with the same settings.

        Parameters
        ----------
        state
            What state() has returned.

        Returns
        -------
        bool
            False, and unchanged, for a state of another kind.
        """
        return len(state) == lib.LEVER_STATE_BYTES and bool(lib.lever_state_restore(self.pointer, state))

    def on_frame(self, identifier: int, data: bytes | bytearray) -> int:
        """Take a classic CAN frame.

        Parameters
        ----------
        identifier
            11 bits.
        data
            At most 8 bytes.

        Returns
        -------
        int
            FRAME_SAMPLE if the frame completes a sample, which step() then takes.

        Raises
        ------
        LeverError
            The frame is longer than 8 bytes.
        """
        length = len(data)
        if length > 8:
            raise LeverError(f"frame {identifier:#x} has {length} bytes; a classic CAN frame has at most 8")
        received = self._received
        received.id = identifier
        received.length = length
        self._received_data[0:length] = data
        return lib.lever_on_frame(self.pointer, received)  # type: ignore[no-any-return]

    def step(self) -> int:
        """Take the sample that on_frame() has completed.

        Returns
        -------
        int
            The mode, a key of enum_names("lever_mode").
        """
        return lib.lever_step(self.pointer)  # type: ignore[no-any-return]

    def next_frame(self) -> tuple[int, bytes] | None:
        """Return the next frame to send.

        Fetch all of them after every frame taken: a COMMAND is acknowledged, sample or not.

        Returns
        -------
        tuple of int and bytes, or None
            Identifier and data; None when there is none left.
        """
        answer = self._answer
        if not lib.lever_next_frame(self.pointer, answer):
            return None
        return answer.id, self._answer_data[0 : answer.length]


def state_layout() -> int:
    """Return the layout of the bytes of state(): those of another version of the firmware have another one."""
    return int(lib.lever_state_layout())


class Recorder:
    """Sends the state of an estimator each `period` seconds of sample time, as SNAPSHOT frames."""

    def __init__(self, estimator: Estimator, period: float) -> None:
        self._estimator = estimator
        self.pointer: Any = ffi.new("lever_recorder_t *")
        lib.lever_recorder_init(self.pointer, round(period * 1e6))
        self._frame = ffi.new("lever_frame_t *")

    def frames(self) -> Iterator[tuple[int, bytes]]:
        """Yield the frames to send now.

        To be called after a step all of whose frames have been fetched, before the next frame is taken.
        """
        lib.lever_recorder_step(self.pointer, self._estimator.pointer)
        while lib.lever_recorder_next_frame(self.pointer, self._frame):
            yield self._frame.id, bytes(ffi.buffer(self._frame.data))


def feed(estimator: Estimator, samples: NDArray[Any], at: NDArray[np.int64]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Have the estimator take samples (lever_sample_t), up to the last with an index in `at`, which rise.

    Return lever_estimate_t and lever_health_t after each of these.
    """
    import numpy as np

    asked = np.ascontiguousarray(at, np.int64)
    estimates = np.zeros(len(asked), struct_dtype("lever_estimate_t"))
    healths = np.zeros(len(asked), struct_dtype("lever_health_t"))
    load("lever_bulk").bulk_estimates(
        estimator.pointer,
        ffi.from_buffer("lever_sample_t[]", samples),
        ffi.from_buffer("int64_t[]", asked),
        len(asked),
        ffi.from_buffer("lever_estimate_t[]", estimates),
        ffi.from_buffer("lever_health_t[]", healths),
    )
    return estimates, healths


def run_samples(
    config: Config | None, samples: Mapping[str, Any], at: NDArray[np.int64] | None = None
) -> dict[str, NDArray[Any]]:
    """Feed N samples to a fresh estimator and return its estimates after each, or after those with the indices `at`.

    Parameters
    ----------
    config
        The estimator's configuration; None: the firmware's defaults.
    samples
        Columns of N numbers (arrays, lists, of pandas, of polars): time_us [µs] (whole numbers, wrapped here), theta
        [rad], theta_dot [rad/s], tau_m [N m], z_ddot [m/s²], grip_force [N]. Bool columns theta_valid … may say what is
        valid; without them it is what is neither NaN nor null. A column that is missing is never valid.
    at
        Rising indices of the samples after which estimates are wanted; None: after each.

    Returns
    -------
    dict
        Each field of lever_estimate_t in single precision (N by 3 for parameter, parameter_sigma and
        parameter_correlation), mode and faults as the numbers of the façade's enums, and how often the filter was
        restarted so far (recoveries).

    Raises
    ------
    LeverError
        Columns are missing, unknown or of unequal length, or plainly in another unit, such as milliseconds or degrees.
    """
    import numpy as np

    from .samples import sample_array

    config = given(config)
    estimator = Estimator(config)
    taken = sample_array(samples, config.settings["sample_period"])
    count = len(taken)
    asked = np.arange(count) if at is None else np.asarray(at)
    if (len(asked) and not 0 <= asked[0] <= asked[-1] < count) or (np.diff(asked) <= 0).any():
        raise LeverError(f"at: the indices must rise from 0 to at most {count - 1}")
    estimates, healths = feed(estimator, taken, asked)
    columns = {name: estimates[name].copy() for name in estimates.dtype.names or ()}
    return columns | {name: healths[name].copy() for name in ("mode", "faults", "recoveries")}
