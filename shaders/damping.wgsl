// How much Newton's steps are damped: λ of (H + λL) p = −g, one trial a tick. Twin: src/damping.rs,
// which says why.

const FIRST: real = real(1e-2);
const GROWTH: real = real(4.0);
const DECAY: real = real(0.1);
const LEAST: real = real(1e-4);
const MOST: real = real(1e8);
const ACCEPTED: real = real(1e-3);
const POOR: real = real(0.25);
const GOOD: real = real(0.75);
const ROUNDING: real = real(16.0);

//:if F64
const EPSILON: real = real(2.220446049250313e-16);
//:else
const EPSILON: real = real(1.1920929e-7);
//:end

// What a trial along p = −(H + λL)⁻¹g found.
struct Trial {
    // Whether all pivots of H + λL are positive.
    sound: bool,
    // g·p, and the slope along p at the trial.
    slope: real,
    slope_there: real,
    // Energies before and at the trial.
    energy: real,
    energy_there: real,
    // The part of p that was taken.
    alpha: real,
}

struct Damping {
    lambda: real,
    verdict: u32,
}

// Judges a trial, and sets the next λ.
fn damped(lambda: real, trial: Trial) -> Damping {
    let finite = !is_out_of_range(trial.energy_there) && !is_out_of_range(trial.slope_there);
    if (!trial.sound || !finite || is_out_of_range(trial.slope) || trial.slope >= real(0)) {
        return failed(lambda);
    }
    let promised = -(trial.alpha * trial.slope * (real(1) - real(0.5) * trial.alpha));
    let fallen = trial.energy - trial.energy_there;
    let rounding = ROUNDING * (EPSILON * abs(trial.energy));
    if (promised < rounding) {
        // Energies say nothing any more, slopes still do.
        if (abs(trial.slope_there) <= abs(trial.slope) && abs(fallen) <= real(2) * rounding) {
            return Damping(real(0), VERDICT_ACCEPT);
        }
        return failed(lambda);
    }
    if (fallen < ACCEPTED * promised) {
        return failed(lambda);
    }
    if (fallen < POOR * promised) {
        return Damping(grown(lambda), VERDICT_ACCEPT);
    }
    if (fallen > GOOD * promised) {
        let less = DECAY * lambda;
        return Damping(select(less, real(0), less < LEAST), VERDICT_ACCEPT);
    }
    return Damping(lambda, VERDICT_ACCEPT);
}

fn failed(lambda: real) -> Damping {
    let more = grown(lambda);
    return Damping(more, select(VERDICT_AGAIN, VERDICT_FAIL, more > MOST));
}

fn grown(lambda: real) -> real {
    return max(GROWTH * lambda, FIRST);
}
