#include "plants.h"

#include <math.h>
#include <stddef.h>

/* A signal over one sample period: its value at the first sample, and the change until the next one. */
typedef struct line {
    double begin;
    double change;
} line_t;

static line_t line_of(const double *signal, uint32_t period)
{
    const line_t line = {signal[period], signal[period + 1u] - signal[period]};
    return line;
}

/* What acts in one substep. */
typedef struct drive {
    double z_ddot; /* [m/s^2] */
    double kick;   /* on theta_dot [rad/s] */
    double push;   /* [N m s] */
} drive_t;

/* The substeps of one sample period. */
typedef struct period {
    line_t z_ddot;
    line_t disturbance;
    const double *normal;
} period_t;

static period_t period_of(const plant_t *plant, uint32_t period)
{
    const period_t result = {line_of(plant->z_ddot, period), line_of(plant->disturbance, period),
        &plant->normal[(size_t)period * plant->substeps]};
    return result;
}

static drive_t drive_of(const plant_t *plant, const period_t *period, uint32_t substep)
{
    const double part = ((double)substep + 0.5) / (double)plant->substeps;
    const drive_t drive = {period->z_ddot.begin + (period->z_ddot.change * part), plant->kick * period->normal[substep],
        plant->step * (period->disturbance.begin + (period->disturbance.change * part))};
    return drive;
}

/* --- lever ------------------------------------------------------------------------------------------------------- */

typedef struct resistance {
    double torque; /* [N m] */
    double slope;  /* [N m s/rad] */
} resistance_t;

/* By which the lever's own damper and friction resist. */
static resistance_t resistance_of(const plant_lever_t *lever, double rate)
{
    resistance_t result = {lever->damping * rate, lever->damping};
    if (lever->friction > 0.0) {
        const double speed = sqrt((rate * rate) + (lever->stop_rate * lever->stop_rate));
        const double friction = lever->friction / speed;
        const double ratio = lever->stop_rate / speed;
        result.torque += friction * rate;
        result.slope += friction * (ratio * ratio);
    }
    return result;
}

/* Sums over the substeps of a period, for the mean force of the hand. */
typedef struct sums {
    double motor;
    double z_ddot;
    double kick;
    double push;
} sums_t;

/* Of the hand on the lever [N], since the lever was at `begin` with the rate `begin_dot`. */
static double force_on_lever(
    const plant_t *plant, double begin, double begin_dot, const sums_t *sums, double rest, double command)
{
    const plant_lever_t *lever = &plant->lever;
    const double count = (double)plant->substeps;
    const double period = plant->step * count;
    const double middle = 0.5 * (begin + plant->theta);
    double own = lever->own_inertia * (plant->theta_dot - begin_dot) / period;
    own += resistance_of(lever, (plant->theta - begin) / period).torque + (lever->stiffness * (middle - rest));
    own += lever->own_moment * ((sums->z_ddot / count) + lever->weight) * cos(middle);
    const double motor = command + (sums->motor / count);
    return (own - motor - ((sums->kick + sums->push) / period)) / lever->length;
}

/* With the torque `reflex` of the arm [N m] held, too. */
static void advance_lever(plant_t *plant, uint32_t at, double command, double reflex)
{
    const double mass = plant->column[0][at];
    const double moment = plant->column[1][at];
    const double arm_damping = plant->column[2][at];
    const double arm_stiffness = plant->column[3][at];
    const double hold = plant->column[4][at];
    const double rest = plant->column[5][at];
    const plant_lever_t *lever = &plant->lever;
    const period_t period = period_of(plant, at);
    const double begin = plant->theta;
    const double begin_dot = plant->theta_dot;
    const double step = plant->step;
    const double half = 0.5 * step;
    double theta = begin;
    double theta_dot = begin_dot;
    double torque = plant->tau_m - command;
    sums_t sums = {0.0, 0.0, 0.0, 0.0};
    for (uint32_t i = 0u; i < plant->substeps; i++) {
        const drive_t drive = drive_of(plant, &period, i);
        const double middle = theta + (half * theta_dot);
        const double sine = sin(middle);
        const double cosine = cos(middle);
        const resistance_t resisting = resistance_of(lever, theta_dot);
        const double damping = arm_damping * cosine * cosine;
        const double motor = torque * plant->lag_middle;
        const double kick = mass * drive.kick;
        const double force = (command + reflex) + motor -
                             (((moment * drive.z_ddot) + (arm_stiffness * sine) - hold) * cosine) -
                             (lever->stiffness * (middle - rest)) - (damping * theta_dot) - resisting.torque;
        const double change = ((step * force) + (kick + drive.push)) / (mass + (half * (damping + resisting.slope)));
        theta += step * (theta_dot + (0.5 * change));
        theta_dot += change;
        torque *= plant->lag;
        sums.motor += motor;
        sums.z_ddot += drive.z_ddot;
        sums.kick += kick;
        sums.push += drive.push;
    }
    plant->theta = theta;
    plant->theta_dot = theta_dot;
    plant->tau_m = command + torque;
    if (plant->has_grip_force) {
        plant->grip_force = force_on_lever(plant, begin, begin_dot, &sums, rest, command);
    }
}

/* --- reflex ------------------------------------------------------------------------------------------------------ */

static void advance_reflex(plant_t *plant, uint32_t at, double command)
{
    const double *force_at = plant->reflex_force;
    const double length = plant->lever.length;
    const double k_r = plant->column[6][at];
    const double c_r = plant->column[7][at];
    const double rest_sine = plant->column[8][at];
    const double height = length * (sin(plant->theta) - rest_sine);
    plant->reflex_force[at] = (k_r * height) + (c_r * length * cos(plant->theta) * plant->theta_dot);
    const double wanted = fmax((double)at - plant->reflex.late, 0.0);
    const uint32_t before = (uint32_t)wanted;
    double force = force_at[before];
    if (wanted > (double)before) {
        force += (wanted - (double)before) * (force_at[before + 1u] - force);
    }
    const double leverage = length * cos(plant->theta + (plant->reflex.middle * plant->theta_dot));
    advance_lever(plant, at, command, 0.0 - (leverage * force));
}

/* --- linear ------------------------------------------------------------------------------------------------------ */

static void advance_linear(plant_t *plant, uint32_t at, double command)
{
    const double stiffness = plant->column[0][at];
    const double damping = plant->column[1][at];
    const double gain = plant->column[2][at];
    const double compliance = plant->column[3][at];
    const double rest = plant->column[4][at];
    const period_t period = period_of(plant, at);
    const double step = plant->step;
    const double half = 0.5 * step;
    double torque = plant->tau_m - command;
    for (uint32_t i = 0u; i < plant->substeps; i++) {
        const drive_t drive = drive_of(plant, &period, i);
        const double noise = drive.kick + (compliance * drive.push);
        double force = (gain * drive.z_ddot) + (compliance * (command + (torque * plant->lag_middle)));
        force -= (stiffness * (plant->theta + (half * plant->theta_dot) - rest)) + (damping * plant->theta_dot);
        const double change = ((step * force) + noise) / (1.0 + (half * damping));
        plant->theta += step * (plant->theta_dot + (0.5 * change));
        plant->theta_dot += change;
        torque *= plant->lag;
    }
    plant->tau_m = command + torque;
}

/* --- two degrees of freedom -------------------------------------------------------------------------------------- */

static void advance_two_dof(plant_t *plant, uint32_t at, double command)
{
    const double inertia = plant->column[0][at];
    const double moment = plant->column[1][at];
    const double m_t = plant->column[2][at];
    const double c_p = plant->column[3][at];
    const double k_p = plant->column[4][at];
    const double c_t = plant->column[5][at];
    const double k_t = plant->column[6][at];
    const double rest_sine = plant->column[7][at];
    const double rest = plant->column[8][at];
    const double length = plant->lever.length;
    const period_t period = period_of(plant, at);
    const double step = plant->step;
    const double half = 0.5 * step;
    double torque = plant->tau_m - command;
    for (uint32_t i = 0u; i < plant->substeps; i++) {
        const drive_t drive = drive_of(plant, &period, i);
        const double noise = (inertia * drive.kick) + drive.push;
        const double middle = plant->theta + (half * plant->theta_dot);
        const double trunk = plant->s + (half * plant->s_dot);
        const double sine = sin(middle);
        const double cosine = cos(middle);
        const double rise = length * cosine;
        const double arm =
            (k_p * ((length * (sine - rest_sine)) - trunk)) + (c_p * ((rise * plant->theta_dot) - plant->s_dot));
        double lever = command + (torque * plant->lag_middle) - (moment * cosine * drive.z_ddot) - (rise * arm);
        const resistance_t resisting = resistance_of(&plant->lever, plant->theta_dot);
        lever -= resisting.torque + (plant->lever.stiffness * (middle - rest));
        double seat = arm - (m_t * drive.z_ddot) - (c_t * plant->s_dot) - (k_t * trunk);
        lever = (step * lever) + noise;
        seat = step * seat;
        const double cross = -half * c_p * rise;
        const double lever_mass = inertia + (half * resisting.slope) - (cross * rise);
        const double trunk_mass = m_t + (half * (c_p + c_t));
        const double determinant = (lever_mass * trunk_mass) - (cross * cross);
        const double change = ((trunk_mass * lever) - (cross * seat)) / determinant;
        const double trunk_change = ((lever_mass * seat) - (cross * lever)) / determinant;
        plant->theta += step * (plant->theta_dot + (0.5 * change));
        plant->theta_dot += change;
        plant->s += step * (plant->s_dot + (0.5 * trunk_change));
        plant->s_dot += trunk_change;
        torque *= plant->lag;
    }
    plant->tau_m = command + torque;
}

/* --- structural damping ------------------------------------------------------------------------------------------ */

/* At the beginning of a period: where the elements hang moves with the trim. */
static void move_elements(plant_t *plant, double rest_sine)
{
    const double moved = plant->lever.length * (rest_sine - plant->rest_sine);
    for (uint32_t j = 0u; j < (uint32_t)PLANT_ELEMENTS; j++) {
        plant->forces[j] -= plant->elements.springs[j] * moved;
    }
    plant->rest_sine = rest_sine;
}

static void advance_hysteretic(plant_t *plant, uint32_t at, double command)
{
    const double mass = plant->column[0][at];
    const double moment = plant->column[1][at];
    const double k_p = plant->column[2][at];
    const double rest_sine = plant->column[3][at];
    const double rest = plant->column[4][at];
    const plant_elements_t *elements = &plant->elements;
    const double length = plant->lever.length;
    const period_t period = period_of(plant, at);
    const double step = plant->step;
    const double half = 0.5 * step;
    double torque = plant->tau_m - command;
    move_elements(plant, rest_sine);
    for (uint32_t i = 0u; i < plant->substeps; i++) {
        const drive_t drive = drive_of(plant, &period, i);
        const double middle = plant->theta + (half * plant->theta_dot);
        const double sine = sin(middle);
        const double rise = length * cos(middle);
        const resistance_t resisting = resistance_of(&plant->lever, plant->theta_dot);
        double of_elements = 0.0;
        for (uint32_t j = 0u; j < (uint32_t)PLANT_ELEMENTS; j++) {
            of_elements += elements->until_middle[j] * plant->forces[j];
        }
        double arm = (elements->spring * length * (sine - rest_sine)) + of_elements;
        arm += elements->damper * rise * plant->theta_dot;
        double force =
            command + (torque * plant->lag_middle) - (rise / length * moment * drive.z_ddot) - (rise * k_p * arm);
        force -= (plant->lever.stiffness * (middle - rest)) + resisting.torque;
        const double impulse = (mass * drive.kick) + drive.push;
        const double change =
            ((step * force) + impulse) / (mass + (half * ((k_p * elements->damper * rise * rise) + resisting.slope)));
        const double stretch = rise * (plant->theta_dot + (0.5 * change));
        for (uint32_t j = 0u; j < (uint32_t)PLANT_ELEMENTS; j++) {
            plant->forces[j] = (elements->decay[j] * plant->forces[j]) + (elements->stretched[j] * stretch);
        }
        plant->theta += step * (plant->theta_dot + (0.5 * change));
        plant->theta_dot += change;
        torque *= plant->lag;
    }
    plant->tau_m = command + torque;
}

void plant_advance(plant_t *plant, uint32_t period, double command)
{
    switch (plant->kind) {
    case PLANT_LEVER:
        advance_lever(plant, period, command, 0.0);
        break;
    case PLANT_REFLEX:
        advance_reflex(plant, period, command);
        break;
    case PLANT_LINEAR:
        advance_linear(plant, period, command);
        break;
    case PLANT_TWO_DOF:
        advance_two_dof(plant, period, command);
        break;
    default:
        advance_hysteretic(plant, period, command);
        break;
    }
}

void plant_move(plant_t *plant, const double *command, uint32_t count, double *theta, double *theta_dot, double *tau_m)
{
    for (uint32_t i = 0u; i < count; i++) {
        theta[i] = plant->theta;
        theta_dot[i] = plant->theta_dot;
        tau_m[i] = plant->tau_m;
        if ((i + 1u) < count) {
            plant_advance(plant, i, command[i]);
        }
    }
}
