"""The captions of the report: what its charts show, of which model, and against which truth."""

from ..results import whiteness
from ..text.counts import in_percent
from .charts import stability, transfer
from .run import Run

ABOUT_MODEL = {
    "linear_physical": "In this run the estimator knows nothing of the lever's geometry. It takes arm and lever "
    "together for a mass m on a spring k with a damper c, shaken by the floor, the angle for a distance and the torque "
    "for a force: θ̈ = −(k/m) θ − (c/m) θ̇ + z̈ + τ<sub>m</sub>/m.",
    "linear_black_box": "In this run the estimator asks for no mass, damping or stiffness, but for the three numbers "
    "of any second-order system, θ̈ = a<sub>21</sub> θ + a<sub>22</sub> θ̇ + b<sub>21</sub> z̈. Natural frequency and "
    "damping ratio follow from the first two.",
    "hand": "In this run the estimator takes the pilot for a hand as Mayo (1989) measured it on people: on a spring "
    "and a damper in the cabin, and damped in space as well, so that the lever leans while the cabin climbs. Its "
    "vertical motion d in the cabin is d̈ = −k<sub>hand</sub> d − c<sub>hand</sub> ḋ − z̈ − c<sub>space</sub> ż, all "
    "per unit of its mass, and θ is the trim + d/(ℓ cos θ<sub>0</sub>).",
}
PARAMETERS = {
    "lever": "Mass, damping and stiffness of the pilot's arm",
    "linear_physical": "Mass, damping and stiffness that the linear model needs to move as the lever does",
    "linear_black_box": "The three coefficients of a second-order system that moves as the lever does",
    "hand": "Stiffness and damping of the pilot's hand, and the part of the damping that is against space",
}


def about(run: Run) -> list[str]:
    """Sentences, as HTML, on what is special in this run's model and truth; none for the lever."""
    sentences = [ABOUT_MODEL[run.model]] if run.model in ABOUT_MODEL else []
    if run.mismatch is not None:
        sentences.append(
            f"<strong>The truth of this run is of another kind:</strong> {run.about_truth}. The "
            "parameters of the estimator's model have no true values then; what can be compared are natural frequency "
            "and damping ratio, the answer to the floor, and whether the innovations are white."
        )
    return sentences


def parameters_caption(run: Run) -> str:
    """Return what the chart of the parameters shows."""
    shown = f"{PARAMETERS[run.model]}, with a band of ±2σ"
    if run.mismatch is not None:
        return (
            f"{shown}. They have no true values: the pilot of this run is not one that the model can represent, and "
            "these are the values with which it fits the motion best."
        )
    if not run.has_truth:
        return f"{shown}."
    return f"{shown}: the blue line should follow the dashed one, which the band should contain about 95 % of the time."


def dynamics_caption(run: Run) -> str:
    """Return what the chart of natural frequency and damping ratio shows."""
    sentences = [
        "What decides about collective bounce: how fast arm and lever swing by themselves, and how quickly that dies "
        "out (a damping ratio of 1 is no swing at all)."
    ]
    if _has_scale(run):
        sentences.append("Both are usually known better than the three parameters, whose common scale cancels in them.")
    if run.about_true_dynamics:
        sentences.append(run.about_true_dynamics)
    return " ".join(sentences)


def feedthrough_caption(run: Run) -> str:
    """Return what the Bode diagram with its band shows, and how good it was where the truth is known."""
    sentences = [
        "The same at one time, as a Bode diagram: magnitude and phase, and below the measured coherence of floor and "
        "lever over the whole run. Where that is low, noise, torque or the pilot's own movement move the lever, and "
        "there is little to learn from the floor. Between 2 and 8 Hz the shaded band is ±2σ, as the estimator sends "
        "it; it contains what the parameters leave open, not what the model cannot do."
        '<span class="screen"> Drag the slider through the run.</span>'
    ]
    if (accuracy := transfer.accuracy(run)) is not None:
        sentences.append(
            f"After the first third of the run the complex error was {100.0 * accuracy.error:.1f} % rms; ±2σ held the "
            f"true magnitude {in_percent(accuracy.gain_covered):g} % and the true phase "
            f"{in_percent(accuracy.phase_covered):g} % of the time."
        )
    return " ".join(sentences)


def margin_caption(run: Run) -> str:
    """Return what the chart of the margin to collective bounce shows, and how good it was where the truth is known."""
    sentences = [
        "By how much the loop through arm, lever and rotor may grow until it is unstable, with a band of ±2σ; at 0 dB "
        "it is. Dotted lines are that limit and those of warning and alarm, bars at the foot the times of these. "
        "Below, the frequency at which it would begin, and with mitigation the correction of the lever's angle. There "
        "is nothing where the estimate does not carry it."
    ]
    if (accuracy := stability.accuracy(run)) is not None:
        sentences.append(
            f"After the first third of the run the estimated margin was {abs(accuracy.bias):.1f} dB too "
            f"{'high' if accuracy.bias > 0.0 else 'low'} (median; an estimate that is too high warns too late), and "
            f"±2σ held the true one {in_percent(accuracy.covered):g} % of the time."
        )
    return " ".join(sentences)


def excitation_caption(run: Run) -> str:
    """Return what the chart of the excitation shows."""
    sentences = ["What shakes the lever. Without motion there is nothing to learn from."]
    if _has_scale(run):
        sentences.append(
            "Without motor torque only ratios of the three parameters can be known, and the bands above must be wide."
        )
    return " ".join(sentences)


def _has_scale(run: Run) -> bool:
    """Return whether the parameters have a common scale that base motion alone does not determine."""
    return run.model in ("lever", "linear_physical")


def whiteness_caption(run: Run) -> str:
    """Return what the chart of the autocorrelation shows."""
    verdict = whiteness.verdict(run.whiteness)
    return (
        "What is left of the rate: autocorrelation of measured minus estimated rate, averaged over 20 ms. Chance alone "
        "keeps all bars in the band in 95 % of runs; beyond the dotted lines something moves the lever that the model "
        f"does not know. {verdict}"
    )
